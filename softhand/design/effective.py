"""What the object weighs to whoever moves it by the fingers, and which joint damping is felt at it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from softhand.margins.place import Place
from softhand.numerics.arrays import Array


class Effective(NamedTuple):
    """Of an object in rolling contact, about its origin, in its axes."""

    inertia: Array
    """M_O + A^T M_F A [kg, kg m^2], shape (6, 6)."""
    follow: Array
    """A = J_CF^f+ G^T, from the twist of the object to the joint velocities, shape (n, 6)."""

    def joint_damping(self, rate: float) -> float:
        """K_v of all joints for which K_v A^T A has, in the mean over the axes, `rate` times the inertia.

        Args:
            rate: 2 zeta omega [1/s].
        """
        ratio = np.diag(self.inertia) / np.diag(self.follow.T @ self.follow)
        return float(rate * np.exp(np.mean(np.log(ratio))))


def effective(place: Place) -> Effective:
    """At a place."""
    at = place.situation()
    seen, n = at.probe.seen(at.state, at.state.time), at.plant.world.n_joints
    axes = np.kron(np.eye(2), seen.object_rotation)
    follow = np.linalg.pinv(seen.hand_force_jacobian, rcond=1e-6) @ seen.object_force_jacobian @ axes
    M = at.plant.rigid.mass_matrix(at.state.q)
    return Effective(M[n:, n:] + follow.T @ M[:n, :n] @ follow, follow)
