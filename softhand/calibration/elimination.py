"""The linear problem of one step: states eliminated one after the other by orthogonal transformations.

As in a square-root information filter [Bierman, Factorization Methods, 1977, chapter V], so that nothing is squared.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.calibration.bench import Linear
from softhand.calibration.problem import Problem
from softhand.calibration.triangle import triangle
from softhand.calibration.weights import Weights
from softhand.numerics.arrays import Array

_LONGEST = 0.5  # of x in a step


class Eliminated(NamedTuple):
    """All pieces with their states eliminated.

    s_i = c_i - S_i x of each piece, and |R x - r|^2 is what is left for the parameters.
    """

    R: Array
    r: Array
    c: list[Array]
    S: list[Array]


def eliminate(
    problem: Problem,
    linear: Sequence[Linear],
    which: Sequence[int],
    defects: Sequence[Array],
    weights: Weights,
    damping: float = 0.0,
) -> Eliminated:
    """Eliminate the states.

    Args:
        problem: whose pieces these are.
        linear: some pieces.
        which: their numbers, rising; a state behind a gap is on its own.
        defects: by how much each state, from the second one on, is beyond the end of the piece before.
        weights: of the sum of squares.
        damping: of the states, of the square of what each does to the residuals of its piece.
    """
    s, p = problem.n_states, linear[0].by_parameters.shape[1]
    before = np.zeros((0, s + p + 1))
    kept: list[tuple[Array, bool]] = []
    for i, (one, k) in enumerate(zip(linear, which, strict=True)):
        w = weights.of_residuals(problem, k)
        rows = np.hstack([one.by_start * w[:, None], one.by_parameters * w[:, None], (one.r * w)[:, None]])
        rows = triangle(np.vstack([rows, *_damped(rows[:, :s], p, damping), before]))
        if i + 1 == len(linear) or which[i + 1] > k + 1:
            kept.append((rows[:s], False))
            rest = rows[s:, s:]
            before = np.hstack([np.zeros((len(rest), s)), rest])
            continue
        stacked = np.zeros((len(rows) + s, 2 * s + p + 1))  # s_i, s_(i+1), x, 1
        stacked[: len(rows), :s], stacked[: len(rows), 2 * s :] = rows[:, :s], rows[:, s:]
        w = 1.0 / weights.slack[i]
        # d' = d + ds_(i+1) - E ds_i - G dx
        stacked[len(rows) :, :s] = one.end_by_start * w[:, None]
        stacked[len(rows) :, s : 2 * s] = -np.diag(w)
        stacked[len(rows) :, 2 * s : 2 * s + p] = one.end_by_parameters * w[:, None]
        stacked[len(rows) :, -1] = defects[i] * w
        stacked = triangle(stacked)
        kept.append((stacked[:s], True))
        before = stacked[s : 2 * s + p + 1, s:]
    return _back(kept, rest, s, p)


def _damped(by_start: Array, p: int, damping: float) -> list[Array]:
    """Rows that hold a state where it is."""
    if damping == 0.0:
        return []
    held = np.sqrt(damping) * np.linalg.norm(by_start, axis=0)
    return [np.hstack([np.diag(held), np.zeros((len(held), p + 1))])]


def _back(kept: list[tuple[Array, bool]], rest: Array, s: int, p: int) -> Eliminated:
    """From the last state to the first: s_i = c_i - S_i x."""
    c: list[Array] = []
    S: list[Array] = []
    for top, has_next in reversed(kept):
        R, right, by_x = top[:, :s], top[:, -1], top[:, -1 - p : -1]
        if has_next:
            right, by_x = right - top[:, s : 2 * s] @ c[-1], by_x - top[:, s : 2 * s] @ S[-1]
        both = _solved(R, np.hstack([right[:, None], by_x]))
        c.append(both[:, 0])
        S.append(both[:, 1:])
    return Eliminated(rest[:, :p], rest[:, p], c[::-1], S[::-1])


def _solved(R: Array, right: Array) -> Array:
    """R^-1 right of an upper triangle; what it does not tell stays 0."""
    scale = np.linalg.norm(R, axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    return np.asarray(np.linalg.lstsq(R / scale, right, rcond=1e-13)[0] / scale[:, None])


def step_of(found: Eliminated, damping: float, x: Array, lower: Array, upper: Array, free: NDArray[np.bool_]) -> Array:
    """A damped step of those parameters that are free, within their bounds."""
    R, r = found.R, found.r
    d = np.maximum(np.linalg.norm(R, axis=0), 1e-300)
    free, dx = free.copy(), np.zeros(len(x))
    for _ in range(len(x)):
        if not free.any():
            break
        rows = np.vstack([(R / d)[:, free], np.sqrt(damping) * np.eye(int(free.sum()))])
        right = np.concatenate([r - R[:, ~free] @ dx[~free], np.zeros(int(free.sum()))])
        dx[free] = np.linalg.lstsq(rows, right, rcond=1e-14)[0] / d[free]
        longest = float(np.max(np.abs(dx[free])))
        dx[free] *= min(1.0, _LONGEST / longest) if longest > 0.0 else 1.0
        out = free & ((x + dx < lower) | (x + dx > upper))
        if not out.any():
            break
        dx[out] = np.clip(x + dx, lower, upper)[out] - x[out]
        free &= ~out
    return dx
