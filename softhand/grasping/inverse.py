"""Joint angles that bring a tip to a place, or as near to it as there is, compiled for many places at once."""

from __future__ import annotations

import math

import numpy as np

from softhand.grasping.chains import place_tip, work_rows
from softhand.numerics.compiled import compiled

_ITERATIONS = 30
_MOST_STEPS = 60  # of `approach`
_REACHED = 1e-10  # [m]
_LONGEST = 0.3  # [rad, m] longest step of a joint
_STRETCHED = 1e-9  # e over the trace of J J^T, for a stretched finger or one in a plane
_STUCK = 4.0  # growth of what is missed in its square by which a finger is known not to come


@compiled
def reach(links, target, angles, rotation):
    """Newton's iteration with steps of least norm, from `angles`, without regard to joint limits.

        step = J^T (J J^T + e I)^-1 miss

    with a very small e, for fingers that cannot move in all directions: they reach what lies in theirs.

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
    step, work = np.empty(joints), np.empty((work_rows(joints), 3))
    left = math.inf
    for _ in range(_ITERATIONS):
        place_tip(links, angles, rotation, position, jacobian, work)
        before, left = left, _missing(target, position, miss)
        if math.sqrt(left) <= _REACHED:
            return True
        if left > _STUCK * before:
            return False
        spread = _gram(jacobian, gram)
        for i in range(3):
            gram[i, i] += _STRETCHED * spread
        _solve3(gram, miss)
        share = _step(jacobian, miss, step)
        for k in range(joints):
            angles[k] += share * step[k]
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
    step, work = np.empty(joints), np.empty((work_rows(joints), 3))
    left = math.inf
    for _ in range(_MOST_STEPS):
        place_tip(links, angles, rotation, position, jacobian, work)
        before, left = left, _missing(target, position, miss)
        if math.sqrt(left) <= _REACHED or abs(before - left) <= 1e-12 * left:
            break
        spread = _gram(jacobian, gram)
        for i in range(3):
            gram[i, i] += left + 1e-8 * spread
        _solve3(gram, miss)
        share = _step(jacobian, miss, step)
        for k in range(joints):
            angles[k] = min(max(angles[k] + share * step[k], lower[k]), upper[k])
    return math.sqrt(left)


@compiled
def _missing(target, position, miss):
    """miss = target - position; returns its square."""
    left = 0.0
    for i in range(3):
        miss[i] = target[i] - position[i]
        left += miss[i] * miss[i]
    return left


@compiled
def _gram(jacobian, gram):
    """gram = J J^T; returns its trace."""
    spread = 0.0
    for i in range(3):
        for j in range(3):
            gram[i, j] = 0.0
            for k in range(jacobian.shape[1]):
                gram[i, j] += jacobian[i, k] * jacobian[j, k]
        spread += gram[i, i]
    return spread


@compiled
def _step(jacobian, way, step):
    """step = J^T way; returns the share of it that no joint finds too long."""
    longest = 0.0
    for k in range(step.shape[0]):
        step[k] = jacobian[0, k] * way[0] + jacobian[1, k] * way[1] + jacobian[2, k] * way[2]
        longest = max(longest, abs(step[k]))
    return min(1.0, _LONGEST / longest) if longest > 0.0 else 1.0


@compiled
def _solve3(A, b):
    """b = A^-1 b for a symmetric positive definite A, shape (3, 3). A is lost."""
    for k in range(3):
        for i in range(k + 1, 3):
            factor = A[i, k] / A[k, k]
            for j in range(k, 3):
                A[i, j] -= factor * A[k, j]
            b[i] -= factor * b[k]
    for i in range(2, -1, -1):
        for j in range(i + 1, 3):
            b[i] -= A[i, j] * b[j]
        b[i] /= A[i, i]
