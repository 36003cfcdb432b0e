"""Plant and controller as one discrete linear loop in coordinates that can move: x' = A x + B u, u = K (x, m)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.measurement_noise import component_labels
from softhand.closed_loop.linearize import linearize_plant
from softhand.controllers.controller import Controller
from softhand.derivatives.linearization import Linearization, Switch
from softhand.derivatives.linearize import linearize_at
from softhand.derivatives.model import remembered_in
from softhand.derivatives.situation import Situation
from softhand.errors import ControllerError, SimulationStopped, SofthandError
from softhand.margins.built import (
    Controls,
    Turn,
    actuation_at,
    channel_at,
    has_dynamics,
    is_dynamic,
    kept_names,
    turns_of,
)
from softhand.margins.measured import answers_to, measured_along
from softhand.margins.place import Place
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.simulation.asking import raised_by

NEUTRAL = 1e-4
"""A growth within this of zero is zero [1/s]: some motion stays as it is, to what differences can tell."""


@dataclass(frozen=True, eq=False)
class Loop(Record):
    """One control period of plant and controller beside a state, with the instruments and drives between them.

    x has joints, object in its own axes, their rates, the stored deformation of contacts that slip, and what relaxing
    dampings remember. What contacts that stick store follows from the motion by rolling, and is no coordinate: moved
    alone it would stay as it is for ever. m has the numbers in the memory of the controller that change with x, then
    what instruments and drives keep: samples held and on their way, filters, commands on their way, lags.

    Where an instrument has samples less often than the control period, or a controller that is asked less often sees
    through instruments or drives that keep something, no two periods in a row are alike: then `turns` of them make a
    cycle, of which K and N are the first, and `step` is that of the cycle.

    Attributes:
        period: for which a torque is held [s].
        A: of the plant, shape (s, s).
        B: of the plant by the torques, shape (s, n).
        K: torques that the joints have by (x, m), zero where an effort limit holds, shape (n, s + m).
        N: next m by (x, m), shape (m, s + m).
        states: names of x, then of m.
        state_units: of x, then "" for each of m.
        inputs: names of the joints.
        input_units: of their torques.
        moving: numbers of joints and object, nv; x begins with so many displacements and as many rates.
        remembered: how many of x are memories of dampings, its last ones.
        switches: of the linearization.
        C: displacement of joints, of the object along and about the axes of the world, and internal forces by (x, m),
            shape (y, s + m).
        outputs: names of these.
        output_units: and units.
        later: K, N and what errors do of the further periods of a cycle.
        by_error: torque and next m by an error of each component of a quantity that is measured with noise or late, by
            its name, shape (n + m, components).
        carried: how many of m, the last ones, instruments and drives keep.
    """

    units: ClassVar = {
        "period": "s",
        "moving": "1",
        "remembered": "1",
        **dict.fromkeys(("A", "B", "K", "N", "C"), "SI, by the names of rows and columns"),
        "carried": "1",
        "cycle": "s",
    }
    unreported: ClassVar = frozenset({"later", "by_error"})

    period: float
    A: Array
    B: Array
    K: Array
    N: Array
    states: tuple[str, ...]
    state_units: tuple[str, ...]
    inputs: tuple[str, ...]
    input_units: tuple[str, ...]
    moving: int
    remembered: int
    switches: tuple[Switch, ...]
    C: Array
    outputs: tuple[str, ...]
    output_units: tuple[str, ...]
    later: tuple[Turn, ...] = ()
    by_error: Mapping[str, Array] = field(default_factory=dict)
    carried: int = 0

    @property
    def turns(self) -> tuple[Turn, ...]:
        """The periods of a cycle."""
        return Turn(self.K, self.N, self.by_error), *self.later

    @property
    def cycle(self) -> float:
        """After which all begins anew [s]."""
        return len(self.turns) * self.period

    @cached_property
    def step(self) -> Array:
        """(x, m) a cycle later by (x, m), shape (s + m, s + m)."""
        return self.with_torque(np.ones(len(self.inputs)))

    @cached_property
    def steps(self) -> tuple[Array, ...]:
        """(x, m) a period later by (x, m), for each period of a cycle."""
        return self._steps(np.ones(len(self.inputs)))

    def with_torque(self, factors: Array) -> Array:
        """`step` with the torques of the controller multiplied, shape (n,)."""
        return in_turn(self._steps(factors))

    def _steps(self, factors: Array) -> tuple[Array, ...]:
        above = np.hstack([self.A, np.zeros((len(self.A), len(self.N)))])
        return tuple(np.vstack([above + self.B @ (factors[:, None] * one.K), one.N]) for one in self.turns)

    @property
    def growth(self) -> float:
        """Of the fastest growing motion [1/s]; below zero all die out."""
        return growth_of(self.step, self.cycle)

    @property
    def is_smooth(self) -> bool:
        """Whether the torque follows from the state alone."""
        s = len(self.A)
        return not self.carried and float(np.max(np.abs(self.K[:, s:]), initial=0.0)) <= 1e-9 * float(
            np.max(np.abs(self.K[:, :s]))
        )


def in_turn(steps: Sequence[Array]) -> Array:
    """Some maps one after the other."""
    whole = steps[0]
    for one in steps[1:]:
        whole = one @ whole
    return whole


def growth_of(step: Array, period: float) -> float:
    """Rate of the fastest growing motion of a map that is applied once a period [s], in 1/s."""
    with np.errstate(divide="ignore"):
        return float(np.log(np.max(np.abs(np.linalg.eigvals(step)))) / period)


def is_stable(growth: float) -> bool:
    """Whether no motion grows; one that stays as it is does not."""
    return growth < NEUTRAL


def close_loop(
    place: Place, period: float | None = None, controller: Controller | None = None, with_outputs: bool = False
) -> Loop:
    """The loop at a place.

    Args:
        place: where.
        period: other than that of the scenario, for which the torque is held [s]. Delays, distances of samples, filters
            and lags stay what they are in seconds; what comes between two control periods is there at the later one.
        controller: in place of that of the scenario.
        with_outputs: whether C is computed; else it has no rows.

    Raises:
        ControllerError: the controller raised, or its torque has no derivative.
        SimulationStopped: the period does not come to its end, or has no derivative.
    """
    situation = (place.with_controller(controller) if controller else place).situation(period)
    model = _linear(situation, True, ("internal_force",) if with_outputs else ())
    closed = model.closed
    assert closed is not None
    spread, gather, names, units, remembered = rolling_coordinates(situation, model)
    s, m = len(model.A), len(closed.A) - len(model.A)
    spread_all = np.block([[spread, np.zeros((s, m))], [np.zeros((m, spread.shape[1])), np.eye(m)]])
    C, outputs, output_units = _outputs(situation, model, closed.C) if with_outputs else (closed.C, (), ())
    ideal = Loop(
        period=model.period,
        A=gather @ model.A @ spread,
        B=gather @ model.B,
        K=closed.K @ spread_all,
        N=closed.A[s:] @ spread_all,
        states=(*names, *closed.states[s:]),
        state_units=(*units, *("" for _ in closed.states[s:])),
        inputs=model.inputs,
        input_units=model.input_units,
        moving=len(situation.state.v),
        remembered=remembered,
        switches=model.switches,
        C=C @ spread_all,
        outputs=outputs,
        output_units=output_units,
    )
    return _as_built(ideal, place, situation, spread)


def _as_built(ideal: Loop, place: Place, situation: Situation, spread: Array) -> Loop:
    """The loop with instruments and drives, where they keep something from one control period to the next, or err."""
    setup = place.setup
    every = place.calls
    ratio = ideal.period / every / setup.asked.control_period
    channels = {} if setup.sensing is None else {
        name: channel_at(one, ratio) for name, one in setup.sensing.channels.items()
        if np.any(one.noise) or has_dynamics(one)
    }  # fmt: skip
    drives = None if setup.actuation is None else actuation_at(setup.actuation, ratio)
    dynamic = [name for name, one in channels.items() if has_dynamics(one)]
    is_noisy = drives is not None and bool(np.any(drives.noise))
    if not channels and drives is None:
        return ideal
    if not dynamic and not is_dynamic(drives) and not (is_noisy and every > 1):
        every = 1
    kept = [int(name.rpartition(" ")[2]) - 1 for name in ideal.states[len(ideal.A) :]]  # as `linearize` names them
    answers = answers_to(situation, list(channels), kept)
    free = np.any(ideal.K != 0.0, axis=1)  # of effort limits
    for answer in answers.values():
        answer[: len(free)] *= free[:, None]
    along = {name: rows @ spread for name, rows in measured_along(situation, dynamic).items()}
    asked = Controls(ideal.K, ideal.N, answers, along, every)
    first, *later = turns_of(asked, channels, drives)
    world = situation.plant.world
    labels = {"torque": [f"torque of {name}" for name in ideal.inputs]} | {
        name: [f"{name} {label}" for label in component_labels(name, world)] for name in dynamic
    }
    names = kept_names(asked, channels, drives, labels)
    A, B = (ideal.A, ideal.B) if every == 1 else plant_over(place, ideal.period / every)
    return replace(
        ideal, period=ideal.period / every, A=A, B=B, K=first.K, N=first.N, states=(*ideal.states, *names),
        state_units=(*ideal.state_units, *("" for _ in names)),
        C=np.hstack([ideal.C, np.zeros((len(ideal.C), len(names)))]), later=tuple(later), by_error=first.by_error,
        carried=len(names),
    )  # fmt: skip


def plant_over(place: Place, time: float) -> tuple[Array, Array]:
    """A and B of the plant for torques that are held for any time [s], in the coordinates of `Loop`."""
    situation = place.situation(time)
    model = _linear(situation, False, ())
    spread, gather, *_ = rolling_coordinates(situation, model)
    return gather @ model.A @ spread, gather @ model.B


def acceleration_at(place: Place) -> Array:
    """Of joints and object under the torques there, zero at rest [rad/s^2 or m/s^2], shape (nv,)."""
    plant, state = place.plant, place.state
    torque = place.situation().torque
    plant.update(state.q, state.v, state.z)
    return plant.acceleration(torque, np.zeros(len(state.v)))


def without_sampling(loop: Loop, place: Place) -> float:
    """Growth of the fastest growing motion if the controller answered at once [1/s]: the eigenvalues of A + B K.

    NaN for a controller whose torque depends on its memory of earlier samples, which has no law without sampling, and
    where a contact slips.
    """
    nv, s = loop.moving, len(loop.A)
    if not loop.is_smooth or s != 2 * nv + loop.remembered:
        return math.nan
    situation = place.situation()
    model = linearize_plant(situation.plant, situation.state, situation.torque)
    return float(np.max(np.linalg.eigvals(model.A + model.B @ loop.K[:, :s]).real))


def _linear(situation: Situation, closed: bool, outputs: tuple[str, ...]) -> Linearization:
    controller, time = situation.setup.controller, situation.state.time
    try:
        model = linearize_at(situation, (), outputs, closed)
    except SofthandError:
        raise
    except Exception as error:
        raise raised_by(controller, error, time) from error
    bad = _first_bad(model.A, model.states) or _first_bad(model.B, model.inputs)
    if bad:
        raise SimulationStopped(
            f"the loop has no linear model at t = {time:g} s: either way along '{bad}' a contact crosses a switch; "
            "choose another time.",
            reason="diverged", time=time,
        )  # fmt: skip
    if model.closed and (bad := _first_bad(model.closed.K, model.closed.states)):
        raise ControllerError(
            f"controller '{type(controller).__name__}' has a torque without a derivative along '{bad}' at t = {time:g} "
            "s; choose another time.",
            controller=type(controller).__name__, reason="controller", time=time,
        )  # fmt: skip
    return model


def _outputs(
    situation: Situation, model: Linearization, forces: Array
) -> tuple[Array, tuple[str, ...], tuple[str, ...]]:
    world, n = situation.plant.world, len(model.inputs)
    C = np.zeros((n + 6, forces.shape[1]))
    R = world.object_rotation(situation.state.q)
    C[:n, :n], C[n : n + 3, n : n + 3], C[n + 3 :, n + 3 : n + 6] = np.eye(n), R, R
    names = (*model.inputs, *(f"object {what} {axis}" for what in ("position", "turn") for axis in "xyz"))
    return np.vstack([C, forces]), (*names, *model.outputs), (*model.state_units[: n + 6], *model.output_units)


def _first_bad(matrix: Array, columns: tuple[str, ...]) -> str:
    bad = np.flatnonzero(~np.all(np.isfinite(matrix), axis=0))
    return columns[bad[0]] if len(bad) else ""


def rolling_coordinates(
    situation: Situation, model: Linearization
) -> tuple[Array, Array, tuple[str, ...], tuple[str, ...], int]:
    """Matrices from the coordinates of `Loop` to those of a linearization and back, names, units, count of memories."""
    plant, state = situation.plant, situation.state
    nv, entries = len(state.v), remembered_in(plant)
    slipping = {one.where for one in model.switches if one.what == "slip" and one.side == "slips"}
    slips = np.array([name in slipping for name in plant.contact_names])
    is_shear = entries[:, 1] < 3
    kept = np.concatenate([np.ones(2 * nv, bool), ~is_shear | slips[entries[:, 0]]])
    spread = np.eye(len(model.A))[:, kept]
    rolling = _rolling(situation.plant, state)
    rows = 2 * nv + np.flatnonzero(is_shear & ~slips[entries[:, 0]])
    spread[rows, :nv] = rolling[tuple(entries[rows - 2 * nv].T)]
    names, units = (tuple(np.array(one)[kept].tolist()) for one in (model.states, model.state_units))
    return spread, np.eye(len(model.A))[kept], names, units, int(np.sum(~is_shear))


def _rolling(plant: Plant, state: State) -> NDArray[np.float64]:
    """What each contact stores for a displacement, by rolling; it is linear in the velocity, shape (nc, 3, nv)."""
    nv = len(state.v)
    found = np.zeros((len(plant.contacts), 3, nv))
    for k in range(nv):
        plant.update(state.q, np.eye(nv)[k], state.z)
        found[:, :, k] = plant.contacts["deformation_rate"][:, 1:]
    return found
