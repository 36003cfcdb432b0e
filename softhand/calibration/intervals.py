"""What a fit leaves unknown: covariance of the parameters, whether residuals are noise, intervals for either case."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from softhand.calibration.bench import Linear
from softhand.calibration.elimination import Eliminated, eliminate, step_of
from softhand.calibration.problem import Problem
from softhand.calibration.search import bounds_of, defects_of
from softhand.calibration.solving import Solution
from softhand.calibration.weights import Weights, slack_of
from softhand.numerics.arrays import Array

_CLUSTER = 0.25  # [s] of residuals that may belong together
_ALIKE = 0.1  # correlation of neighbouring residuals beyond which they are no noise


class Spread(NamedTuple):
    """How well x is known.

    Attributes:
        covariance: of x, shape (p, p).
        freedom: degrees of freedom of Student's t.
        alike: correlation of residuals with those of the sample before, by quantity.
        is_noise: whether all of them are small; else the covariance is the one for residuals that belong together.
    """

    covariance: Array
    freedom: float
    alike: dict[str, float]
    is_noise: bool


def information(problem: Problem, solution: Solution, which: Sequence[int]) -> tuple[Eliminated, list[Linear]]:
    """The pieces at a solution, with their states eliminated."""
    problem.at(solution.x)
    problem.kicks = list(solution.kicks)
    linear = problem.linear(solution.states, which)
    defects = defects_of(problem, linear, which, solution.states)
    weights = Weights(solution.sigma, np.outer(solution.loose, slack_of(problem)))
    return eliminate(problem, linear, which, defects, weights), linear


def spread_of(problem: Problem, solution: Solution, which: Sequence[int]) -> Spread:
    """How well the parameters of a solution are known.

    Where the residuals are white, the covariance is that of least squares, (A^T A)^-1, A the derivatives of the
    weighted residuals with all states following. Where neighbours are alike, as where the model is not the hand, it is
    (A^T A)^-1 (sum g g^T) (A^T A)^-1 with the scores g = A^T r of stretches of 0.25 s [Liang and Zeger, Biometrika 73,
    1986], and Student's t of as many stretches less one. The step that the linear model has left to go adds its square.
    """
    found, linear = information(problem, solution, which)
    inverse = np.linalg.pinv(found.R)
    ahead = step_of(found, 0.0, solution.x, *bounds_of(problem), np.ones(len(solution.x), dtype=bool))
    bread = inverse @ inverse.T + np.outer(ahead, ahead)
    alike = _alike(problem, linear, which)
    if max(alike.values()) <= _ALIKE:
        return Spread(bread, np.inf, alike, True)
    scores = _scores(problem, found, linear, which, solution)
    per = max(1, round(_CLUSTER / (problem.pieces[0].size * problem.period)))
    groups = [sum(scores[k : k + per]) for k in range(0, len(scores), per)]
    count = len(groups)
    meat = sum(np.outer(g, g) for g in groups) * count / max(count - 1, 1)
    robust = bread @ meat @ bread
    # never narrower than noise alone would have it
    wider = np.maximum(np.diag(robust), np.diag(bread)) / np.maximum(np.diag(robust), 1e-300)
    scale = np.sqrt(wider)
    return Spread(robust * np.outer(scale, scale), max(count - 1.0, 1.0), alike, False)


def half_widths(spread: Spread, level: float) -> Array:
    """Of the intervals of x, shape (p,)."""
    from scipy.special import ndtri, stdtrit

    quantile = ndtri(0.5 + 0.5 * level) if np.isinf(spread.freedom) else stdtrit(spread.freedom, 0.5 + 0.5 * level)
    return np.asarray(quantile * np.sqrt(np.diag(spread.covariance)))


def _scores(
    problem: Problem, found: Eliminated, linear: Sequence[Linear], which: Sequence[int], solution: Solution
) -> list[Array]:
    scores = []
    for one, S, k in zip(linear, found.S, which, strict=True):
        w = 1.0 / solution.sigma[problem.channel[k]]
        A = (one.by_parameters - one.by_start @ S) * w[:, None]
        scores.append(A.T @ (one.r * w))
    return scores


def _alike(problem: Problem, linear: Sequence[Linear], which: Sequence[int]) -> dict[str, float]:
    """Correlation of neighbouring residuals of each quantity."""
    found = {}
    for name in problem.names:
        channels = [c for c, (one, _) in enumerate(problem.channels) if one == name]
        product = square = 0.0
        for one, k in zip(linear, which, strict=True):
            for c in channels:
                r = one.r[problem.channel[k] == c]
                product += float(r[1:] @ r[:-1])
                square += float(r[1:] @ r[1:])
        found[name] = product / square if square > 0.0 else 0.0
    return found
