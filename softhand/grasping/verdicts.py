"""Whether a hand can hold its object at a pose, and what stops it, compiled for many poses at once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.grasping.inverse import reach
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled

_STEPS = 6  # from the start to a pose: the elbow stays on its side


class Verdict(IntEnum):
    """Why a pose can be held or not; the first thing that fails on the way of the first finger that fails."""

    HELD = 0
    REACH = 1
    LIMIT = 2
    RIM = 3
    APEX = 4


@dataclass(frozen=True, eq=False)
class Verdicts:
    """Answers for some poses.

    Attributes:
        verdict: a `Verdict` each, shape (poses,).
        finger: which finger fails, -1 if none, shape (poses,).
        joint: which of its own joints is at a limit, -1 if none, shape (poses,).
    """

    verdict: NDArray[np.int64]
    finger: NDArray[np.int64]
    joint: NDArray[np.int64]

    @property
    def held(self) -> NDArray[np.bool_]:
        """Whether a pose can be held, shape (poses,)."""
        return self.verdict == Verdict.HELD


class Fingers(NamedTuple):
    """The fingers of a grasp at its start, as kernels read them; nc fingers of up to m joints of their own."""

    points: Array
    """Contacts in the object frame [m], shape (nc, 3)."""
    normals: Array
    """Outward, in the object frame, shape (nc, 3)."""
    radius: Array
    """Of the tips [m], shape (nc,)."""
    links: AnyArray
    """Chains, as in `place_tip`, shape (nc, m + 1)."""
    joints: NDArray[np.int64]
    """How many of its own each finger has, shape (nc,)."""
    angles: Array
    """Of its joints at the start [rad or m], shape (nc, m)."""
    lower: Array
    """Limits, shape (nc, m)."""
    upper: Array
    """Limits, shape (nc, m)."""
    sides: Array
    """y and z of -n in the finger frame at the start: the side of the apex that the contact is on, shape (nc, 2)."""
    Phi_range: Array
    """Least and greatest contact angle [rad], shape (nc, 2)."""


@compiled
def judge_poses(poses, start, fingers, verdict, finger, joint):
    """Fill the arrays of `Verdicts`.

    Args:
        poses: q_O, shape (poses, 6).
        start: q_O of the start, shape (6,).
        fingers: `Fingers`.
        verdict: set, shape (poses,).
        finger: set where a finger fails, shape (poses,).
        joint: set where a joint is at a limit, shape (poses,).
    """
    now, axes, normal = np.empty(fingers.angles.shape[1]), np.empty((3, 3)), np.empty(3)
    for k in range(poses.shape[0]):
        for i in range(fingers.points.shape[0]):
            own = now[: fingers.joints[i]]
            is_reached = _follow(start, poses[k], fingers, i, own, axes, normal)
            outcome, which = 1, -1
            if is_reached:
                outcome, which = _examine(fingers, i, own, _latitude(axes, normal, fingers.sides[i]))
            if outcome != 0:
                verdict[k], finger[k], joint[k] = outcome, i, which
                break


@compiled
def _follow(start, end, fingers, i, own, axes, normal):
    """Finger i on its way with the object; sets its joints, the axes of F and n in the world; whether it comes along.

    p_F = p_O + R_BO (p_C + r n_O),   n = R_BO n_O                                          (13), (16) with rigid tips
    """
    pose, rotation, target = np.empty(6), np.empty((3, 3)), np.empty(3)
    for m in range(own.shape[0]):
        own[m] = fingers.angles[i, m]
    for step in range(1, _STEPS + 1):
        for m in range(6):
            pose[m] = start[m] + step / _STEPS * (end[m] - start[m])
        _rotate(pose, rotation)
        for m in range(3):
            target[m], normal[m] = pose[m], 0.0
            for n in range(3):
                normal[m] += rotation[m, n] * fingers.normals[i, n]
                target[m] += rotation[m, n] * (fingers.points[i, n] + fingers.radius[i] * fingers.normals[i, n])
        if not reach(fingers.links[i], target, own, axes):
            return False
    return True


@compiled
def _latitude(axes, normal, side):
    """Phi of the contact [rad], counted on beyond the apex where Theta is more than 90 deg from that of the start.

    -n in F: its first component is sin Phi, the others are along (cos Theta, sin Theta).
    """
    x = -(axes[0, 0] * normal[0] + axes[1, 0] * normal[1] + axes[2, 0] * normal[2])
    y = -(axes[0, 1] * normal[0] + axes[1, 1] * normal[1] + axes[2, 1] * normal[2])
    z = -(axes[0, 2] * normal[0] + axes[1, 2] * normal[1] + axes[2, 2] * normal[2])
    Phi = math.atan2(x, math.hypot(y, z))
    return math.pi - Phi if y * side[0] + z * side[1] < 0.0 else Phi


@compiled
def _examine(fingers, i, own, Phi):
    """`Verdict` of finger i where it reaches its contact, and which joint is at a limit."""
    for m in range(own.shape[0]):
        if not fingers.lower[i, m] <= own[m] <= fingers.upper[i, m]:
            return 2, m
    if Phi < fingers.Phi_range[i, 0]:
        return 3, -1
    if Phi > fingers.Phi_range[i, 1]:
        return 4, -1
    return 0, -1


@compiled
def _rotate(pose, rotation):
    """R = R_z(yaw) R_y(pitch) R_x(roll)."""
    a, b, c = math.cos(pose[3]), math.cos(pose[4]), math.cos(pose[5])
    i, j, k = math.sin(pose[3]), math.sin(pose[4]), math.sin(pose[5])
    rotation[0, 0], rotation[0, 1], rotation[0, 2] = c * b, c * j * i - k * a, c * j * a + k * i
    rotation[1, 0], rotation[1, 1], rotation[1, 2] = k * b, k * j * i + c * a, k * j * a - c * i
    rotation[2, 0], rotation[2, 1], rotation[2, 2] = -j, b * i, b * a
