"""Roots of a few smooth equations within bounds: Newton, and from other starts a trust region if that fails."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np

from softhand.numerics.arrays import Array

_ITERATIONS = 40
_LONGEST = 0.5  # longest Newton step
_RETURN = 5  # steps back to a root
_MARGIN = 1e-3  # of the range, so that a last correction stays within the bounds


def find_root(
    excess: Callable[[Array], Array],
    slope: Callable[[Array], Array],
    starts: Iterable[Array],
    lower: Array,
    upper: Array,
    tolerance: float,
) -> tuple[Array, float]:
    """A point within bounds at which `excess` vanishes; the shortest way from the start where there are many.

    Args:
        excess: function of a point, shape (m,).
        slope: its derivatives, shape (m, n).
        starts: points to begin from, tried in order.
        lower: shape (n,), may be infinite.
        upper: shape (n,), may be infinite.
        tolerance: length of the excess that counts as zero.

    Returns:
        The best point found, and the length of the excess there: above `tolerance` there is no root in reach. It is
        infinite where the excess is not a number at any start.
    """
    starts = list(starts)
    point = newton(excess, slope, starts[0])
    if _is_inside(point, lower, upper) and np.linalg.norm(excess(point)) <= tolerance:
        return point, float(np.linalg.norm(excess(point)))
    # Imported here, since it takes a third of the start-up time and is seldom needed.
    from scipy.optimize import least_squares

    best, least = starts[0], math.inf
    for start in starts:
        inside = np.clip(start, lower + 1e-9, upper - 1e-9)
        try:
            found = least_squares(excess, inside, slope, bounds=(lower, upper), xtol=1e-15, ftol=1e-15, gtol=1e-15).x
        except (ValueError, np.linalg.LinAlgError):  # not a number, here or on the way
            continue
        polished = newton(excess, slope, found)  # to the last digit, which the trust region leaves
        for point in (found, polished):
            left = float(np.linalg.norm(excess(point)))
            if _is_inside(point, lower, upper) and left < least:
                best, least = point, left
        if least <= tolerance:
            break
    return best, least


def nearest_root(
    excess: Callable[[Array], Array],
    slope: Callable[[Array], Array],
    root: Array,
    wish: Array,
    lower: Array,
    upper: Array,
    tolerance: float,
) -> Array:
    """From one root within bounds to the one near it that is nearest to a wish, where there are many.

    The least of the sum of ((x - wish) / range)^2 along the roots: steps towards the wish that keep the linearised
    equations, each followed by the shortest way back to a root, and halved where they bring nothing.

    Args:
        excess: as for `find_root`.
        slope: likewise.
        root: to begin from, shape (n,).
        wish: shape (n,).
        lower: shape (n,), may be infinite.
        upper: shape (n,), may be infinite.
        tolerance: length of the excess that counts as zero.

    Returns:
        The nearest root found, a thousandth of the range inside the bounds; `root` if there is none nearer.
    """
    size = np.where(np.isfinite(upper - lower), upper - lower, 2.0 * math.pi)
    lower, upper = lower + _MARGIN * size, upper - _MARGIN * size

    def distance(values: Array) -> float:
        return float(np.linalg.norm((values - wish) / size))

    def step_towards(point: Array, aim: Array) -> Array:
        return _step(excess(point), slope(point), point, aim, size, lower, upper)

    point, share = root, 1.0
    for _ in range(_ITERATIONS):
        step = step_towards(point, wish)
        longest = float(np.max(np.abs(step)))
        trial = point + step * min(share, _LONGEST / max(longest, 1e-300))
        for _ in range(_RETURN):
            trial = np.clip(trial + step_towards(trial, trial), lower, upper)
        if np.linalg.norm(excess(trial)) <= tolerance and distance(trial) < distance(point):
            point = trial
        elif longest < 1e-9 or share < 1e-3:
            break
        else:
            share *= 0.5
    return point


def _step(value: Array, J: Array, point: Array, aim: Array, size: Array, lower: Array, upper: Array) -> Array:
    """To the nearest point to the aim that solves the linearised equations; what would leave its bounds stays there."""
    held, step = np.zeros(len(point), dtype=bool), np.zeros(len(point))
    while not held.all():
        free = ~held
        A, pull = J[:, free] * size[free], (aim - point)[free] / size[free]
        rest = -value - J[:, held] @ step[held]
        step[free] = size[free] * (pull + np.linalg.lstsq(A, rest - A @ pull, rcond=1e-10)[0])
        beyond = free & ((point + step > upper) | (point + step < lower))
        if not beyond.any():
            break
        step[beyond] = np.clip(point + step, lower, upper)[beyond] - point[beyond]
        held |= beyond
    return step


def newton(excess: Callable[[Array], Array], slope: Callable[[Array], Array], start: Array) -> Array:
    """Newton's iteration with steps of least norm, until it gets no closer; what it does not need to move stays."""
    point, left = start.copy(), math.inf
    for _ in range(_ITERATIONS):
        value = excess(point)
        size = float(np.linalg.norm(value))
        if not math.isfinite(size) or (size >= left and size < 1e-12):
            break
        left = size
        step = np.linalg.lstsq(slope(point), value, rcond=1e-10)[0]
        longest = float(np.max(np.abs(step)))
        if longest < 1e-16:
            break
        point = point - step * min(1.0, _LONGEST / longest)
    return point


def _is_inside(point: Array, lower: Array, upper: Array) -> bool:
    return bool(np.all(np.isfinite(point)) and np.all(point >= lower) and np.all(point <= upper))
