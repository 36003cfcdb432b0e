"""Confidence intervals of coefficients."""

from __future__ import annotations

import numpy as np

from softhand.identification.fitting.coefficients import OFFSET
from softhand.identification.fitting.solving import ENOUGH, SINGULAR, Solution, scaled
from softhand.identification.residuals.noise import Noise
from softhand.numerics.arrays import Array

_LARGEST = 300.0  # logarithm of a factor, beyond which it is as good as infinite


def find_intervals(solution: Solution, noise: Noise, level: float) -> tuple[Array, Array]:
    """Ends of the confidence intervals of the free coefficients, each of shape (p,).

    Student's t about linearised least squares. Where several components tell of one coefficient, the variance is raised
    for their weights being estimates themselves [P. Meier, Variance of a weighted mean, Biometrics 9, 1953]. In a law
    that is not linear the interval of a positive coefficient is one of its logarithm. NaN where as many coefficients
    as numbers of a component leave nothing that tells its noise.

    Args:
        solution: the fit.
        noise: of its residuals.
        level: share of experiments in which an interval is to hold the truth, such as 0.95.
    """
    from scipy.special import stdtrit

    A, length = scaled(solution.weighted_slope)
    lever: Array = np.linalg.pinv(A, rcond=SINGULAR).astype(float)
    variance, freedom, by_component = noise.variance(lever[:, noise.residuals.number])
    share = by_component / np.where(variance > 0.0, variance, 1.0)
    spare = np.maximum(solution.freedom, ENOUGH)
    variance = variance * (1.0 + 4.0 * np.sum(share * (1.0 - share) / spare[:, None], axis=0))  # [Meier]
    half = stdtrit(np.maximum(freedom, ENOUGH), 0.5 + 0.5 * level) * np.sqrt(variance) / length
    half = np.where(_rests_on_untold(solution, lever), np.nan, half)
    values = solution.values
    low, high = values - half, values + half
    of_law = np.array([coefficient.name != OFFSET for coefficient in solution.model.free])
    if not solution.linear[of_law].all():
        bent = of_law & (solution.model.lower == 0.0) & (values > 0.0)
        factor = np.exp(np.minimum(half / np.where(bent, values, np.inf), _LARGEST))
        low, high = np.where(bent, values / factor, low), np.where(bent, values * factor, high)
    return low, high


def _rests_on_untold(solution: Solution, lever: Array) -> Array:
    """Coefficients that rest on a component whose scatter no number tells, shape (p,)."""
    model = solution.model
    untold = (solution.freedom < ENOUGH)[model.component]
    weight = np.sum(lever**2, axis=1)
    return np.sum(lever[:, untold] ** 2, axis=1) > 1e-3 * np.where(weight > 0.0, weight, np.inf)
