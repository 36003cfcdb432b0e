"""What one thread of a calibration works with: the plant, and plants beside it in which a parameter is moved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.parts import read_fingertips
from softhand.assembly.plant import read_supports, read_world
from softhand.assembly.resolve import Setup
from softhand.calibration.handing_on import Kick
from softhand.calibration.instruments import Instrument, instruments_of, measured_values, off, true_values
from softhand.calibration.layout import Layout
from softhand.calibration.parameters import BIAS, PLANT, Parameter, keyed, values_of
from softhand.calibration.replay import Replay
from softhand.derivatives.model import beyond
from softhand.derivatives.states import state_entries
from softhand.errors import ScenarioError
from softhand.model.world import slides_of
from softhand.numerics.arrays import Array
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.simulation.pushes import Push

_UNMOVED, _NOT = np.array([-1]), np.zeros(1)
_CLOSER = (
    0.01  # times the steps of `state_entries`, which are a hundred times the slack that their ends are compared with
)
_STICKS = 1e3  # friction with which no tip slips


class Linear(NamedTuple):
    """A piece as it is, and how it changes with the state s where it begins and with the parameters x.

    Attributes:
        r: measured - predicted, shape (m,).
        end: the state where the next piece begins.
        kick: that it begins with.
        use: coefficient of friction that the tips of this one need.
        by_start: derivative of what is predicted by s, shape (m, states).
        by_parameters: by x, shape (m, p).
        end_by_start: derivative of the tangent coordinates of the end by s, shape (states, states).
        end_by_parameters: by x, shape (states, p).
    """

    r: Array
    end: State
    kick: Kick
    use: float
    by_start: Array
    by_parameters: Array
    end_by_start: Array
    end_by_parameters: Array


class Run(NamedTuple):
    """A piece as it is, as in `Linear`."""

    r: Array
    end: State
    kick: Kick
    use: float


class Bench:
    """The plant at some parameters, and what it does in pieces of a log.

    Attributes:
        plant: that goes.
        friction: the largest of its tips, as the scenario has it.

    Args:
        layout: of the log.
        setup: of the scenario.
        parameters: that are fitted.
        x: where they are.
    """

    def __init__(self, layout: Layout, setup: Setup, parameters: Sequence[Parameter], x: Array) -> None:
        self._layout, self._setup, self._parameters = layout, setup, list(parameters)
        self.become(x, False)
        remembered = self._base.model.remembered
        self._steps = _CLOSER * state_entries(self.plant, slides_of(self.plant.world), remembered, layout.period).steps

    @property
    def remembered(self) -> NDArray[np.int64]:
        """Row and column of the numbers of z that belong to a state."""
        return self._base.model.remembered

    @property
    def n_states(self) -> int:
        """Numbers of a state."""
        return self._base.model.n_states

    def become(self, x: Array, sticks: bool) -> None:
        """Be at these parameters; no tip slips if it `sticks`."""
        self._x, self._sticks = x, sticks
        self.plant = self._plant(x)
        self._base = self._replay(self.plant)
        self._beside: dict[int, tuple[Replay, float]] = {}
        self._instruments = self._at(x)

    def go(self, state: State, first: int, count: int) -> State:
        """On from a state at a sample of the log, so many periods, afresh."""
        log = self._layout.log
        seen = self._base.samples(state, log.joint_torque[first : first + count], _UNMOVED, _NOT)[0]
        return self._base.state(seen[count], float(log.time[0] + (first + count) * log.period))

    def run(self, k: int, state: State, kick: Kick | None) -> Run:
        """A piece from a state."""
        seen = self._samples(self._base, k, state, kick)[0]
        r = self._off(k, self._layout.measured(k), self._seen(self._true(seen), self._instruments))
        return Run(r, *self._end(k, seen))

    def linear(self, k: int, state: State, kick: Kick | None) -> Linear:
        """Likewise, with its derivatives."""
        steps = self._steps
        samples = self._samples(
            self._base, k, state, kick, np.arange(-1, self.n_states), np.concatenate([[0.0], steps])
        )
        (end, left, use), ends = self._end(k, samples[0]), self._ends(samples)
        every = self._true(samples)
        true = {name: values[0].copy() for name, values in every.items()}
        seen = self._seen(every, self._instruments)
        here = {name: values[0].copy() for name, values in seen.items()}
        r = self._off(k, self._layout.measured(k), here)
        by_start = (self._off(k, {name: values[1:] for name, values in seen.items()}, here) / steps[:, None]).T
        end_by_start = (beyond(self.plant, ends[1:], ends[0]) / steps[:, None]).T
        by_parameters, end_by = self._by_parameters(k, state, kick, true, here, ends[0])
        return Linear(r, end, left, use, by_start, by_parameters, end_by_start, end_by)

    def _by_parameters(
        self, k: int, state: State, kick: Kick | None, true: dict[str, Array], here: dict[str, Array], end: Array
    ) -> tuple[Array, Array]:
        """Derivatives of what is predicted, and of the end."""
        layout, count = self._layout, len(self._parameters)
        by_parameters, end_by = np.zeros((len(layout.channel[k]), count)), np.zeros((self.n_states, count))
        beside, steps_of, moved = [], [], []
        for j, one in enumerate(self._parameters):
            if one.kind == PLANT:
                replay, step = self._moved(j)
                beside.append(self._samples(replay, k, state, kick)[0].copy())
                steps_of.append(step)
                moved.append(j)
            elif one.kind == BIAS:
                channel = layout.channels.index((one.quantity, one.component))
                by_parameters[:, j] = one.worth * (layout.channel[k] == channel)
            else:
                x, step = self._x.copy(), _ahead(one, self._x[j])
                x[j] += step
                by_parameters[:, j] = self._off(k, self._seen(true, self._at(x)), here) / step
        if moved:
            samples, by = np.stack(beside), np.array(steps_of)[:, None]
            by_parameters[:, moved] = (self._off(k, self._seen(self._true(samples), self._instruments), here) / by).T
            end_by[:, moved] = (beyond(self.plant, self._ends(samples), end) / by).T
        return by_parameters, end_by

    def _plant(self, x: Array) -> Plant:
        setup = self._setup
        of_plant = [k for k, one in enumerate(self._parameters) if one.kind == PLANT]
        values = keyed([self._parameters[k] for k in of_plant], values_of(self._parameters, x)[of_plant])
        scenario = setup.scenario.with_values(values) if values else setup.scenario
        world = read_world(scenario)
        fingertips = read_fingertips(scenario, world, setup.law)
        plant = Plant(world, fingertips, read_supports(scenario, world, fingertips), "compiled")
        self.friction = float(plant.pads["friction"][: world.n_tips].max())
        if self._sticks:
            plant.pads["friction"] = plant.pads["static_friction"] = _STICKS
            plant.pads["face_friction"] = 0.0
        return plant

    def _replay(self, plant: Plant) -> Replay:
        layout = self._layout
        pushes = [Push(**push.model_dump()) for push in self._setup.scenario.push]
        return Replay(plant, layout.stepper, layout.steps, pushes, layout.pieces[0].size)

    def _moved(self, j: int) -> tuple[Replay, float]:
        """The plant with a parameter moved, and by how much: back where it cannot go on."""
        if j not in self._beside:
            x, ahead = self._x.copy(), _ahead(self._parameters[j], self._x[j])
            for step in (ahead, -ahead):
                x[j] = self._x[j] + step
                try:
                    self._beside[j] = self._replay(self._plant(x)), step
                    break
                except ScenarioError:
                    if step != ahead:
                        raise
        return self._beside[j]

    def _at(self, x: Array) -> dict[str, Instrument]:
        names, values = self._layout.names, values_of(self._parameters, x)
        return instruments_of(self._setup.scenario, self.plant.world, names, self._parameters, values)

    def _samples(
        self, replay: Replay, k: int, state: State, kick: Kick | None,
        entries: NDArray[np.int64] = _UNMOVED, amounts: Array = _NOT,
    ) -> Array:  # fmt: skip
        return replay.samples(state, self._layout.torques(k), entries, amounts, kick, self._layout.handed_on)

    def _true(self, seen: Array) -> dict[str, Array]:
        count = self._layout.pieces[0].size
        return {name: true_values(name, seen[..., :count, :], self.plant.world) for name in self._layout.names}

    def _seen(self, true: dict[str, Array], instruments: dict[str, Instrument]) -> dict[str, Array]:
        layout = self._layout
        return {name: measured_values(name, true[name], instruments[name], layout.period) for name in layout.names}

    def _off(self, k: int, values: dict[str, Array], others: dict[str, Array]) -> Array:
        """Rows of a piece by which values are off from others; shape (..., m)."""
        found = []
        for name, (places, _) in zip(self._layout.names, self._layout.rows[k], strict=True):
            difference = off(name, values[name], others[name], self.plant.world)
            found.append(difference.reshape(*difference.shape[:-2], -1)[..., places])
        return np.concatenate(found, axis=-1)

    def _end(self, k: int, seen: Array) -> tuple[State, Kick, float]:
        count, use = self._layout.handed_on, self._base.use
        end = self._base.state(seen[count], self._layout.time(k, count))
        return end, self._base.left(end), use

    def _ends(self, seen: Array) -> Array:
        """q, v, z where the next piece begins, of many starts of a piece."""
        world, rows = self.plant.world, seen[:, self._layout.handed_on]
        return np.hstack([rows[:, : world.nq + world.nv], rows[:, rows.shape[1] - len(self.remembered) :]])


def _ahead(one: Parameter, x: float) -> float:
    """The step of a difference: back at the upper bound."""
    return one.step if x + one.step <= one.to_x(one.upper) else -one.step
