"""Rotations as unit quaternions, for kernels."""

from __future__ import annotations

import math

from softhand.numerics.compiled import compiled


@compiled
def quaternion_of(R):
    """x, y, z, w of a rotation, from the largest of them, so that none loses digits; the sign is free.

    Args:
        R: shape (3, 3).
    """
    if R[0, 0] + R[1, 1] + R[2, 2] > 0.0:
        x, y, z = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
        w = 1.0 + R[0, 0] + R[1, 1] + R[2, 2]
    elif R[0, 0] >= R[1, 1] and R[0, 0] >= R[2, 2]:
        x, y, z = 1.0 + R[0, 0] - R[1, 1] - R[2, 2], R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]
        w = R[2, 1] - R[1, 2]
    elif R[1, 1] >= R[2, 2]:
        x, y, z = R[0, 1] + R[1, 0], 1.0 + R[1, 1] - R[0, 0] - R[2, 2], R[1, 2] + R[2, 1]
        w = R[0, 2] - R[2, 0]
    else:
        x, y, z = R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], 1.0 + R[2, 2] - R[0, 0] - R[1, 1]
        w = R[1, 0] - R[0, 1]
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return x / length, y / length, z / length, w / length


@compiled
def rotation_by(x, y, z, w, R):
    """Set R, shape (3, 3), from a quaternion of any length but 0."""
    s = 2.0 / (x * x + y * y + z * z + w * w)
    R[0, 0], R[0, 1], R[0, 2] = 1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)
    R[1, 0], R[1, 1], R[1, 2] = s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)
    R[2, 0], R[2, 1], R[2, 2] = s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)
