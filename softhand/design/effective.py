"""What the object weighs to whoever moves it by the fingers, and which joint damping is felt at it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from softhand.margins.place import Place
from softhand.numerics.arrays import Array


class Effective(NamedTuple):
    """Of an object in rolling contact, about its origin, in its axes."""

    inertia: Array
    """M_O + A^T M_F A [kg, kg m^2], shape (6, 6)."""
    follow: Array
    """A = J_CF^f+ G^T, from the twist of the object to the joint velocities, shape (n, 6)."""

    def joint_damping(self, rate: float) -> Array:
        """K_v >= 0 of each joint for which A^T K_v A is nearest to `rate` times the inertia, shape (n,).

        Args:
            rate: 2 zeta omega [1/s].
        """
        size = np.sqrt(np.diag(self.inertia))
        wanted = rate * self.inertia / np.outer(size, size)
        parts = (self.follow / size)[:, :, None] * (self.follow / size)[:, None, :]
        return np.asarray(nnls(parts.reshape(len(parts), 36).T, wanted.ravel())[0])


def effective(place: Place) -> Effective:
    """At a place."""
    at = place.situation()
    seen, n = at.probe.seen(at.state, at.state.time), at.plant.world.n_joints
    axes = np.kron(np.eye(2), seen.object_rotation)
    follow = np.linalg.pinv(seen.hand_force_jacobian, rcond=1e-6) @ seen.object_force_jacobian @ axes
    M = at.plant.rigid.mass_matrix(at.state.q)
    return Effective(M[n:, n:] + follow.T @ M[:n, :n] @ follow, follow)
