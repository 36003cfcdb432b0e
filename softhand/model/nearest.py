"""In a kernel: of all angles that put a redundant finger at a point, those nearest to a wish."""

from __future__ import annotations

import math

import numpy as np

from softhand.model.chain import ITERATIONS, LONGEST, POINT, place_tip
from softhand.numerics.compiled import compiled
from softhand.numerics.shortest import shortest

_RETURN = 5  # steps back to a root, after one along the roots
_MARGIN = 1e-3  # of the range, so that a last correction stays within the bounds


@compiled
def draw_near(chain, target, angles, wish, limits, tolerance):
    """`roots.nearest_root` for the joints of a finger: along the roots towards the wish.

    Args:
        chain: of the finger, with more than three joints that move it alone.
        target: in the world [m], shape (3,).
        angles: of all joints, with the tip at the target [rad or m], shape (n,); those of the finger are set.
        wish: where they would best be, shape (n,).
        limits: lower and upper limit of each joint, shape (2, n).
        tolerance: of the distance [m].

    Returns:
        False, with nothing set, where the limits leave fewer than three joints.
    """
    own = np.empty(chain.kinds.shape[0], np.int64)
    n = 0
    for k in range(own.shape[0]):
        if chain.kinds[k, 2]:
            own[n] = chain.kinds[k, 1]
            n += 1
    point, trial, size, bounds = np.empty_like(angles), np.empty_like(angles), np.empty(n), np.empty((2, n))
    tip, axes, J, step = np.empty(3), np.empty((3, 3)), np.empty((3, own.shape[0])), np.empty(n)
    for k in range(angles.shape[0]):
        point[k] = trial[k] = angles[k]
    for k in range(n):
        lower, upper = limits[0, own[k]], limits[1, own[k]]
        size[k] = upper - lower if math.isfinite(upper - lower) else 2.0 * math.pi
        bounds[0, k], bounds[1, k] = lower + _MARGIN * size[k], upper - _MARGIN * size[k]
    share = 1.0
    for _ in range(ITERATIONS):
        longest = 0.0
        for turn in range(1 + _RETURN):  # one step towards the wish, the others back
            start, aim = (point, wish) if turn == 0 else (trial, trial)
            place_tip(chain, start, tip, axes, J)
            if not _step(tip, target, J, own[:n], start, aim, size, bounds, step):
                return False
            if turn == 0:
                for k in range(n):
                    longest = max(longest, abs(step[k]))
                for k in range(n):
                    trial[own[k]] = point[own[k]] + step[k] * min(share, LONGEST / max(longest, 1e-300))
            else:
                for k in range(n):
                    trial[own[k]] = min(max(trial[own[k]] + step[k], bounds[0, k]), bounds[1, k])
        place_tip(chain, trial, tip, axes, J)
        gap = math.sqrt((tip[0] - target[0]) ** 2 + (tip[1] - target[1]) ** 2 + (tip[2] - target[2]) ** 2)
        nearer = 0.0
        for k in range(n):
            i = own[k]
            nearer += ((point[i] - wish[i]) / size[k]) ** 2 - ((trial[i] - wish[i]) / size[k]) ** 2
        if gap <= tolerance and nearer > 0.0:
            for k in range(n):
                point[own[k]] = trial[own[k]]
        elif longest < 1e-9 or share < 1e-3:
            break
        else:
            share *= 0.5
    for k in range(n):
        angles[own[k]] = point[own[k]]
    return True


@compiled
def _step(tip, target, J, own, point, aim, size, bounds, step):
    """To the nearest point to the aim that solves the linearised equations; what would leave its bounds stays there."""
    n = own.shape[0]
    A, rest, x = np.empty((3, n)), np.empty(3), np.empty(n)
    held = np.zeros(n, np.bool_)
    n_free = n
    for k in range(n):
        step[k] = 0.0
    while True:
        for i in range(3):
            rest[i] = target[i] - tip[i]
        m = 0
        for k in range(n):
            pull = (aim[own[k]] - point[own[k]]) / size[k]
            for i in range(3):
                rest[i] -= J[i, k] * (step[k] if held[k] else size[k] * pull)
                if not held[k]:
                    A[i, m] = J[i, k] * size[k]
            m += 0 if held[k] else 1
        if m < POINT:
            return False
        shortest(A, rest, m, x)
        m = 0
        for k in range(n):
            if held[k]:
                continue
            step[k] = aim[own[k]] - point[own[k]] + size[k] * x[m]
            m += 1
        for k in range(n):
            place = point[own[k]] + step[k]
            if not held[k] and not bounds[0, k] <= place <= bounds[1, k]:
                step[k] = min(max(place, bounds[0, k]), bounds[1, k]) - point[own[k]]
                held[k] = True
                n_free -= 1
        if m == n_free:
            break
    return True
