"""One control period of a scenario or a recording as a linear model."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.instruments import left_out
from softhand.batch.run import KINDS
from softhand.closed_loop.feedback import follow
from softhand.controllers.controller import Controller
from softhand.derivatives.differences import Function, Slopes, crossed_in, slopes
from softhand.derivatives.linearization import ClosedLoop, Linearization, Switch
from softhand.derivatives.looking import Looks
from softhand.derivatives.model import PeriodModel, beyond
from softhand.derivatives.observer import Observer, output_names
from softhand.derivatives.parameters import WRENCH, WRENCH_NAMES, WRENCH_UNITS, Parameter, find_parameters
from softhand.derivatives.period import MOVED, SLIPS, TOUCHES
from softhand.derivatives.period_tangent import PeriodTangent
from softhand.derivatives.situation import Situation, find_situation
from softhand.derivatives.states import Entries, input_entries, state_entries
from softhand.derivatives.switches import surface_name
from softhand.derivatives.tangent import NoTangentError
from softhand.derivatives.varied import Varied
from softhand.errors import ScenarioError, ScenarioWarning, SimulationStopped
from softhand.laws.law import Law
from softhand.model.world import slides_of
from softhand.numerics.arrays import Array
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.plugins import plugin_name
from softhand.recording.recording import Recording
from softhand.recording.units import slides_in
from softhand.recording.variables import COMMANDED, FOUND_AFTERWARDS, MEASURED_PREFIX
from softhand.scenario.scenario import Scenario
from softhand.simulation.keep import Keep
from softhand.simulation.pushes import Push

_ZERO = np.zeros(1)
_MEMORY_STEP = 1e-6  # of a number of the memory, of its size where that is above 1


def linearize(
    source: Scenario | Recording | str | Path,
    sample: int = 0,
    *,
    parameters: Iterable[str] = (),
    outputs: Iterable[str] = (),
    closed: bool = False,
    state: State | None = None,
    torque: Sequence[float] | Array | None = None,
    controller: Controller | None = None,
    law: Law | None = None,
    overrides: Mapping[str, Any] | None = None,
    **values: Any,
) -> Linearization:
    """The linear model of one control period beside a state: x' = A x + B u + E p, y = C x + D u + F p.

        model = softhand.linearize("hold", parameters=["mass", "wrench"], outputs=["object_position"], closed=True)
        abs(model.closed.eigenvalues()[0])

    x = (q, v, z) in tangent coordinates, the object by a translation and a rotation vector in its own axes. The period
    begins afresh from x, as `Simulation.reset(State(q, v, z))` does: what `midpoint` takes from one step into the next
    is no part of x. The torque is held; the period is that of the controller, where it has one of its own.

    The derivatives are those of the steps as they are computed, by central differences extrapolated once. Where one way
    crosses a switch, that a contact touches, slips, or meets another face or edge, they are one-sided, on the side that
    the state is on, and `switches` says so. Effort limits count in the closed loop, where a torque that is cut does not
    follow the command. Switches inside a controller or a law are not seen. Of the sections `sensing` and `actuation`
    the closed loop has the biases alone, which can be parameters: `sensing.object_position.bias`.

    Args:
        source: a scenario, its name or path, or a recording.
        sample: control period of the run of a scenario, which is run up to there; or sample of a recording, where what
            relaxing dampings remember is taken as relaxed and the controller begins anew. From the end if negative.
        parameters: dotted keys of the scenario with numbers, or their last part, and "wrench", a force and a moment on
            the object at the origin of its frame, world axes. x stays where it is: keys of the start do nothing.
        outputs: variables of a recording, as they are where the period begins.
        closed: whether `closed` is computed, the same with the controller.
        state: in place of that of the sample, at its own time; the controller goes on with its memory, or begins.
        torque: held [N m, N], shape (n,), in place of that of the run.
        controller: in place of the scenario's.
        law: at all tips in place of the scenario's.
        overrides: dotted keys and values put over those of the scenario, not of a recording.
        values: the same by the last part of the key.

    Raises:
        ScenarioError: a parameter or an output is unknown, the sample is none of the run, the state is no number or not
            of this plant, or the stepper has no steps of one length.
        RecordingError: the recording lacks what tells its states, or has no number there.
        SimulationStopped: the period does not come to its end.
        SofthandError: as `build`.

    Warns:
        ScenarioWarning: the scenario has delays, holds, filters or drives, which the closed loop leaves out.
    """
    at = find_situation(source, sample, state, torque, controller, law, overrides, values)
    ideal = left_out(at.setup.scenario) if closed else []
    if ideal:
        warnings.warn(
            f"linearize: the closed loop is the one without {', '.join(ideal)}, which are no part of x; "
            "softhand.stability has delays, holds, filters and lags in its loop, softhand.simulate all.",
            ScenarioWarning,
            stacklevel=2,
        )
    return linearize_at(at, parameters, outputs, closed)


def linearize_at(
    at: Situation, parameters: Iterable[str] = (), outputs: Iterable[str] = (), closed: bool = False
) -> Linearization:
    """As `linearize`, where the place is known already."""
    work = Work(at, outputs, closed)
    return work.linearization(work.found(parameters))


class _Blocks(NamedTuple):
    """Derivatives of the three things that a move changes."""

    end: Array
    """x'"""
    seen: Array
    """y"""
    said: Array
    """Command, and memory after it."""


class Work:
    """Linearizations of one plant and controller at work.

    Args:
        at: where, and of what.
        outputs: as `linearize`.
        closed: likewise.
        again: whether this is done for many states, so that it pays to compile the derivatives themselves.
    """

    def __init__(self, at: Situation, outputs: Iterable[str], closed: bool, again: bool = False) -> None:
        self.at, self.keep, self.closed = at, _kept(outputs, at), closed
        self.n, self.slides, self.period = at.plant.world.n_joints, at.slides, at.period
        self.switches: list[Switch] = []
        self.model = self._model(at.plant, straight=True)
        self.states = state_entries(at.plant, self.slides, self.model.remembered, self.period)
        self.rows = self._rows()
        self.observer = self._observer(Varied(at.plant, at.probe, at.setup.controller))
        looks = None if closed else Looks(self.model, at.probe, self.keep)
        self._look: Function = self.observer.at if looks is None else looks.at
        self._looks = looks if again else None
        self._inputs: Entries | None = None
        self._tangents: dict[bool, PeriodTangent | None] = {} if again else {False: None, True: None}

    def found(self, parameters: Iterable[str]) -> list[Parameter | str]:
        """The parameters of these names."""
        names = [parameters] if isinstance(parameters, str) else list(parameters)
        return find_parameters(self.at.setup.scenario, self.at.plant.world, names) if names else []

    def move(self, state: State, torque: Array) -> None:
        """On to another state, without a controller."""
        self.at, self.switches = replace(self.at, state=state, torque=torque), []
        self.model.put(state, torque)
        self.at.probe.reference.update(state.time)

    def linearization(self, chosen: list[Parameter | str]) -> Linearization:
        """All that is asked for, here."""
        s, n, states = len(self.states.names), self.n, self.states
        ends = self._ends(WRENCH in chosen)
        A, B, by_wrench = ends[:, :s], ends[:, s : s + n], ends[:, s + n :]
        value, seen = self._seen() if self.keep.variables or self.closed else (np.zeros(0), np.zeros((0, s)))
        y = len(seen) - self._answers
        C, D = seen[:y], self._through.copy()
        by = [self._by(one, by_wrench, y) for one in chosen]
        E, F, said = (
            np.hstack([block[k] for block in by]) if by else np.zeros((size, 0))
            for k, size in enumerate((s, y, self._answers))
        )
        loop = self._loop(A, B, E, C, D, F, seen[y:], said) if self.closed else None
        names, units = _told(chosen)
        return Linearization(
            float(self.at.state.time), self.period, A, B, E, C, D, F, self._drift(), value[:y], states.names,
            self.inputs.names, names, self._labels[0], states.units, self.inputs.units, units, self._labels[1],
            tuple(dict.fromkeys(self.switches)), loop,
        )  # fmt: skip

    def _ends(self, with_wrench: bool) -> Array:
        """x' by x, u and the wrench: by the derivatives of the sums, or by differences."""
        tangent, moves = self._tangent(with_wrench), self.model.moves
        is_found = tangent is not None and tangent.find()
        self._begin(*((moves.ends[:1].copy(), moves.sides[:1]) if is_found else self.model.ends(np.array([-1]), _ZERO)))
        self._inputs = None
        n = self.n + 6 if with_wrench else self.n
        steps = np.concatenate([self.states.steps, self._input_entries().steps[:n]])
        if tangent is None or not is_found:
            return self._flagged(slopes(partial(self._end, self.model), steps)).columns
        self._look_beyond(tangent.near(steps), steps)
        return tangent.columns.copy()

    def _begin(self, base: Array, here: NDArray[np.int64]) -> None:
        """Where the period ends that nothing moves, and the sides of the switches that it sees."""
        self.base = base
        if not np.all(np.isfinite(base)):
            raise SimulationStopped(
                f"the control period that begins at t = {self.at.state.time:g} s does not come to its end: the state "
                "behind it is no number; choose another sample, or a shorter stepper.step.",
                reason="diverged", time=self.at.state.time,
            )  # fmt: skip
        self._here = here[0].reshape(-1, len(self.at.plant.contacts)).copy()

    def _input_entries(self) -> Entries:
        """Those of u and the wrench, with the inertias where a period has ended."""
        if self._inputs is None:
            if not self.model.inertias().any():
                self.model.ends(np.array([-1]), np.zeros(1))
            self._inputs = input_entries(self.at.plant, self.slides, self.model.inertias(), self.period)
        return self._inputs

    @property
    def inputs(self) -> Entries:
        """The entries of u."""
        return self._input_entries()

    def _tangent(self, with_wrench: bool) -> PeriodTangent | None:
        if with_wrench not in self._tangents:
            try:
                self._tangents[with_wrench] = PeriodTangent(self.model, with_wrench)
            except NoTangentError:
                self._tangents[with_wrench] = None
        return self._tangents[with_wrench]

    def _look_beyond(self, entries: NDArray[np.int64], steps: Array) -> None:
        """Which switches are crossed by the entries that may cross one."""
        if len(entries):
            amounts = np.outer(steps[entries], [1.0, -1.0, 0.5, -0.5]).ravel()
            _, sides = self.model.ends(np.repeat(entries, 4), amounts)
            self._flagged(Slopes(np.zeros((0, 0)), crossed_in(sides, self._here.ravel())))

    def _drift(self) -> Array:
        state = self.at.state
        begin = np.concatenate([state.q, state.v, state.z[tuple(self.model.remembered.T)]])
        return beyond(self.at.plant, self.base, begin)[0]

    def _model(self, plant: Plant, straight: bool) -> PeriodModel:
        at, stepper = self.at, self.at.setup.stepper
        if type(stepper) not in KINDS:
            name = plugin_name("steppers", type(stepper))
            raise ScenarioError(
                f"stepper.name: {name!r} has no steps of one length, compiled; linearize takes midpoint, "
                "semi-implicit-euler and rk4.",
                key="stepper.name", value=name,
            )  # fmt: skip
        steps = round(self.period / stepper.step)
        pushes = [Push(**push.model_dump()) for push in at.setup.scenario.push] if at.held is None else []
        return PeriodModel(plant, (stepper, KINDS[type(stepper)]), steps, at.state, at.torque, pushes, straight)

    def _observer(self, varied: Varied) -> Observer:
        at = self.at
        controller = varied.controller if self.closed else None
        return Observer(varied.probe, self.keep, controller, at.memory, at.state, at.torque, self.model.remembered)

    @property
    def _answers(self) -> int:
        """Numbers that the controller answers with."""
        return self.n + len(self.observer.held) if self.closed else 0

    def _end(
        self, model: PeriodModel, index: NDArray[np.int64], amount: Array, shares: Array | None = None
    ) -> tuple[Array, NDArray[np.int64]]:
        ends, sides = model.ends(index, amount, shares)
        return beyond(model.plant, ends, self.base[0]), sides

    def _seen(self) -> tuple[Array, Array]:
        """y, command and memory, and the same by x."""
        found = None if self._looks is None else self._looks.derivatives(len(self.states.names))
        if found is not None:
            return found
        value, _ = self._look(np.array([-1]), np.zeros(1), np.zeros(1))
        return value[0], self._flagged(slopes(self._look, self.states.steps)).columns

    def _flagged(self, found: Slopes) -> Slopes:
        """Names the switches that were met."""
        contacts = self.at.plant.contact_names
        crossed = np.bitwise_or.reduce(found.crossed.reshape(-1, len(contacts)), axis=0)
        for bits, here, name in zip(crossed.tolist(), self._here.T, contacts, strict=True):
            touches, slips = bool(here[0] & TOUCHES), bool(np.any(here & (SLIPS | MOVED)))
            if bits & TOUCHES:
                self.switches.append(Switch(name, "touch", "touching" if touches else "apart"))
            if bits & (SLIPS | MOVED):
                self.switches.append(Switch(name, "slip", "slips" if slips else "sticks"))
            if bits >= 2 * MOVED:
                self.switches.append(Switch(name, "surface", surface_name(int(here[0]) // (2 * MOVED))))
        return found

    def _rows(self) -> list[tuple[str, str, str]]:
        world = self.at.plant.world
        names = frozenset(name for name, slides in zip(world.joint_names, slides_of(world), strict=True) if slides)
        return output_names(self.at.probe, self.keep.variables, names | slides_in(world.hand_text))

    @cached_property
    def _through(self) -> Array:
        """D: the torques themselves are the only outputs that they change at once."""
        D = np.zeros((len(self.rows), self.n))
        places = [k for k, (name, _, _) in enumerate(self.rows) if name == "joint_torque"]
        D[places] = np.eye(self.n)[: len(places)]
        return D

    @cached_property
    def _labels(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Names and units of y."""
        return tuple(label for _, label, _ in self.rows), tuple(unit for _, _, unit in self.rows)

    def _by(self, one: Parameter | str, by_wrench: Array, y: int) -> _Blocks:
        """Derivatives by a parameter."""
        if not isinstance(one, Parameter):
            return _Blocks(by_wrench, np.zeros((y, 6)), np.zeros((self._answers, 6)))
        failed: list[Exception] = []
        values, sides = self._with(Varied.of(self.at, one, 0.0))

        def moved(amount: float) -> tuple[Array, NDArray[np.int64]]:
            try:
                return self._with(Varied.of(self.at, one, amount))
            except ScenarioError as error:  # a value that the scenario does not take
                failed.append(error)
                return np.full_like(values, np.nan), sides

        def function(index: NDArray[np.int64], amount: Array, _: Array) -> tuple[Array, NDArray[np.int64]]:
            found = [(values, sides) if j < 0 else moved(float(h)) for j, h in zip(index, amount, strict=True)]
            return np.array([row for row, _ in found]), np.array([side for _, side in found])

        found = slopes(function, np.array([one.step]))
        if failed and not np.all(np.isfinite(found.columns)):
            raise failed[0]
        s = len(self.states.names)
        self._flagged(Slopes(found.columns, found.crossed[: self._here.size]))
        return _Blocks(found.columns[:s], found.columns[s : s + y], found.columns[s + y :])

    def _with(self, varied: Varied) -> tuple[Array, NDArray[np.int64]]:
        """End, outputs and answer with a parameter moved, and the sides of the switches."""
        zero = np.array([-1]), np.zeros(1)
        values, sides = self._end(self._model(varied.plant, straight=False), *zero)
        if not (self.keep.variables or self.closed):
            return values[0], sides[0]
        seen, more = self._observer(varied).at(*zero)
        return np.concatenate([values[0], seen[0]]), np.concatenate([sides[0], more[0]])

    def _loop(self, A: Array, B: Array, E: Array, C: Array, D: Array, F: Array, said: Array, by_p: Array) -> ClosedLoop:
        """The controller put in: `said` is its command and memory by x, `by_p` by the parameters."""
        n, s, held = self.n, A.shape[0], self.observer.held
        y = len(C)

        def column(k: int) -> Array:
            def function(index: NDArray[np.int64], amount: Array, _: Array) -> tuple[Array, NDArray[np.int64]]:
                return self.observer.at(np.where(index < 0, -1, s + k), amount)

            step = _MEMORY_STEP * max(1.0, abs(held[k]))
            return slopes(function, np.array([step])).columns[y:, 0]

        places, by_memory = follow(said, n, column)
        said, by_memory, by_p = said.copy(), by_memory.copy(), by_p.copy()
        B, D = B.copy(), D.copy()
        command = self.observer.at(np.array([-1]), np.zeros(1))[0][0, y : y + n]
        for j in np.flatnonzero(np.abs(command) > self.observer.effort_limit):  # nothing that is commanded arrives
            said[j], by_memory[j], by_p[j], B[:, j], D[:, j] = 0.0, 0.0, 0.0, 0.0, 0.0
            self.switches.append(Switch(self.inputs.names[j], "effort limit", "limited"))
        K = np.hstack([said[:n], by_memory[:n]])
        rows, m = n + places, len(places)
        return ClosedLoop(
            A=np.block([[A + B @ said[:n], B @ by_memory[:n]], [said[rows], by_memory[rows]]]),
            B=np.vstack([B, np.zeros((m, n))]),
            E=np.vstack([E + B @ by_p[:n], by_p[rows]]),
            C=np.hstack([C + D @ said[:n], D @ by_memory[:n]]),
            D=D,
            F=F + D @ by_p[:n],
            K=K,
            states=(*self.states.names, *(f"memory {k + 1}" for k in places)),
        )


def _told(chosen: list[Parameter | str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of p."""
    names: list[str] = []
    units: list[str] = []
    for one in chosen:
        names += [one.name] if isinstance(one, Parameter) else WRENCH_NAMES
        units += [one.unit] if isinstance(one, Parameter) else WRENCH_UNITS
    return tuple(names), tuple(units)


def _kept(outputs: Iterable[str], at: Situation) -> Keep:
    names = (outputs,) if isinstance(outputs, str) else tuple(outputs)
    unlike = [name for name in names if name.startswith(MEASURED_PREFIX) or name in COMMANDED.values()]
    if unlike:
        raise ScenarioError(
            f"outputs: {unlike[0]} is of the instruments and drives, which are no part of the model; ask for "
            f"{unlike[0].removeprefix(MEASURED_PREFIX).removesuffix('_commanded')}.",
            key="outputs", value=unlike[0],
        )  # fmt: skip
    for name in set(FOUND_AFTERWARDS).intersection(names):
        raise ScenarioError(
            f"outputs: {name} is found in a recording by softhand.incipient_slip, and no part of the model; ask for "
            "limit_surface_use.",
            key="outputs", value=name,
        )  # fmt: skip
    if "external_force" in names:
        raise ScenarioError(
            "outputs: external_force is what is put in; its effect is the parameter 'wrench'.",
            key="outputs", value="external_force",
        )  # fmt: skip
    try:
        keep = Keep.of(names, 1.0, 1.0)
    except ScenarioError as error:
        raise ScenarioError(
            str(error).replace("variables:", "outputs:", 1), key="outputs", value=error.__dict__.get("value")
        ) from error
    missing = [name for name in names if name.startswith("support_") and not at.plant.supports]
    if missing:
        raise ScenarioError(
            f"outputs: {missing[0]}: this scenario has no supports; leave it out.", key="outputs", value=missing[0]
        )
    return keep
