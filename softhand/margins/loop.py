"""Plant and controller as one discrete linear loop in coordinates that can move: x' = A x + B u, u = K (x, m)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from softhand.controllers.controller import Controller
from softhand.derivatives.linearization import Linearization, Switch
from softhand.derivatives.linearize import linearize_at
from softhand.derivatives.model import remembered_in
from softhand.derivatives.situation import Situation
from softhand.errors import ControllerError, SimulationStopped, SofthandError
from softhand.margins.place import Place
from softhand.numerics.arrays import Array
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.simulation.asking import raised_by

NEUTRAL = 1e-4
"""A growth within this of zero is zero [1/s]: some motion stays as it is, to what differences can tell."""


@dataclass(frozen=True, eq=False)
class Loop:
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
        units: of x, then "" for each of m.
        inputs: names of the joints.
        input_units: of their torques.
        moving: numbers of joints and object, nv; x begins with so many displacements and as many rates.
        remembered: how many of x are memories of dampings, its last ones.
        switches: of the linearization.
        C: outputs by (x, m), shape (y, s + m).
        outputs: their names.
        output_units: and units.
    """

    period: float
    A: Array
    B: Array
    K: Array
    N: Array
    states: tuple[str, ...]
    units: tuple[str, ...]
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
    place: Place, period: float | None = None, controller: Controller | None = None, outputs: tuple[str, ...] = ()
) -> Loop:
    """The loop at a place.

    Args:
        place: where.
        period: other than that of the scenario, for which the torque is held [s].
        controller: in place of that of the scenario.
        outputs: variables of a recording.

    Raises:
        ControllerError: the controller raised, or its torque has no derivative.
        SimulationStopped: the period does not come to its end, or has no derivative.
    """
    situation = (place.with_controller(controller) if controller else place).situation(period)
    model = _linear(situation, True, outputs)
    closed = model.closed
    assert closed is not None
    spread, gather, names, units, remembered = _coordinates(situation, model)
    s, m = len(model.A), len(closed.A) - len(model.A)
    spread_all = np.block([[spread, np.zeros((s, m))], [np.zeros((m, spread.shape[1])), np.eye(m)]])
    return Loop(
        period=model.period,
        A=gather @ model.A @ spread,
        B=gather @ model.B,
        K=closed.K @ spread_all,
        N=closed.A[s:] @ spread_all,
        states=(*names, *closed.states[s:]),
        units=(*units, *("" for _ in closed.states[s:])),
        inputs=model.inputs,
        input_units=model.input_units,
        moving=len(situation.state.v),
        remembered=remembered,
        switches=model.switches,
        C=closed.C @ spread_all,
        outputs=model.outputs,
        output_units=model.output_units,
    )


def plant_over(place: Place, time: float) -> tuple[Array, Array]:
    """A and B of the plant for torques that are held for any time [s], in the coordinates of `Loop`."""
    situation = place.situation(time)
    model = _linear(situation, False, ())
    spread, gather, *_ = _coordinates(situation, model)
    return gather @ model.A @ spread, gather @ model.B


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


def _first_bad(matrix: Array, columns: tuple[str, ...]) -> str:
    bad = np.flatnonzero(~np.all(np.isfinite(matrix), axis=0))
    return columns[bad[0]] if len(bad) else ""


def _coordinates(
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
