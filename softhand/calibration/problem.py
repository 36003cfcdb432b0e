"""Residuals of a log by piece, and their derivatives by the start of each piece and by the parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.parts import read_fingertips
from softhand.assembly.plant import read_supports, read_world
from softhand.assembly.resolve import Setup
from softhand.calibration.handing_on import Kick
from softhand.calibration.instruments import Instrument, instruments_of, measured_values, off, true_values
from softhand.calibration.log import Log
from softhand.calibration.parameters import BIAS, DELAY, PLANT, Parameter, keyed
from softhand.calibration.replay import Replay
from softhand.derivatives.model import beyond
from softhand.derivatives.states import state_entries
from softhand.errors import ScenarioError
from softhand.model.configuration import integrate
from softhand.model.world import slides_of
from softhand.numerics.arrays import Array
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.simulation.pushes import Push
from softhand.steppers.midpoint import Midpoint

T = TypeVar("T")

_CLOSER = 0.01  # times the steps of `state_entries`: their ends are compared with the slack, a hundredth of these
_STICKS = 1e3  # friction with which no tip slips
_UNMOVED, _NOT = np.array([-1]), np.zeros(1)


class Piece(NamedTuple):
    """Some samples of a log that follow one another."""

    first: int
    size: int


class Linear(NamedTuple):
    """A piece as it is, and how it changes with the state s where it begins and with the parameters x.

    Attributes:
        r: measured - predicted, shape (m,).
        by_start: derivative of what is predicted by s, shape (m, states).
        by_parameters: by x, shape (m, p).
        end: the state where the next piece begins.
        kick: that it begins with.
        use: coefficient of friction that its tips need.
        end_by_start: derivative of its tangent coordinates by s, shape (states, states).
        end_by_parameters: by x, shape (states, p).
    """

    r: Array
    by_start: Array
    by_parameters: Array
    end: State
    kick: Kick
    use: float
    end_by_start: Array
    end_by_parameters: Array


class Run(NamedTuple):
    """A piece as it is: residuals, and the state where the next one begins."""

    r: Array
    end: State
    kick: Kick
    use: float


class Problem:
    """The pieces of a log, and what a scenario predicts of them.

    Attributes:
        parameters: that are fitted.
        pieces: of the log.
        names: of the quantities that are compared.
        channel: which quantity, and which component of it, each row of the residuals of a piece is; shape (m,), for
            each piece.
        channels: of each channel its quantity and component.
        period: of the log [s].
        sticks: whether no tip slips, whatever its friction; seen by `at`.
        kicks: with which the pieces go on; None where one starts afresh.

    Args:
        log: checked against the hand.
        setup: of the scenario.
        parameters: as the attribute.
        length: of a piece [s].
        threads: at work at the same time.

    Raises:
        ScenarioError: the stepper is another than midpoint, or its step does not fit into the period of the log.
    """

    def __init__(self, log: Log, setup: Setup, parameters: Sequence[Parameter], length: float, threads: int) -> None:
        self.log, self.setup, self.parameters, self.period = log, setup, list(parameters), log.period
        self.names = [name for name in log.measured if np.isfinite(log.measured[name]).any()]
        self._stepper, self._steps = _stepper_of(setup, self.period)
        self.step = self._stepper.step
        self._late = self._latest()
        count = max(round(length / self.period), 10) + self._late
        self.pieces = [Piece(first, count) for first in range(0, len(log) - count, count - self._late)]
        self.channels = [
            (name, k) for name in self.names for k in range(3 if name == "object_orientation" else
                                                            log.measured[name].shape[1])
        ]  # fmt: skip
        self._rows = [self._rows_of(piece) for piece in self.pieces]
        self.channel = [np.concatenate([rows[1] for rows in every]) for every in self._rows]
        self.sticks = False
        self.kicks: list[Kick | None] = [None] * len(self.pieces)
        self._threads = max(1, min(threads, len(self.pieces)))
        self._benches: list[_Bench] = [self._bench() for _ in range(self._threads)]
        plant = self._benches[0].plant
        self.n_states, self.remembered = self._benches[0].base.model.n_states, self._benches[0].base.model.remembered
        self._state_steps = _CLOSER * state_entries(plant, slides_of(plant.world), self.remembered, self.period).steps
        self.world, self.can_slip = plant.world, plant.can_slip

    @property
    def friction(self) -> float:
        """The largest of the tips."""
        return self._benches[0].friction

    def values(self, x: Array) -> Array:
        """Values of the parameters at some x."""
        return np.array([one.to_value(value) for one, value in zip(self.parameters, x, strict=True)])

    def at(self, x: Array) -> None:
        """Be the problem with these parameters."""
        self._each(lambda bench, _: bench.become(x), range(self._threads))

    def runs(self, states: Sequence[State], which: Sequence[int]) -> list[Run]:
        """Some pieces that begin at these states; NaN where one does not come to its end."""
        return self._each(lambda bench, k: bench.run(k, states[k]), which)

    def hand_on(self, runs: Sequence[Run | Linear], which: Sequence[int]) -> None:
        """Let each piece go on with the kick of the one before."""
        for one, k, after in zip(runs[:-1], which[:-1], which[1:], strict=True):
            if after == k + 1:
                self.kicks[after] = one.kick if one.kick.is_finite else None

    def go(self, state: State, first: int, count: int) -> State:
        """On from a state at a sample of the log, so many periods."""
        return self._benches[0].go(state, first, count)

    def linear(self, states: Sequence[State], which: Sequence[int]) -> list[Linear]:
        """Likewise with their derivatives."""
        return self._each(lambda bench, k: bench.linear(k, states[k]), which)

    def defect(self, state: State, end: State) -> Array:
        """By how much a state is beyond the end of the piece before it, in tangent coordinates, shape (states,)."""
        rows, columns = self.remembered.T
        flat = np.array([[*one.q, *one.v, *one.z[rows, columns]] for one in (state, end)])
        return np.asarray(beyond(self._benches[0].plant, flat[:1], flat[1])[0])

    def moved(self, state: State, dx: Array) -> State:
        """A state moved in its tangent coordinates."""
        nv, after = self.world.nv, state.copy()
        integrate(self.world.joints, state.q, dx[:nv], 1.0, after.q)
        after.v[:] += dx[nv : 2 * nv]
        rows, columns = self.remembered.T
        after.z[rows, columns] += dx[2 * nv :]
        return after

    def times(self, k: int) -> Array:
        """Of each row of the residuals of a piece [s]."""
        found, first = [], self.pieces[k].first
        for name, (places, _) in zip(self.names, self._rows[k], strict=True):
            width = 3 if name == "object_orientation" else self.log.measured[name].shape[1]
            found.append(self.log.time[first + places // width])
        return np.concatenate(found)

    def time(self, k: int) -> float:
        """At which a piece begins [s]."""
        return float(self.log.time[0] + self.pieces[k].first * self.period)

    def _each(self, work: Callable[[_Bench, int], T], which: Sequence[int]) -> list[T]:
        if self._threads == 1:
            return [work(self._benches[0], k) for k in which]
        parts = np.array_split(np.asarray(list(which)), self._threads)
        with ThreadPoolExecutor(self._threads) as pool:
            found = list(
                pool.map(lambda pair: [work(pair[0], int(k)) for k in pair[1]], zip(self._benches, parts, strict=True))
            )
        return [one for part in found for one in part]

    def _latest(self) -> int:
        """Periods by which a measured sample may be late."""
        latest = 0.0
        section = self.setup.scenario.sensing
        for name in self.names:
            one = getattr(section, name, None) if section is not None else None
            latest = max(latest, one.delay if one is not None else 0.0)
        latest = max([latest, *(one.upper for one in self.parameters if one.kind == DELAY)])
        return math.ceil(latest / self.period - 1e-9) + (1 if latest > 0.0 else 0)

    def _rows_of(self, piece: Piece) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """Of each quantity the places of its measured numbers in a piece, flat, and their channels."""
        rows, first = [], 0
        for name in self.names:
            values = self.log.measured[name][piece.first : piece.first + piece.size]
            there: NDArray[np.bool_] = np.asarray(np.isfinite(values))
            if name == "object_orientation":
                there = np.repeat(np.all(there, axis=1, keepdims=True), 3, axis=1)
            there = there.copy()
            there[: self._late] = False
            width = there.shape[1]
            places = np.flatnonzero(there)
            rows.append((places, first + places % width))
            first += width
        return rows

    def _bench(self) -> _Bench:
        return _Bench(self)


class _Bench:
    """What one thread works with: the plant, and plants beside it in which a parameter is moved."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.become(np.array([one.to_x(one.value) for one in problem.parameters]))

    def become(self, x: Array) -> None:
        self.x = x
        self.plant = self._plant(x)
        self.base = self._replay(self.plant)
        self._beside: dict[int, tuple[Replay, float]] = {}
        self._instruments = self._at(x)

    def _plant(self, x: Array) -> Plant:
        p = self.problem
        of_plant = [k for k, one in enumerate(p.parameters) if one.kind == PLANT]
        values = keyed([p.parameters[k] for k in of_plant], p.values(x)[of_plant])
        scenario = p.setup.scenario.with_values(values) if values else p.setup.scenario
        world = read_world(scenario)
        fingertips = read_fingertips(scenario, world, p.setup.law)
        plant = Plant(world, fingertips, read_supports(scenario, world, fingertips), "compiled")
        self.friction = float(plant.pads["friction"][: world.n_tips].max())
        if p.sticks:
            plant.pads["friction"] = plant.pads["static_friction"] = _STICKS
            plant.pads["face_friction"] = 0.0
        return plant

    def _replay(self, plant: Plant) -> Replay:
        p = self.problem
        pushes = [Push(**push.model_dump()) for push in p.setup.scenario.push]
        return Replay(plant, p._stepper, p._steps, pushes, p.pieces[0].size)

    def _at(self, x: Array) -> dict[str, Instrument]:
        p = self.problem
        return instruments_of(p.setup.scenario, self.plant.world, p.names, p.parameters, p.values(x))

    def _torques(self, k: int) -> Array:
        piece = self.problem.pieces[k]
        return self.problem.log.joint_torque[piece.first : piece.first + piece.size]

    def _true(self, seen: Array) -> dict[str, Array]:
        count = self.problem.pieces[0].size
        return {name: true_values(name, seen[..., :count, :], self.plant.world) for name in self.problem.names}

    def _seen(self, true: dict[str, Array], instruments: dict[str, Instrument]) -> dict[str, Array]:
        p = self.problem
        return {name: measured_values(name, true[name], instruments[name], p.period) for name in p.names}

    def _off(self, k: int, values: dict[str, Array], others: dict[str, Array]) -> Array:
        """Rows of a piece by which values are off from others; shape (..., m)."""
        p, found = self.problem, []
        for name, (places, _) in zip(p.names, p._rows[k], strict=True):
            difference = off(name, values[name], others[name], self.plant.world)
            found.append(difference.reshape(*difference.shape[:-2], -1)[..., places])
        return np.concatenate(found, axis=-1)

    def _measured(self, k: int) -> dict[str, Array]:
        p, piece = self.problem, self.problem.pieces[k]
        return {name: p.log.measured[name][piece.first : piece.first + piece.size] for name in p.names}

    def run(self, k: int, state: State) -> Run:
        seen = self._samples(self.base, k, state)[0]
        r = self._off(k, self._measured(k), self._seen(self._true(seen), self._instruments))
        return Run(r, *self._end(k, seen))

    def _samples(
        self, replay: Replay, k: int, state: State, entries: NDArray[np.int64] = _UNMOVED, amounts: Array = _NOT
    ) -> Array:
        p = self.problem
        return replay.samples(state, self._torques(k), entries, amounts, p.kicks[k], p.pieces[k].size - p._late)

    def hand_on(self, runs: Sequence[Run | Linear], which: Sequence[int]) -> None:
        """Let each piece go on with the kick of the one before."""
        for one, k, after in zip(runs[:-1], which[:-1], which[1:], strict=True):
            if after == k + 1:
                self.kicks[after] = one.kick if one.kick.is_finite else None

    def go(self, state: State, first: int, count: int) -> State:
        log = self.problem.log
        torques = log.joint_torque[first : first + count]
        seen = self.base.samples(state, torques, np.array([-1]), np.zeros(1))[0]
        return self.base.state(seen[count], float(log.time[0] + (first + count) * log.period))

    def _end(self, k: int, seen: Array) -> tuple[State, Kick, float]:
        p = self.problem
        count = p.pieces[k].size - p._late
        end = self.base.state(seen[count], float(p.log.time[0] + (p.pieces[k].first + count) * p.period))
        use = self.base.use
        return end, self.base.left(end), use

    def _ends(self, k: int, seen: Array) -> Array:
        """q, v, z where the next piece begins, of many starts of this one."""
        world, count = self.plant.world, self.problem.pieces[k].size - self.problem._late
        size, nz = world.nq + world.nv, len(self.problem.remembered)
        rows = seen[:, count]
        return np.hstack([rows[:, :size], rows[:, rows.shape[1] - nz :]])

    def linear(self, k: int, state: State) -> Linear:
        p, steps = self.problem, self.problem._state_steps
        samples = self._samples(self.base, k, state, np.arange(-1, p.n_states), np.concatenate([[0.0], steps]))
        (end, kick, use), ends = self._end(k, samples[0]), self._ends(k, samples)
        every = self._true(samples)
        true = {name: values[0].copy() for name, values in every.items()}
        seen = self._seen(every, self._instruments)
        here = {name: values[0].copy() for name, values in seen.items()}
        r = self._off(k, self._measured(k), here)
        by_start = (self._off(k, {name: values[1:] for name, values in seen.items()}, here) / steps[:, None]).T
        end_by_start = (beyond(self.plant, ends[1:], ends[0]) / steps[:, None]).T
        by_parameters, end_by = np.zeros((len(r), len(p.parameters))), np.zeros((p.n_states, len(p.parameters)))
        beside, steps_of, moved = [], [], []
        for j, one in enumerate(p.parameters):
            if one.kind == PLANT:
                replay, step = self._moved(j)
                beside.append(self._samples(replay, k, state)[0].copy())
                steps_of.append(step)
                moved.append(j)
            elif one.kind == BIAS:
                by_parameters[:, j] = one.worth * (p.channel[k] == p.channels.index((one.quantity, one.component)))
            else:
                x, step = self.x.copy(), one.step if self.x[j] + one.step <= one.to_x(one.upper) else -one.step
                x[j] += step
                by_parameters[:, j] = self._off(k, self._seen(true, self._at(x)), here) / step
        if moved:
            samples, by = np.stack(beside), np.array(steps_of)[:, None]
            by_parameters[:, moved] = (self._off(k, self._seen(self._true(samples), self._instruments), here) / by).T
            end_by[:, moved] = (beyond(self.plant, self._ends(k, samples), ends[0]) / by).T
        return Linear(r, by_start, by_parameters, end, kick, use, end_by_start, end_by)

    def _moved(self, j: int) -> tuple[Replay, float]:
        """The plant with a parameter moved, and by how much: back where it cannot go on."""
        if j not in self._beside:
            one, x = self.problem.parameters[j], self.x.copy()
            ahead = one.step if x[j] + one.step <= one.to_x(one.upper) else -one.step
            for step in (ahead, -ahead):
                x[j] = self.x[j] + step
                try:
                    self._beside[j] = self._replay(self._plant(x)), step
                    break
                except ScenarioError:
                    if step != ahead:
                        raise
        return self._beside[j]


def _stepper_of(setup: Setup, period: float) -> tuple[Midpoint, int]:
    stepper = setup.stepper
    if not isinstance(stepper, Midpoint):
        raise ScenarioError(
            f"stepper.name: {setup.scenario.stepper.name!r}; a calibration computes the run anew with midpoint alone; "
            'take stepper.name = "midpoint".',
            key="stepper.name", value=setup.scenario.stepper.name,
        )  # fmt: skip
    steps = period / stepper.step
    if round(steps) < 1 or abs(steps - round(steps)) > 1e-3 * steps:
        raise ScenarioError(
            f"stepper.step: {stepper.step:g} s does not fit into the {period:g} s between two samples of the log; take "
            f"stepper.step = {period / max(round(steps), 1):.6g}.",
            key="stepper.step", value=stepper.step,
        )  # fmt: skip
    return stepper, round(steps)
