"""How what a run costs changes with the parameters of its scenario and with its torques."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import Any, Literal

import numpy as np

from softhand.assembly.parts import read_controller, read_stepper, written
from softhand.assembly.resolve import Setup
from softhand.assembly.unmodelled import must_model, must_not_feel, must_slip_as_a_whole
from softhand.assembly.variations import Variations
from softhand.batch.asked import Asked
from softhand.batch.run import CompiledRun
from softhand.controllers.controller import Controller
from softhand.derivatives.asked_in_python import Given, InPython
from softhand.derivatives.costs import Cost, Term, costs_of
from softhand.derivatives.directions import Beside, Direction, moving_places
from softhand.derivatives.gradient_record import Gradient
from softhand.derivatives.outputs import Outputs
from softhand.derivatives.parameters import WRENCH, WRENCH_NAMES, WRENCH_UNITS, Parameter, find_parameters
from softhand.derivatives.shadowed import LANES, Shadowed
from softhand.derivatives.switches import crossings
from softhand.derivatives.taped_run import LawNotFollowedError, TapedRun
from softhand.errors import ScenarioError
from softhand.laws.law import Law
from softhand.numerics.arrays import Array, as_numbers
from softhand.numerics.followed import offsets_of
from softhand.plugins import plugin_name
from softhand.scenario.scenario import Scenario, as_scenario
from softhand.settings.wording import show
from softhand.simulation.keep import Keep
from softhand.steppers.midpoint import Midpoint


def gradient(
    scenario: Scenario | str | Path,
    cost: Cost | Iterable[Cost],
    parameters: Iterable[str] = (),
    *,
    torque: Sequence[Sequence[float]] | Array | None = None,
    every: float | None = None,
    mode: Literal["adjoint", "tangent"] = "adjoint",
    controller: Controller | None = None,
    law: Law | None = None,
    overrides: Mapping[str, Any] | None = None,
    **values: Any,
) -> Gradient:
    """d cost / d parameters of a whole run, by the adjoint of its steps as they are computed.

        at_rest = softhand.QuadraticCost("object_position", "object_position_desired", 1e6, terminal=True)
        found = softhand.gradient("target-a", at_rest, ["mass", "k_r", "K_O_position", "contact_points"])
        found["mass"]

    With x the numbers that a run begins with and y what is recorded of it,

        d cost / d p = (dx / dp)^T (dy / dx)^T d cost / dy,

    (dy / dx)^T by the adjoint of all steps, observations and control laws of the run in about the time of the run, for
    any number of parameters; dx / dp from the scenario beside, the grasp at rest with it. At a switch, where a tip
    touches, slips or an effort limit cuts, the way that the run takes is followed: the derivative is one-sided, and
    what a change of the time of the switch does is not in it.

    Args:
        scenario: from `load_scenario`, the name of one that ships, or the path of a TOML file. Stepper midpoint.
        cost: a `QuadraticCost`, a `PeakCost`, a `FunctionCost`, a function of variables of a recording at one sample,
            or a list.
        parameters: dotted keys of the scenario with numbers, or their last part; a key with a list is one parameter
            each. "wrench" is a constant force and moment on the object at the origin of its frame, world axes.
        torque: of each control period in place of the controller [N m, N], shape (periods, n); its derivatives are
            found too.
        every: time between two samples that the cost sees [s]; the control period if not given.
        mode: "tangent" does the same forwards, eight parameters at a time.
        controller: in place of the scenario's.
        law: at all tips in place of the scenario's.
        overrides: dotted keys and values put over those of the scenario.
        values: the same by the last part of the key.

    Raises:
        ScenarioError: a parameter, the cost or the torques cannot be used; names it.
        SimulationStopped: the run does not come to its end.
        SofthandError: as `build`.
    """
    if mode not in ("adjoint", "tangent"):
        raise ScenarioError(f"mode: got {mode!r}; it is 'adjoint' or 'tangent'.", key="mode", value=mode)
    costs = costs_of(cost)
    base = as_scenario(scenario, overrides, **values)
    names = [parameters] if isinstance(parameters, str) else list(parameters)
    if WRENCH in names:
        nothing = {"force": [0.0] * 3, "moment": [0.0] * 3, "duration": base.duration + 1.0}
        base = base.with_values({"push": [*(push.model_dump() for push in base.push), nothing]})
    used = dict.fromkeys(name for one in costs for name in one.variables)
    keep = Keep.of(used, base.control_period if every is None else every, base.control_period)
    must_not_feel("A gradient", "cost", used)
    for name in ("sensing", "actuation"):
        if getattr(base, name) is not None:
            raise ScenarioError(
                f"{name}: a gradient is that of a run with ideal instruments and drives; leave the section [{name}] "
                "out of the scenario.",
                key=name, value=getattr(base, name),
            )  # fmt: skip
    try:
        work = _Work(base, keep, controller, law, torque)
        return work.gradient(costs, work.chosen(names), mode)
    except LawNotFollowedError:
        work = _Work(base, keep, controller, law, torque, in_python=True)
        return work.gradient(costs, work.chosen(names), mode)


class _Work:
    """One gradient at work."""

    def __init__(
        self,
        base: Scenario,
        keep: Keep,
        controller: Controller | None,
        law: Law | None,
        torque: Any,
        in_python: bool = False,
    ) -> None:
        self.keep = keep
        self.controller = controller or read_controller(base)
        stepper = read_stepper(base)
        if type(stepper) is not Midpoint:
            name = plugin_name("steppers", type(stepper))
            raise ScenarioError(
                f"stepper.name: got {name!r}; the gradient of a run is there for midpoint alone, choose that.",
                key="stepper.name", value=name,
            )  # fmt: skip
        periods = round(base.duration / base.control_period)
        formula = self.controller.formula
        is_python = in_python or formula is None or type(self.controller).torque is not Controller.torque
        self.in_python = torque is None and is_python
        given = Given(period=self.controller.period) if self.in_python else Given() if torque is not None else None
        self.own = controller if given is None else None
        self.variations = Variations(base, given or controller, law)
        self.setup = self.variations.setup
        mechanics, drives = self.setup.world.mechanics, self.setup.actuation
        must_model("A gradient", mechanics, drives, ("damping", "friction", "stop_stiffness"))
        must_slip_as_a_whole("A gradient", self.setup.fingertips)
        if drives is not None:
            raise ScenarioError(
                "hand.joints.velocity_limit: a gradient is that of a run with ideal drives; leave the limit out.",
                key="hand.joints.velocity_limit", value=mechanics.velocity_limit.tolist(),
            )  # fmt: skip
        self.commands = None if torque is None else _commands(torque, periods, self.setup.world.n_joints)
        self.scenario = self.setup.scenario.with_values({"controller": written("controllers", self.controller)})

    def chosen(self, names: list[str]) -> list[Parameter | str]:
        """The parameters that are asked for."""
        found = find_parameters(self.scenario, self.setup.world, names)
        for one in found:
            if isinstance(one, Parameter) and isinstance(one.written, int):
                raise ScenarioError(
                    f"parameters: {one.name} is {show(one.written)}, a whole number, which no derivative goes "
                    "along; leave it out.",
                    key="parameters", value=one.name,
                )  # fmt: skip
            if isinstance(one, Parameter) and self.commands is not None and one.key.startswith("controller."):
                raise ScenarioError(
                    f"parameters: {one.name} does nothing where torques are given; leave it out.",
                    key="parameters", value=one.name,
                )  # fmt: skip
        return found

    def gradient(self, costs: list[Term], chosen: list[Parameter | str], mode: str) -> Gradient:
        """All of it."""
        numbers = [one for one in chosen if isinstance(one, Parameter)]
        in_python = [one for one in numbers if self.in_python and one.key.startswith("controller.")]
        beside = Beside(self.variations, self.scenario, self.keep, self.own)
        directions = {one.name: beside.direction(one) for one in numbers if one not in in_python}
        taped = self._taped(list(directions.values()), WRENCH in chosen)
        try:
            return self._of(taped, costs, chosen, directions, in_python, mode)
        finally:
            _SEATS.leave(taped)

    def _of(
        self,
        taped: TapedRun,
        costs: list[Term],
        chosen: list[Parameter | str],
        directions: Mapping[str, Direction],
        in_python: list[Parameter],
        mode: str,
    ) -> Gradient:
        asked = InPython(taped, self.controller, in_python, self.scenario) if self.in_python else None
        taped.record(asked.ask if asked else None)
        outputs = Outputs(self.keep, taped)
        time, found = outputs.time, outputs.values()
        seeds: dict[str, Array] = {}
        told: dict[str, float] = {}
        for term in costs:
            value, slopes = term.at(time, found)
            told[_unused(term.name, told)] = value
            for name, slope in slopes.items():
                seeds[name] = seeds.get(name, 0.0) + slope
        rows = outputs.seed(seeds)
        if not np.all(np.isfinite(rows)):
            raise ScenarioError("cost: its derivative is no number.", key="cost", value=costs)
        torque = None
        if mode == "adjoint":
            shadowed = Shadowed(taped, 1, "adjoint")
            shadowed.clear()
            shadowed.shadows.rows[...] = rows
            shadowed.pull(asked.pull(shadowed) if asked else None)
            slopes_of = {name: _along(shadowed, taped, one) for name, one in directions.items()}
            if self.commands is not None:
                torque = shadowed.shadows.commands[:-1].copy()
            wrench = _pushed(shadowed, taped) if WRENCH in chosen else np.zeros(0)
        else:
            slopes_of, wrench = _forwards(taped, directions, rows, WRENCH in chosen, asked)
        if asked:
            slopes_of.update(asked.slopes(mode))
        names: list[str] = []
        units: list[str] = []
        values: list[float] = []
        slopes_: list[float] = []
        for one in chosen:
            if isinstance(one, Parameter):
                names.append(one.name)
                units.append(one.unit)
                values.append(one.value)
                slopes_.append(slopes_of[one.name])
            else:
                names += WRENCH_NAMES
                units += WRENCH_UNITS
                values += [0.0] * 6
                slopes_ += wrench.tolist()
        plan, world = taped.plan, taped.plant.world
        return Gradient(
            float(sum(told.values())), told, tuple(names), np.array(values), tuple(units), np.array(slopes_), torque,
            tuple(world.joint_names),
            crossings(taped.play.sides, plan.step, taped.plant.contact_names, taped.play.limits,
                      self.scenario.control_period, world.joint_names),
            self.scenario.duration, mode,
        )  # fmt: skip

    def _taped(self, directions: list[Direction], with_wrench: bool) -> TapedRun:
        """A run on tape at its start: one that there was, or a new one."""
        setup = self.variations.to(self.scenario)
        if self.own is not None:
            setup = replace(setup, controller=self.own)
        taped = _SEATS.take(setup, self.keep, self.commands, self.in_python)
        if taped is not None and _moving(taped, directions, with_wrench) <= taped.moving:
            return taped
        taped = TapedRun(CompiledRun(setup, self.keep, Asked()), self.commands, in_python=self.in_python)
        taped.moving = _moving(taped, directions, with_wrench)
        return taped


class _Seats:
    """The last runs, whose codes another run of the same structure can use."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._taped: list[TapedRun] = []

    def take(self, setup: Setup, keep: Keep, commands: Array | None, in_python: bool) -> TapedRun | None:
        """One that has become the run that is asked for, if there is any; nobody else has it meanwhile."""
        with self._lock:
            alike = [one for one in self._taped if one.is_like(keep, commands, in_python)]
            for one in alike:
                self._taped.remove(one)
        found = None
        for one in alike:
            if found is None and one.become(setup, keep, commands):
                found = one
            elif found is not None:
                self.leave(one)
        return found

    def leave(self, taped: TapedRun) -> None:
        """Give one back."""
        with self._lock:
            self._taped = [taped, *self._taped][:_SEATS_KEPT]


_SEATS_KEPT = 4
_SEATS = _Seats()


def _moving(taped: TapedRun, directions: list[Direction], with_wrench: bool) -> frozenset[tuple[int, int]]:
    """Places that derivatives are taken by."""
    moving = moving_places(directions, taped.inputs(), taped.layouts.number_of)
    if with_wrench:
        memory, begin = taped.layouts.number_of(_last_push(taped))
        moving |= {(memory, begin + 8 * k) for k in range(6)}
    return moving


def _commands(torque: Any, periods: int, n: int) -> Array:
    rows = as_numbers(torque)
    if rows is None or rows.shape != (periods, n) or not np.all(np.isfinite(rows)):
        what = "what is no table of numbers" if rows is None else f"an array of shape {rows.shape}"
        if rows is not None and rows.shape == (periods, n):
            place = tuple(int(k) for k in np.argwhere(~np.isfinite(rows))[0])
            what = f"{rows[place]} at {place}"
        raise ScenarioError(
            f"torque: got {what}; give finite numbers of shape ({periods}, {n}), a row each control period.",
            key="torque", value=torque,
        )  # fmt: skip
    return rows


def _unused(name: str, told: Mapping[str, float]) -> str:
    k, found = 2, name
    while found in told:
        found, k = f"{name} {k}", k + 1
    return found


def _along(shadowed: Shadowed, taped: TapedRun, one: Direction) -> float:
    """Adjoint times direction."""
    total = float(np.sum(shadowed.shadows.desired * one.desired[:, 1:]))
    for array, along in zip(taped.inputs(), one.inputs, strict=True):
        if along.any():
            memory, begin = taped.layouts.number_of(array)
            words = (begin + offsets_of(array)) // 8
            total += float(shadowed.arrays[memory][words, 0] @ along)
    return total


def _last_push(taped: TapedRun) -> Array:
    """Force and moment of the push that is the wrench, shape (6,)."""
    row = taped.plan.pushes.rows[-1:]
    first = row.dtype.fields["force"][1]  # type: ignore[index]
    return row.view(np.float64)[first // 8 : first // 8 + 6]


def _pushed(shadowed: Shadowed, taped: TapedRun) -> Array:
    return shadowed.at(_last_push(taped)).copy()


def _forwards(
    taped: TapedRun, directions: Mapping[str, Direction], rows: Array, with_wrench: bool, asked: Any
) -> tuple[dict[str, float], Array]:
    """By the tangent."""
    columns: list[tuple[str, Direction | int]] = [*directions.items()]
    columns += [("", k) for k in range(6 if with_wrench else 0)]
    own = [] if asked is None else [(one.name, one) for one in asked.parameters]
    columns += own
    slopes: dict[str, float] = {}
    wrench: list[float] = []
    shadowed = Shadowed(taped, LANES, "tangent")
    shadows = shadowed.shadows
    for first in range(0, len(columns), LANES):
        shadowed.clear()
        part = columns[first : first + LANES]
        for lane, (_, one) in enumerate(part):
            if isinstance(one, Direction):
                shadows.desired.reshape(*shadows.desired.shape[:1], -1, LANES)[:, :, lane] = one.desired[:, 1:]
                for array, along in zip(taped.inputs(), one.inputs, strict=True):
                    if along.any():
                        memory, begin = taped.layouts.number_of(array)
                        shadowed.arrays[memory][(begin + offsets_of(array)) // 8, lane] = along
            elif isinstance(one, int):
                shadowed.at(_last_push(taped)).reshape(-1, LANES)[one, lane] = 1.0
        shadowed.push(asked.push(shadowed, [one for _, one in part]) if asked else None)
        found = np.einsum("kil,ki->l", shadows.rows.reshape(*rows.shape, LANES), rows)
        for lane, (name, _) in enumerate(part):
            if name:
                slopes[name] = float(found[lane])
            else:
                wrench.append(float(found[lane]))
    return slopes, np.array(wrench)
