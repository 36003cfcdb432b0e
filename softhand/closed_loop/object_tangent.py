"""What hand and object need to be held beside a state: the tangent of their forces, and joints taken out of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from softhand.closed_loop.linearize import is_memory, slope
from softhand.contact.damping import relaxation_rate
from softhand.numerics.arrays import Array
from softhand.plant.plant import Plant
from softhand.plant.state import State

_LEAST = 1e-9  # of the largest singular value; differences leave some 1e-10
_IDLE = 1e-7  # of the largest torque by the object, beyond which a motion is not idle


@dataclass(frozen=True, eq=False)
class Tangent:
    """Torques of the joints and a wrench on the object, by a displacement of both: (torque, wrench) = K (q, xi).

    xi is a translation of the origin of the object [m] and a rotation vector [rad], the wrench a force [N] and a moment
    about that origin [N m], both in world axes. The origin moves with the object.

    Attributes:
        matrix: K, shape (n + 6, n + 6).
        unbalanced: wrench of contacts, supports and gravity on the object at the state, zero at rest, shape (6,).
        held: torques that keep the joints at rest there [N m or N], shape (n,).
    """

    matrix: Array
    unbalanced: Array
    held: Array

    def with_joints(self, compliance: Array) -> Array:
        """What the object needs if each joint is held by a spring [rad/(N m)], shape (n,): of 6 x 6; zeros are locks.

        K_oo - K_oj (K_jj + C^-1)^-1 K_jo = K_oo - K_oj (1 + C K_jj)^-1 C K_jo
        """
        n, C = len(compliance), np.diag(compliance)
        series: Array = np.eye(n) + C @ self.matrix[:n, :n]
        return self._without(np.asarray(np.linalg.solve(series, C @ self.matrix[:n, n:])))

    def with_torques(self) -> Array | None:
        """The same if the joints are held by what is in K already, K_oo - K_oj K_jj^-1 K_jo.

        Motions of the joints alone that need neither torque nor wrench are left where they are. None if the object has
        no rest beside the state: some motion of the joints that needs no torque moves it.
        """
        n = len(self.matrix) - 6
        held, by_object, on_object = self.matrix[:n, :n], self.matrix[:n, n:], self.matrix[n:, :n]
        left, values, right = np.linalg.svd(held)
        idle = values <= _LEAST * values[0]
        loads = max(
            np.abs(left[:, idle].T @ by_object).max(initial=0.0), np.abs(on_object @ right[idle].T).max(initial=0.0)
        )
        if loads > _IDLE * np.abs(by_object).max():
            return None
        motion: Array = np.linalg.pinv(held, rcond=_LEAST) @ by_object
        return self._without(motion)

    def _without(self, motion: Array) -> Array:
        """The object's share, the joints moving by so much for each displacement of it, with the other sign."""
        n = len(motion)
        found: Array = self.matrix[n:, n:] - self.matrix[n:, :n] @ motion
        return found


def tangent(plant: Plant, state: State, feedback: Array | None = None) -> Tangent:
    """The tangent about a state at rest: tips roll, and what relaxes has relaxed.

    Args:
        plant: left at the state, or beside it.
        state: at rest.
        feedback: torques of the joints by the state, as `Feedback.by_state`, shape (n, s); none if they are constant.
    """
    world, n, nv = plant.world, plant.world.n_joints, len(state.v)
    remembered, forgetting = is_memory(plant), np.zeros_like(state.z)

    def forces(beside: State) -> Array:
        plant.update(beside.q, beside.v, beside.z)
        force = plant.rigid.mass_matrix(beside.q) @ plant.acceleration(np.zeros(n), np.zeros(nv))
        relaxation_rate(plant.pads, plant.contacts, beside.z, forgetting)
        R = world.object_rotation(beside.q)
        return np.concatenate([force[:n], R @ force[n : n + 3], R @ force[n + 3 :], forgetting[remembered]])

    by_state = slope(plant, state, forces)
    if feedback is not None:
        by_state[:n] += feedback
    values, rates = by_state[:nv], by_state[nv:]  # memories stay where their rates are zero
    K = values[:, 2 * nv :] @ np.linalg.solve(rates[:, 2 * nv :], rates[:, :nv]) - values[:, :nv]
    R = world.object_rotation(state.q)
    K[:, n : n + 3], K[:, n + 3 :] = K[:, n : n + 3] @ R.T, K[:, n + 3 :] @ R.T
    left = forces(state)
    return Tangent(K, left[n:nv], -left[:n])


def inverse(stiffness: Array, length: float) -> Array:
    """The compliance; NaN if some displacement needs no wrench.

    Args:
        stiffness: shape (6, 6).
        length: by which moments count as forces [m].
    """
    scale = np.repeat([1.0, 1.0 / length], 3)
    values = np.linalg.svd(stiffness * np.outer(scale, scale), compute_uv=False)
    if values[-1] <= _LEAST * values[0]:
        return np.full((6, 6), np.nan)
    return np.asarray(np.linalg.inv(stiffness))


def principal(matrix: Array) -> tuple[Array, Array]:
    """Eigenvalues of the symmetric part of a 3 x 3 matrix, the least first, and their directions as rows."""
    values, columns = np.linalg.eigh(0.5 * (matrix + matrix.T))
    rows = columns.T * np.where(columns[np.argmax(np.abs(columns), axis=0), range(3)] < 0.0, -1.0, 1.0)[:, None]
    return values, rows


def about_couples(stiffness: Array) -> Array:
    """Stiffness of rotation of an object that is turned by a pure couple and shifts as it likes, shape (3, 3).

    It is the same about every point, as the block of translations is.
    """
    force, across = stiffness[:3, :3], stiffness[:3, 3:]
    free: Array = stiffness[3:, 3:] - stiffness[3:, :3] @ np.linalg.pinv(force, rcond=_LEAST) @ across
    return free


def length_of(inertia: pin.Inertia) -> float:
    """Root of the mean squared distance of the mass of a body from its centre [m]."""
    return float(np.sqrt(np.trace(inertia.inertia) / (2.0 * inertia.mass)))
