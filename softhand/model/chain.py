"""The joints that carry a fingertip as plain numbers, and in kernels where they put it and how it reaches a point."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.shortest import shortest

TURNS, SLIDES = 0, 1
"""Kinds of joints."""

ITERATIONS, LONGEST = 40, 0.5
"""Of Newton's iteration: how many, and the longest step in one coordinate."""

POINT = 3
"""Coordinates of a point."""


class Chain(NamedTuple):
    """From the base to one fingertip. Nothing writes to it."""

    kinds: NDArray[np.int64]
    """Kind, velocity index, and 1 for a joint that moves this tip alone, shape (joints, 3)."""
    axes: Array
    """Of each joint, in its own frame, shape (joints, 3)."""
    places: Array
    """Of each joint frame at zero in the one before: rotation row by row, position [m], shape (joints, 12)."""
    tip: Array
    """Of F in the frame of the last joint, likewise, shape (12,)."""


def read_chain(model: pin.Model, joint: int, rotation: Array, position: Array, own: Sequence[int]) -> Chain:
    """The chain up to a joint.

    Args:
        model: of the hand.
        joint: that carries the tip.
        rotation: axes of F in the frame of that joint, shape (3, 3).
        position: its origin there [m], shape (3,).
        own: velocity indices of the joints that move this tip alone.
    """
    joints = list(model.supports[joint])[1:]
    data = model.createData()
    pin.forwardKinematics(model, data, pin.neutral(model))
    kinds, axes, places = np.zeros((len(joints), 3), np.int64), np.zeros((len(joints), 3)), np.zeros((len(joints), 12))
    for k, index in enumerate(joints):
        motion, placement = np.asarray(data.joints[index].S).ravel(), model.jointPlacements[index]  # linear, angular
        turns, column = bool(np.linalg.norm(motion[3:]) > 0.5), model.joints[index].idx_v
        kinds[k] = TURNS if turns else SLIDES, column, column in own
        axes[k] = motion[3:] if turns else motion[:3]
        places[k] = _as_row(placement.rotation, placement.translation)
    return Chain(kinds, axes, places, _as_row(rotation, position))


def _as_row(rotation: Array, position: Array) -> Array:
    return np.concatenate([np.ravel(rotation), position])


@compiled
def reach(chain, target, angles, limits, tolerance):
    """Angles of one finger that put its tip at a point, by Newton's iteration with shortest steps from `angles`.

    Args:
        chain: of the finger.
        target: in the world [m], shape (3,).
        angles: of all joints [rad or m], shape (n,); those of the finger are set, or lost.
        limits: lower and upper limit of each joint, shape (2, n).
        tolerance: of the distance [m].

    Returns:
        The distance that is left [m], infinite if the point is not reached within the limits.
    """
    n = chain.kinds.shape[0]
    tip, axes, J, gap = np.empty(3), np.empty((3, 3)), np.empty((3, n)), np.empty(3)
    step, left = np.empty(n), math.inf
    for _ in range(ITERATIONS):
        m = place_tip(chain, angles, tip, axes, J)
        for k in range(3):
            gap[k] = tip[k] - target[k]
        now = math.sqrt(gap[0] * gap[0] + gap[1] * gap[1] + gap[2] * gap[2])
        if not math.isfinite(now) or (now >= left and now < 1e-12):
            break
        left = now
        shortest(J, gap, m, step)
        longest = 0.0
        for k in range(m):
            longest = max(longest, abs(step[k]))
        if not longest >= 1e-16:
            break
        m = 0
        for k in range(n):
            if chain.kinds[k, 2]:
                angles[chain.kinds[k, 1]] -= step[m] * min(1.0, LONGEST / longest)
                m += 1
    place_tip(chain, angles, tip, axes, J)
    for k in range(n):
        column = chain.kinds[k, 1]
        if chain.kinds[k, 2] and not limits[0, column] <= angles[column] <= limits[1, column]:
            return math.inf
    x, y, z = tip[0] - target[0], tip[1] - target[1], tip[2] - target[2]
    left = math.sqrt(x * x + y * y + z * z)
    return left if left <= tolerance else math.inf


@compiled
def place_tip(chain, angles, tip, axes, J):
    """Where the joints put a fingertip.

    Args:
        chain: of the finger.
        angles: of all joints [rad or m], shape (n,).
        tip: origin of F in the world, set [m], shape (3,).
        axes: of F in the world, set, shape (3, 3).
        J: velocity of the origin from the joints that move this tip alone, in its first columns, set, shape (3, n).

    Returns:
        How many joints move this tip alone.
    """
    n = chain.kinds.shape[0]
    lines, R = np.empty((n, 6)), np.empty((3, 3))  # axis of each joint, and a point on it
    for i in range(3):
        tip[i] = 0.0
        for j in range(3):
            axes[i, j] = 1.0 if i == j else 0.0
    for k in range(n + 1):
        place = chain.places[k] if k < n else chain.tip
        for i in range(3):
            tip[i] += axes[i, 0] * place[9] + axes[i, 1] * place[10] + axes[i, 2] * place[11]
            for j in range(3):
                R[i, j] = axes[i, 0] * place[j] + axes[i, 1] * place[3 + j] + axes[i, 2] * place[6 + j]
        turned = 0.0
        if k < n:
            axis, angle = chain.axes[k], angles[chain.kinds[k, 1]]
            for i in range(3):
                lines[k, i] = R[i, 0] * axis[0] + R[i, 1] * axis[1] + R[i, 2] * axis[2]
                if chain.kinds[k, 0] == SLIDES:
                    tip[i] += angle * lines[k, i]
                lines[k, 3 + i] = tip[i]
            turned = angle if chain.kinds[k, 0] == TURNS else 0.0
        c, s = math.cos(turned), math.sin(turned)
        for j in range(3):
            x, y, z = R[0, j], R[1, j], R[2, j]
            if turned != 0.0:
                a = lines[k]
                along = (1.0 - c) * (a[0] * x + a[1] * y + a[2] * z)
                u = c * x + s * (a[1] * z - a[2] * y) + along * a[0]
                v = c * y + s * (a[2] * x - a[0] * z) + along * a[1]
                z = c * z + s * (a[0] * y - a[1] * x) + along * a[2]
                x, y = u, v
            axes[0, j], axes[1, j], axes[2, j] = x, y, z
    m = 0
    for k in range(n):
        if chain.kinds[k, 2]:
            a, b, c = lines[k, 0], lines[k, 1], lines[k, 2]
            if chain.kinds[k, 0] == TURNS:
                x, y, z = tip[0] - lines[k, 3], tip[1] - lines[k, 4], tip[2] - lines[k, 5]
                a, b, c = b * z - c * y, c * x - a * z, a * y - b * x
            J[0, m], J[1, m], J[2, m] = a, b, c
            m += 1
    return m
