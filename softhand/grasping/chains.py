"""Fingers as chains of joints, and their joint angles for many tip positions at once, compiled."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled

LINK = np.dtype(
    [
        ("rotation", np.float64, (3, 3)),  # of the joint frame at zero, in the frame before it
        ("position", np.float64, 3),  # of the joint frame in the frame before it [m]
        ("axis", np.float64, 3),  # of the joint, in its frame
        ("slides", np.bool_),  # whether it is prismatic
    ]
)
"""One joint of a chain."""

_ITERATIONS = 30
_MOST_STEPS = 60  # of `approach`
_REACHED = 1e-10  # [m]
_LONGEST = 0.3  # [rad, m] longest Newton step of a joint
_STRETCHED = 1e-9  # pivots below this share of the largest count as zero: a stretched finger


def finger_chain(world: World, index: int, angles: Array) -> tuple[NDArray[np.void], list[int]]:
    """The joints that only one finger has, and where they are in v; shared joints are frozen at `angles`.

    Args:
        world: hand and object.
        index: of the tip.
        angles: of all joints [rad or m], shape (n,).

    Returns:
        One row of `LINK` a joint, the last one for the finger frame F (axis 0), and the velocity indices.
    """
    tip, model = world.tips[index], world.model
    shared = {column for k, other in enumerate(world.tips) if k != index for column in other.columns}
    q = pin.neutral(model)
    world.set_joint_position(angles, q)
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    columns, rows = [], []
    placement = pin.SE3.Identity()
    for joint in list(model.supports[tip.joint])[1:]:
        column = model.joints[joint].idx_v
        if column in shared:
            placement = data.oMi[joint]
            continue
        placement = placement * model.jointPlacements[joint]
        axis = np.asarray(data.joints[joint].S).ravel()  # linear, angular
        slides = bool(np.linalg.norm(axis[3:]) < 0.5)
        rows.append((placement.rotation, placement.translation, axis[:3] if slides else axis[3:], slides))
        columns.append(column)
        placement = pin.SE3.Identity()
    end = placement * pin.SE3(tip.rotation, tip.position)
    rows.append((end.rotation, end.translation, np.zeros(3), False))
    return np.array(rows, dtype=LINK), columns


@compiled
def place_tip(links, angles, rotation, position, jacobian):
    """Pose of a finger frame F and the Jacobian of its origin.

    Args:
        links: rows of `LINK`, the last for F itself.
        angles: [rad or m], shape (joints,).
        rotation: axes of F in the world, set, shape (3, 3).
        position: origin of F in the world [m], set, shape (3,).
        jacobian: velocity of the origin of F from the rates of the joints, set, shape (3, joints).
    """
    joints = angles.shape[0]
    axes, origins = np.empty((joints, 3)), np.empty((joints, 3))
    turned, before = np.empty((3, 3)), np.empty((3, 3))
    for i in range(3):
        position[i] = 0.0
        for j in range(3):
            rotation[i, j] = 1.0 if i == j else 0.0
    for k in range(joints + 1):
        link = links[k]
        for i in range(3):
            for j in range(3):
                position[i] += rotation[i, j] * link.position[j]
        for i in range(3):
            for j in range(3):
                before[i, j] = 0.0
                for m in range(3):
                    before[i, j] += rotation[i, m] * link.rotation[m, j]
        if k == joints:
            rotation[:] = before
            break
        x, y, z = link.axis[0], link.axis[1], link.axis[2]
        for i in range(3):
            axes[k, i] = before[i, 0] * x + before[i, 1] * y + before[i, 2] * z
            origins[k, i] = position[i]
        if link.slides:
            for i in range(3):
                position[i] += axes[k, i] * angles[k]
            rotation[:] = before
            continue
        c, s = math.cos(angles[k]), math.sin(angles[k])
        d = 1.0 - c
        turned[0, 0], turned[0, 1], turned[0, 2] = c + d * x * x, d * x * y - s * z, d * x * z + s * y
        turned[1, 0], turned[1, 1], turned[1, 2] = d * x * y + s * z, c + d * y * y, d * y * z - s * x
        turned[2, 0], turned[2, 1], turned[2, 2] = d * x * z - s * y, d * y * z + s * x, c + d * z * z
        for i in range(3):
            for j in range(3):
                rotation[i, j] = before[i, 0] * turned[0, j] + before[i, 1] * turned[1, j] + before[i, 2] * turned[2, j]
    for k in range(joints):
        if links[k].slides:
            for i in range(3):
                jacobian[i, k] = axes[k, i]
        else:
            ax, ay, az = position[0] - origins[k, 0], position[1] - origins[k, 1], position[2] - origins[k, 2]
            jacobian[0, k] = axes[k, 1] * az - axes[k, 2] * ay
            jacobian[1, k] = axes[k, 2] * ax - axes[k, 0] * az
            jacobian[2, k] = axes[k, 0] * ay - axes[k, 1] * ax


@compiled
def reach(links, target, angles, rotation):
    """Newton's iteration with steps of least norm, from `angles`, without regard to joint limits.

    Args:
        links: as in `place_tip`.
        target: of the origin of F [m], shape (3,).
        angles: start on entry, result on return [rad or m], shape (joints,).
        rotation: axes of F at the result, set, shape (3, 3).

    Returns:
        Whether the target was reached.
    """
    joints = angles.shape[0]
    position, jacobian, gram, miss = np.empty(3), np.empty((3, joints)), np.empty((3, 3)), np.empty(3)
    for _ in range(_ITERATIONS):
        place_tip(links, angles, rotation, position, jacobian)
        left = 0.0
        for i in range(3):
            miss[i] = target[i] - position[i]
            left += miss[i] * miss[i]
        if math.sqrt(left) <= _REACHED:
            return True
        for i in range(3):
            for j in range(3):
                gram[i, j] = 0.0
                for k in range(joints):
                    gram[i, j] += jacobian[i, k] * jacobian[j, k]
        if not _solve3(gram, miss):
            return False
        longest = 0.0
        for k in range(joints):
            step = jacobian[0, k] * miss[0] + jacobian[1, k] * miss[1] + jacobian[2, k] * miss[2]
            longest = max(longest, abs(step))
        share = min(1.0, _LONGEST / longest) if longest > 0.0 else 1.0
        for k in range(joints):
            angles[k] += share * (jacobian[0, k] * miss[0] + jacobian[1, k] * miss[1] + jacobian[2, k] * miss[2])
    return False


@compiled
def approach(links, target, angles, lower, upper, rotation):
    """As near to a target as the joint limits allow: steps of least squares, damped by what is missed.

        step = J^T (J J^T + |miss|^2 I)^-1 miss

    Unlike `reach` it stays within the limits and takes fingers that cannot move in all directions.

    Args:
        links: as in `place_tip`.
        target: of the origin of F [m], shape (3,).
        angles: start on entry, result on return [rad or m], shape (joints,).
        lower: limits of the joints, may be infinite, shape (joints,).
        upper: likewise.
        rotation: axes of F at the result, set, shape (3, 3).

    Returns:
        The distance that is left [m].
    """
    joints = angles.shape[0]
    position, jacobian, gram, miss = np.empty(3), np.empty((3, joints)), np.empty((3, 3)), np.empty(3)
    left = math.inf
    for _ in range(_MOST_STEPS):
        place_tip(links, angles, rotation, position, jacobian)
        before, left = left, 0.0
        for i in range(3):
            miss[i] = target[i] - position[i]
            left += miss[i] * miss[i]
        if math.sqrt(left) <= _REACHED or abs(before - left) <= 1e-12 * left:
            break
        spread = 0.0
        for i in range(3):
            for j in range(3):
                gram[i, j] = 0.0
                for k in range(joints):
                    gram[i, j] += jacobian[i, k] * jacobian[j, k]
            spread += gram[i, i]
        for i in range(3):
            gram[i, i] += left + 1e-8 * spread
        _solve3(gram, miss)
        longest = 0.0
        for k in range(joints):
            step = jacobian[0, k] * miss[0] + jacobian[1, k] * miss[1] + jacobian[2, k] * miss[2]
            longest = max(longest, abs(step))
        share = min(1.0, _LONGEST / longest) if longest > 0.0 else 1.0
        for k in range(joints):
            step = jacobian[0, k] * miss[0] + jacobian[1, k] * miss[1] + jacobian[2, k] * miss[2]
            angles[k] = min(max(angles[k] + share * step, lower[k]), upper[k])
    return math.sqrt(left)


@compiled
def _solve3(A, b):
    """b = A^-1 b for a symmetric positive definite A, shape (3, 3); False if it is singular. A is lost."""
    largest = max(A[0, 0], A[1, 1], A[2, 2])
    for k in range(3):
        if not A[k, k] > _STRETCHED * largest:
            return False
        for i in range(k + 1, 3):
            factor = A[i, k] / A[k, k]
            for j in range(k, 3):
                A[i, j] -= factor * A[k, j]
            b[i] -= factor * b[k]
    for i in range(2, -1, -1):
        for j in range(i + 1, 3):
            b[i] -= A[i, j] * b[j]
        b[i] /= A[i, i]
    return True
