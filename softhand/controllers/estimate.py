"""The grasp as joints and contact forces tell it, at one sample, and where it lies in a memory."""

from __future__ import annotations

from math import prod
from typing import NamedTuple

import numpy as np

from softhand.contact.pairs import contact_pairs
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.rotations import set_rpy


class Estimate(NamedTuple):
    """The grasp at one sample, as `ObjectEstimator` sees it."""

    position: Array
    """Origin of the object frame [m], shape (3,)."""
    rotation: Array
    """Axes of the object frame as columns, shape (3, 3)."""
    q_F: Array
    """Joint angles [rad], shape (n,)."""
    deformation: Array
    """dr [m], dtheta, dphi, dpsi [rad] or dr, s1, s2 [m], psi [rad], by the law, shape (nc, 4)."""
    tau_C: Array
    """Torsion moments on the object [N m], shape (nc,)."""
    point: Array
    """Contact points [m], shape (nc, 3)."""
    axes: Array
    """Of the contact frames C_F in the world, shape (nc, 3, 3)."""
    Phi: Array
    """[rad], shape (nc,)."""
    lean: Array
    """Components of x_F along x_C and y_C, shape (nc, 2)."""
    distance: Array
    """R [m], shape (nc,)."""
    levers: Array
    """What J_delta has beside ones: R cosPhi, R, sinPhi by (37), or 1, 1, 0 in surface coordinates, shape (nc, 3)."""
    J_CF_f: Array
    """As in `Observation`, shape (3 nc, n)."""
    J_CF_tau: Array
    """As in `Observation`, shape (nc, n)."""
    force_rows: Array
    """`object_force_jacobian` of an observation, shape (3 nc, 6)."""
    torsion_rows: Array
    """`object_torsion_jacobian`, shape (nc, 6)."""

    @property
    def q_O(self) -> Array:
        """Position [m], roll, pitch, yaw [rad] of the object, shape (6,)."""
        coordinates = np.concatenate([self.position, np.zeros(3)])
        set_rpy(self.rotation, coordinates[3:])
        return coordinates

    def kernel(self) -> Array:
        """K of (58), shape (3 nc, np)."""
        pairs = np.array(contact_pairs(len(self.point)), dtype=np.int64).reshape(-1, 2)
        K = np.empty((3 * len(self.point), len(pairs)))
        set_kernel(self.point, self.axes, pairs, K)
        return K


def shapes(nc: int, n: int) -> tuple[tuple[int, ...], ...]:
    """Of the arrays of an estimate."""
    return ((3,), (3, 3), (n,), (nc, 4), (nc,), (nc, 3), (nc, 3, 3), (nc,), (nc, 2), (nc,), (nc, 3), (3 * nc, n),
            (nc, n), (3 * nc, 6), (nc, 6))  # fmt: skip


def estimate_in(numbers: Array, nc: int, n: int) -> Estimate:
    """The estimate as views of so many numbers, of a memory for instance."""
    views, end = [], 0
    for shape in shapes(nc, n):
        views.append(numbers[end : end + prod(shape)].reshape(shape))
        end += prod(shape)
    return Estimate(*views)


def room_for_estimate(nc: int, n: int) -> tuple[Array, Estimate]:
    """Numbers, and the estimate in them."""
    numbers = np.zeros(sum(map(prod, shapes(nc, n))))
    return numbers, estimate_in(numbers, nc, n)


@compiled
def set_kernel(point, axes, pairs, K):
    """K of (58) from contact points and frames, shape (3 nc, np)."""
    line = np.empty(3)
    K[:] = 0.0
    for pair in range(pairs.shape[0]):
        i, j = pairs[pair, 0], pairs[pair, 1]
        square = 0.0
        for k in range(3):
            line[k] = point[j, k] - point[i, k]
            square += line[k] * line[k]
        for a in range(3):
            for b in range(3):
                K[3 * i + b, pair] += axes[i, a, b] * line[a] / np.sqrt(square)
                K[3 * j + b, pair] -= axes[j, a, b] * line[a] / np.sqrt(square)
