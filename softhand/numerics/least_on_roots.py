"""The least of a sum of squares among the roots of some equations within bounds, by Newton's method along the roots."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from softhand.numerics.arrays import Array

_ITERATIONS, _CORRECTIONS, _HALVINGS = 60, 8, 12
_LONGEST = 0.3  # of a step, in the units of the point
_STILL = 1e-13
_CURVED = 1e-5  # step of the difference that tells how the equations bend
_AT = 1e-4  # of the range: what is so near to a bound is at it
_FLAT = 1e-3  # least curvature that a step counts on, over that of the cost


def root_within(
    excess: Callable[[Array], Array],
    slope: Callable[[Array], Array],
    starts: Iterable[Array],
    lower: Array,
    upper: Array,
    size: Array,
    tolerance: float,
) -> tuple[Array, float]:
    """A point within bounds at which `excess` vanishes, from the first of some starts that leads to one.

    Args:
        excess: function of a point, shape (m,).
        slope: its derivatives, shape (m, n).
        starts: points to begin from.
        lower: shape (n,).
        upper: shape (n,).
        size: by which ways are measured: the larger, the more rather this coordinate moves, shape (n,).
        tolerance: length of the excess that counts as zero.

    Returns:
        The best point found, and the length of the excess there.
    """
    best, least = np.zeros(len(lower)), np.inf
    for start in starts:
        point = _corrected(excess, slope, np.clip(start, lower, upper), lower, upper, size, tolerance, _ITERATIONS)
        left = float(np.linalg.norm(excess(point)))
        if left < least:
            best, least = point, left
        if least <= tolerance:
            break
    return best, least


def least_on_roots(
    excess: Callable[[Array], Array],
    slope: Callable[[Array], Array],
    root: Array,
    wish: Array,
    lower: Array,
    upper: Array,
    size: Array,
    tolerance: float,
) -> Array:
    """The root that minimises the sum of ((x - wish) / size)^2, downhill from a root.

    Newton's method along the surface of the roots, with its curvature: with the multipliers l and a basis Z of the
    directions that keep the equations,

        Z^T (1 + sum l_i excess_i'') Z y = -Z^T (x - wish)    in units of size

    each step followed by a return to the roots, and halved until it leads downhill.

    Args:
        excess: as for `root_within`.
        slope: likewise.
        root: within the bounds, shape (n,).
        wish: shape (n,).
        lower: likewise.
        upper: likewise.
        size: of each coordinate, shape (n,).
        tolerance: likewise.
    """
    point = root

    def cost(values: Array) -> float:
        return 0.5 * float(np.sum(((values - wish) / size) ** 2))

    for _ in range(_ITERATIONS):
        step = _downhill(slope, point, wish, lower, upper, size)
        share = min(1.0, _LONGEST / max(float(np.max(np.abs(step))), 1e-300))
        for _ in range(_HALVINGS):
            trial = np.clip(point + share * step, lower, upper)
            trial = _corrected(excess, slope, trial, lower, upper, size, 0.0, _CORRECTIONS)
            is_root = np.linalg.norm(excess(trial)) <= tolerance
            if is_root and cost(trial) <= cost(point) * (1.0 + 1e-12):
                break
            share *= 0.5
        else:
            return point
        moved, point = float(np.max(np.abs((trial - point) / size))), trial
        if moved < _STILL:
            break
    return point


def _downhill(
    slope: Callable[[Array], Array], point: Array, wish: Array, lower: Array, upper: Array, size: Array
) -> Array:
    """Newton's step on the tangent of the surface; what would leave its bounds stays."""
    J, pull, near = slope(point) * size, (point - wish) / size, _AT * (upper - lower)
    free = np.ones(len(point), bool)
    for _ in range(len(point)):
        U, s, Vt = np.linalg.svd(J[:, free])
        rank = int(np.count_nonzero(s > 1e-10 * s.max(initial=0.0)))
        Z, multipliers = Vt[rank:].T, -U[:, :rank] @ ((Vt[:rank] @ pull[free]) / s[:rank])
        bent = np.zeros((len(point), Z.shape[1]))
        for k, way in enumerate(Z.T):
            ahead = np.zeros(len(point))
            ahead[free] = _CURVED * way * size[free]
            ahead /= max(1.0, float(np.max(np.abs(ahead))) / _CURVED)
            length = float(np.max(np.abs(ahead[free] / size[free]))) / max(float(np.max(np.abs(way))), 1e-300)
            bent[:, k] = size * ((slope(point + ahead) - slope(point - ahead)).T @ multipliers) / (2.0 * length)
        curvature = np.eye(Z.shape[1]) + Z.T @ bent[free]
        values, ways = np.linalg.eigh(0.5 * (curvature + curvature.T))
        along = -(ways.T @ (Z.T @ pull[free])) / np.maximum(np.abs(values), _FLAT)
        step = np.zeros(len(point))
        step[free] = size[free] * (Z @ (ways @ along))
        out = free & ((point <= lower + near) & (step < 0.0) | (point >= upper - near) & (step > 0.0))
        if not out.any():
            break
        free &= ~out
    return step


def _corrected(
    excess: Callable[[Array], Array], slope: Callable[[Array], Array], point: Array, lower: Array, upper: Array,
    size: Array, tolerance: float, most: int,
) -> Array:  # fmt: skip
    """Newton's steps to a root, each the shortest within the bounds; until it gets no closer."""
    left, best = np.inf, point
    for _ in range(most):
        value = excess(point)
        now = float(np.linalg.norm(value))
        if now < left:
            best = point
        if now <= tolerance or (now >= left and now < 1e-12):
            break
        left, J, free = min(left, now), slope(point) * size, np.ones(len(point), bool)
        step = np.zeros(len(point))
        for _ in range(len(point)):
            step[:] = 0.0
            step[free] = -size[free] * np.linalg.lstsq(J[:, free], value, rcond=1e-10)[0]
            out = free & ((point <= lower) & (step < 0.0) | (point >= upper) & (step > 0.0))
            if not out.any():
                break
            free &= ~out
        share = min(1.0, _LONGEST / max(float(np.max(np.abs(step))), 1e-300))
        point = np.clip(point + share * step, lower, upper)
    return best
