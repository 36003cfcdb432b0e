"""The plant about a state as a linear system, x' = A x + B u, whatever controls it.

x is a displacement of the joints and the object, its rate, and what relaxing dampings remember. The contacts follow the
displacement by rolling: their stored deformation moves as their rates, linear in the velocity, say.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.assembly.unmodelled import must_model, must_slip_as_a_whole
from softhand.contact.damping import relaxation_rate
from softhand.contact.records import REMEMBERED, STORED
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.plant.plant import Plant
from softhand.plant.state import State

_STEP = 1e-6  # of x in its units
OBJECT = ("x", "y", "z", "turn about x", "turn about y", "turn about z")
FORCES = ("radial", "first tangential", "second tangential", "torsional", "by the first lean", "by the second lean")
"""What a relaxation remembers, in the order of z."""


@dataclass(frozen=True, eq=False)
class LinearModel(Record):
    """x' = A x + B u about a state, u what the joint torques have beyond those held there.

    Attributes:
        A: shape (s, s), s = 2 nv + 4 relaxations at each contact.
        B: shape (s, n).
        states: name of each entry of x: joints [rad or m], object in its own axes [m, rad], their rates, then the
            memories [N, N m].
        inputs: names of the joints, whose torques [N m, N] are u.
        acceleration: of joints and object at the state [rad/s^2 or m/s^2], zero at rest, shape (nv,).
    """

    units: ClassVar = {"A": "SI, by `states`", "B": "SI, by `states` and `inputs`", "acceleration": "rad/s^2, m/s^2"}

    A: Array
    B: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    acceleration: Array


def linearize_plant(plant: Plant, state: State, torque: Array) -> LinearModel:
    """The open-loop linear model of a plant about a state under held torques.

    Contacts stick and roll, supports too; a contact in touch stays so, one that is not stays idle.

    Args:
        plant: left at the state.
        state: any; the model is that of small motions beside it, and `acceleration` says whether it is at rest.
        torque: held by the joints [N m], shape (n,).

    Raises:
        ScenarioError: joints have dry friction.
    """
    must_model("A linear model", plant.world.mechanics)
    must_slip_as_a_whole("A linear model", plant.fingertips)
    nv, n, remembered = len(state.v), len(torque), is_memory(plant)
    forgetting = np.zeros_like(state.z)

    def rates(beside: State) -> Array:
        plant.update(beside.q, beside.v, beside.z)
        acceleration = plant.acceleration(torque, np.zeros(nv))
        relaxation_rate(plant.pads, plant.contacts, beside.z, forgetting)
        return np.concatenate([acceleration, forgetting[remembered]])

    by_state = slope(plant, state, rates)
    acceleration = rates(state)[:nv].copy()
    A, B = np.zeros((by_state.shape[1],) * 2), np.zeros((by_state.shape[1], n))
    A[:nv, nv : 2 * nv], A[nv:] = np.eye(nv), by_state
    B[nv : 2 * nv] = np.linalg.inv(plant.rigid.mass_matrix(state.q))[:, :n]
    joints = tuple(plant.world.joint_names)
    moving = (*joints, *(f"object {way}" for way in OBJECT))
    memories = (f"{plant.contact_names[i]}, {memory_name(plant, column)}" for i, column in np.argwhere(remembered))
    return LinearModel(A, B, (*moving, *(f"{name}, rate" for name in moving), *memories), joints, acceleration)


def slope(plant: Plant, state: State, function: Callable[[State], Array]) -> Array:
    """Derivatives of a function of the state along each entry of x, by central differences, shape (values, s)."""
    size = 2 * len(state.v) + np.count_nonzero(is_memory(plant))
    columns = []
    for move in _STEP * np.eye(size):
        ahead, behind = (function(beside(plant, state, way)) for way in (move, -move))
        columns.append((ahead - behind) / (2.0 * _STEP))
    return np.column_stack(columns)


def beside(plant: Plant, state: State, x: Array) -> State:
    """A state moved along x; the contacts follow by rolling."""
    nv, z = len(state.v), state.z.copy()
    plant.update(state.q, x[:nv], state.z)
    z[:, :3] += plant.contacts["deformation_rate"][:, 1:]  # linear in the velocity
    z[is_memory(plant)] += x[2 * nv :]
    return State(pin.integrate(plant.world.coordinates, state.q, x[:nv]), state.v + x[nv : 2 * nv], z)


def memory_name(plant: Plant, column: int) -> str:
    """What a number of z is that belongs to a relaxation."""
    which, force = divmod(int(column) - STORED, int(plant.pads["remembered"][0]))
    return f"memory {which + 1}, {FORCES[force]}"


def is_memory(plant: Plant) -> NDArray[np.bool_]:
    """Which numbers of z belong to a relaxation, shape (nc, n_memory); tips may have fewer than others, or none."""
    size = plant.pads["remembered"]
    last = STORED + size * np.count_nonzero(plant.pads["relaxation"][:, :, 1], axis=1)
    column = np.arange(plant.n_memory)
    used = (column >= STORED) & (column < last[:, None])
    forces = (column - STORED) % size[:, None] < REMEMBERED
    remembered: NDArray[np.bool_] = used & (forces | (plant.pads["slope_function"] != 0)[:, None])
    return remembered
