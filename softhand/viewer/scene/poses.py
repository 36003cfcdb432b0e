"""Poses: where things are and how they are turned, as matrices of shape (4, 4)."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of


def pose(rotation: ArrayLike, position: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """A pose from its axes as columns, which may be stretched, shape (3, 3), and its origin [m], shape (3,)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, position
    return matrix


def pose_of(position: ArrayLike, rpy: ArrayLike) -> Array:
    """A pose from position [m] and roll, pitch, yaw [rad]."""
    return pose(rotation_of(rpy), position)


def quaternion_of(rotation: Array) -> tuple[float, float, float, float]:
    """x, y, z, w of a rotation, shape (3, 3), as a unit quaternion."""
    x, y, z, w = pin.Quaternion(np.ascontiguousarray(rotation)).coeffs().tolist()
    return x, y, z, w


def along(direction: Array, position: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """A pose whose z axis has a direction."""
    return pose(axes_along(direction), position)


def stretched(axes: Array, position: Array, thickness: float, length: float) -> Array:
    """A pose that stretches a shape of radius and height one along z."""
    return pose(axes * [thickness, thickness, length], position)


def to_world(points: NDArray[np.floating], place: Array) -> Array:
    """Where points [m] of a thing at a pose are, shape (n, 3)."""
    return points @ place[:3, :3].T + place[:3, 3]


def axes_along(direction: Array) -> Array:
    """A rotation whose z axis has a direction, shape (3, 3)."""
    z = direction / np.linalg.norm(direction)
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
