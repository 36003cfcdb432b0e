"""Rotations, cross products and Jacobians in space."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softhand.numerics.arrays import Array


def rotation_of(rpy: ArrayLike) -> NDArray[np.float64]:
    """R = R_z(yaw) R_y(pitch) R_x(roll) from (roll, pitch, yaw) [rad], shape (3, 3); (3, 3, n) from shape (3, n)."""
    (a, b, c), (i, j, k) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [c * b, c * j * i - k * a, c * j * a + k * i],
            [k * b, k * j * i + c * a, k * j * a - c * i],
            [-j, b * i, b * a],
        ]
    )


def turning_of(rpy: ArrayLike) -> NDArray[np.float64]:
    """T with angular velocity = T rpy', world axes, from (roll, pitch, yaw) [rad], shape (3, 3)."""
    (_, cos_pitch, cos_yaw), (_, sin_pitch, sin_yaw) = np.cos(rpy), np.sin(rpy)
    return np.array([[cos_yaw * cos_pitch, -sin_yaw, 0.0], [sin_yaw * cos_pitch, cos_yaw, 0.0], [-sin_pitch, 0.0, 1.0]])


_LEVI_CIVITA = np.zeros((3, 3, 3))
for _a, _b, _c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _LEVI_CIVITA[_b, _a, _c], _LEVI_CIVITA[_c, _a, _b] = 1.0, -1.0


def cross_matrix(v: NDArray[np.float64]) -> NDArray[np.float64]:
    """[v]x with [v]x w = v x w, shape (..., 3, 3) from (..., 3); a tenth of the time of `np.cross`."""
    matrix: NDArray[np.float64] = (v @ _LEVI_CIVITA.reshape(3, 9)).reshape(*v.shape, 3)
    return matrix


def upright(gravity: ArrayLike) -> NDArray[np.float64]:
    """The shortest turn that brings gravity to -z, about x if it points along z; the identity without gravity."""
    strength = float(np.linalg.norm(np.asarray(gravity, dtype=float)))
    if strength == 0.0:
        return np.eye(3)
    up = -np.asarray(gravity, dtype=float) / strength
    if up[2] < -1.0 + 1e-9:
        return np.diag([1.0, -1.0, -1.0])
    w = cross_matrix(np.array([up[1], -up[0], 0.0]))  # up x z
    turn: NDArray[np.float64] = np.eye(3) + w + w @ w / (1.0 + up[2])
    return turn


def carried(velocity: Array, spin: Array, arm: Array) -> Array:
    """Jacobians of points at an arm from where `velocity` holds, v + w x arm, shape (nc, 3, n).

    Args:
        velocity: Jacobians of the velocity, shape (nc, 3, n).
        spin: Jacobians of the angular velocity, shape (nc, 3, n).
        arm: [m], shape (nc, 3).
    """
    return velocity - cross_matrix(arm) @ spin
