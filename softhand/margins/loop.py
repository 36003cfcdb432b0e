"""Plant and controller as one discrete linear loop in coordinates that can move: x' = A x + B u, u = K (x, m)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from softhand.closed_loop.linearize import linearize_plant
from softhand.controllers.controller import Controller
from softhand.derivatives.linearization import Linearization, Switch
from softhand.derivatives.linearize import linearize_at
from softhand.derivatives.model import remembered_in
from softhand.derivatives.situation import Situation
from softhand.errors import ControllerError, SimulationStopped, SofthandError
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
    """One control period of plant and controller beside a state.

    x has joints, object in its own axes, their rates, the stored deformation of contacts that slip, and what relaxing
    dampings remember. What contacts that stick store follows from the motion by rolling, and is no coordinate: moved
    alone it would stay as it is for ever.

    Attributes:
        period: for which a torque is held [s].
        A: of the plant, shape (s, s).
        B: of the plant by the torques, shape (s, n).
        K: torques by (x, m), zero where an effort limit holds, shape (n, s + m).
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
    """

    units: ClassVar = {
        "period": "s",
        "moving": "1",
        "remembered": "1",
        **dict.fromkeys(("A", "B", "K", "N", "C"), "SI, by the names of rows and columns"),
    }

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

    @cached_property
    def step(self) -> Array:
        """(x, m) a period later by (x, m), shape (s + m, s + m)."""
        return self.with_torque(np.ones(len(self.inputs)))

    def with_torque(self, factors: Array) -> Array:
        """`step` with the torques of the controller multiplied, shape (n,)."""
        s = len(self.A)
        above = np.hstack([self.A, np.zeros((s, len(self.N)))]) + self.B @ (factors[:, None] * self.K)
        return np.vstack([above, self.N])

    @property
    def growth(self) -> float:
        """Of the fastest growing motion [1/s]; below zero all die out."""
        return growth_of(self.step, self.period)

    @property
    def is_smooth(self) -> bool:
        """Whether the torque follows from the state alone."""
        s = len(self.A)
        return float(np.max(np.abs(self.K[:, s:]), initial=0.0)) <= 1e-9 * float(np.max(np.abs(self.K[:, :s])))


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
        period: other than that of the scenario, for which the torque is held [s].
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
    return Loop(
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
