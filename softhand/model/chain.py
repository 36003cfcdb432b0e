"""The joints that carry a fingertip, as plain numbers, and in kernels where they put it and how they reach a point."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.linear import least_norm

TURNS, SLIDES = 0, 1
"""Kinds of joints."""

ITERATIONS, LONGEST = 40, 0.5
"""Of Newton's iteration: how many, and the longest step in one coordinate."""

_RETURN = 5  # steps back to a root, after one along the roots
_MARGIN = 1e-3  # of the range, so that a last correction stays within the bounds
_POINT = 3  # coordinates of a point


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
def reach(chain, target, angles, wish, is_wished, limits, tolerance):
    """Angles of one finger that put its tip at a point: Newton with shortest steps from `angles`, then to the wish.

    Args:
        chain: of the finger.
        target: in the world [m], shape (3,).
        angles: of all joints [rad or m]; those of the finger are set if the point is reached, shape (n,).
        wish: where they would best be; see `nearest_root`, shape (n,).
        is_wished: whether there is a wish.
        limits: lower and upper limit of each joint, shape (2, n).
        tolerance: of the distance [m].

    Returns:
        The distance that is left [m], infinite if the point is not reached within the limits.
    """
    own = np.empty(chain.kinds.shape[0], np.int64)
    n = 0
    for k in range(chain.kinds.shape[0]):
        if chain.kinds[k, 2]:
            own[n] = chain.kinds[k, 1]
            n += 1
    trial, tip, axes = np.empty(angles.shape[0]), np.empty(3), np.empty((3, 3))
    J, step, value = np.empty((3, n)), np.empty(n), np.empty(3)
    for k in range(angles.shape[0]):
        trial[k] = angles[k]
    left = math.inf
    for _ in range(ITERATIONS):
        gap = _miss(chain, trial, target, tip, axes, value, J)
        if not math.isfinite(gap) or (gap >= left and gap < 1e-12):
            break
        left = gap
        least_norm(J, False, value, step)
        longest = 0.0
        for k in range(n):
            longest = max(longest, abs(step[k]))
        if not longest >= 1e-16:
            break
        for k in range(n):
            trial[own[k]] -= step[k] * min(1.0, LONGEST / longest)
    gap = _miss(chain, trial, target, tip, axes, value, J)
    if not (gap <= tolerance and _is_within(trial, own[:n], limits)):
        return math.inf
    if is_wished and n > _POINT:
        gap = _draw_near(chain, trial, target, tip, axes, value, J, own[:n], wish, limits, tolerance)
    for k in range(n):
        angles[own[k]] = trial[own[k]]
    return gap


@compiled
def _is_within(angles, own, limits):
    within = True
    for k in own:
        within &= limits[0, k] <= angles[k] <= limits[1, k]
    return within


@compiled
def _miss(chain, angles, target, tip, axes, value, J):
    """value = tip - target and J, its derivatives by the joints of the finger; returns the distance [m]."""
    place_tip(chain, angles, tip, axes, J)
    for k in range(3):
        value[k] = tip[k] - target[k]
    return math.sqrt(value[0] * value[0] + value[1] * value[1] + value[2] * value[2])


@compiled
def place_tip(chain, angles, tip, axes, J):
    """Where the joints put a fingertip.

    Args:
        chain: of the finger.
        angles: of all joints [rad or m], shape (n,).
        tip: origin of F in the world, set [m], shape (3,).
        axes: of F in the world, set, shape (3, 3).
        J: velocity of the origin from the joints that move this tip alone, set, shape (3, own).
    """
    n = chain.kinds.shape[0]
    R, p, turned = np.empty((3, 3)), np.empty(3), np.empty((3, 3))
    lines = np.empty((n, 6))  # axis of each joint, and a point on it
    for i in range(3):
        p[i] = 0.0
        for j in range(3):
            R[i, j] = 1.0 if i == j else 0.0
    for k in range(n):
        _follow(R, p, chain.places[k], turned)
        axis, angle = chain.axes[k], angles[chain.kinds[k, 1]]
        for i in range(3):
            lines[k, i] = R[i, 0] * axis[0] + R[i, 1] * axis[1] + R[i, 2] * axis[2]
            if chain.kinds[k, 0] == SLIDES:
                p[i] += angle * lines[k, i]
            lines[k, 3 + i] = p[i]
        if chain.kinds[k, 0] == TURNS:
            _turn(R, lines[k], angle)
    _follow(R, p, chain.tip, turned)
    m = 0
    for i in range(3):
        tip[i] = p[i]
        for j in range(3):
            axes[i, j] = R[i, j]
    for k in range(n):
        if chain.kinds[k, 2]:
            a, b, c = lines[k, 0], lines[k, 1], lines[k, 2]
            if chain.kinds[k, 0] == TURNS:
                x, y, z = tip[0] - lines[k, 3], tip[1] - lines[k, 4], tip[2] - lines[k, 5]
                a, b, c = b * z - c * y, c * x - a * z, a * y - b * x
            J[0, m], J[1, m], J[2, m] = a, b, c
            m += 1


@compiled
def _follow(R, p, place, scratch):
    """R, p = those of a frame that has its place in the one before."""
    for i in range(3):
        p[i] += R[i, 0] * place[9] + R[i, 1] * place[10] + R[i, 2] * place[11]
        for j in range(3):
            scratch[i, j] = R[i, 0] * place[j] + R[i, 1] * place[3 + j] + R[i, 2] * place[6 + j]
    for i in range(3):
        for j in range(3):
            R[i, j] = scratch[i, j]


@compiled
def _turn(R, axis, angle):
    """R turned about a unit vector of the world."""
    c, s = math.cos(angle), math.sin(angle)
    for j in range(3):
        x, y, z = R[0, j], R[1, j], R[2, j]
        along = (1.0 - c) * (axis[0] * x + axis[1] * y + axis[2] * z)
        R[0, j] = c * x + s * (axis[1] * z - axis[2] * y) + along * axis[0]
        R[1, j] = c * y + s * (axis[2] * x - axis[0] * z) + along * axis[1]
        R[2, j] = c * z + s * (axis[0] * y - axis[1] * x) + along * axis[2]


@compiled
def _draw_near(chain, trial, target, tip, axes, value, J, own, wish, limits, tolerance):
    """`roots.nearest_root` for the joints of a finger: along the roots towards the wish; `trial` is set."""
    n = own.shape[0]
    point, size, bounds = np.empty(trial.shape[0]), np.empty(n), np.empty((2, n))
    step, held = np.empty(n), np.empty(n, np.bool_)
    for k in range(trial.shape[0]):
        point[k] = trial[k]
    for k in range(n):
        lower, upper = limits[0, own[k]], limits[1, own[k]]
        size[k] = upper - lower if math.isfinite(upper - lower) else 2.0 * math.pi
        bounds[0, k], bounds[1, k] = lower + _MARGIN * size[k], upper - _MARGIN * size[k]
    share = 1.0
    for _ in range(ITERATIONS):
        _miss(chain, point, target, tip, axes, value, J)
        _step(value, J, own, point, wish, size, bounds, held, step)
        longest = 0.0
        for k in range(n):
            longest = max(longest, abs(step[k]))
        for k in range(n):
            trial[own[k]] = point[own[k]] + step[k] * min(share, LONGEST / max(longest, 1e-300))
        for _ in range(_RETURN):
            _miss(chain, trial, target, tip, axes, value, J)
            _step(value, J, own, trial, trial, size, bounds, held, step)
            for k in range(n):
                trial[own[k]] = min(max(trial[own[k]] + step[k], bounds[0, k]), bounds[1, k])
        gap = _miss(chain, trial, target, tip, axes, value, J)
        if gap <= tolerance and _distance(trial, wish, own, size) < _distance(point, wish, own, size):
            for k in range(n):
                point[own[k]] = trial[own[k]]
        elif longest < 1e-9 or share < 1e-3:
            break
        else:
            share *= 0.5
    for k in range(n):
        trial[own[k]] = point[own[k]]
    return _miss(chain, trial, target, tip, axes, value, J)


@compiled
def _distance(angles, wish, own, size):
    total = 0.0
    for k in range(own.shape[0]):
        total += ((angles[own[k]] - wish[own[k]]) / size[k]) ** 2
    return math.sqrt(total)


@compiled
def _step(value, J, own, point, aim, size, bounds, held, step):
    """`roots._step`: to the nearest point to the aim that solves the linearised equations, within the bounds."""
    n = own.shape[0]
    for k in range(n):
        held[k], step[k] = False, 0.0
    n_free = n
    while n_free > 0:
        A, pull, rest, x = np.empty((3, n_free)), np.empty(n_free), np.empty(3), np.empty(n_free)
        for i in range(3):
            rest[i] = -value[i]
        m = 0
        for k in range(n):
            if held[k]:
                for i in range(3):
                    rest[i] -= J[i, k] * step[k]
                continue
            pull[m] = (aim[own[k]] - point[own[k]]) / size[k]
            for i in range(3):
                A[i, m] = J[i, k] * size[k]
                rest[i] -= A[i, m] * pull[m]
            m += 1
        least_norm(A, False, rest, x)
        m, beyond = 0, 0
        for k in range(n):
            if held[k]:
                continue
            step[k] = size[k] * (pull[m] + x[m])
            m += 1
        for k in range(n):
            place = point[own[k]] + step[k]
            if not held[k] and not bounds[0, k] <= place <= bounds[1, k]:
                step[k] = min(max(place, bounds[0, k]), bounds[1, k]) - point[own[k]]
                held[k] = True
                beyond += 1
        if beyond == 0:
            break
        n_free -= beyond
