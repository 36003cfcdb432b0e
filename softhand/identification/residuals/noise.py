"""How large the errors of measured numbers are, and how well the residuals tell that."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from softhand.identification.residuals.likelihood import FLOOR, Likelihood
from softhand.identification.residuals.remainder import Residuals
from softhand.numerics.arrays import Array

_LEAST = 1e-9  # of the largest information, below which the residuals do not tell a size


@dataclass(frozen=True, eq=False)
class Noise:
    """Variance of the errors as a sum of parts, in squares of the standard deviations of the components.

    The parts are: noise of each component, noise in proportion to the force, and a gain of each series.

    Attributes:
        parts: variance of each number for each part of independent errors, shape (k, m).
        size: of these parts, then of the gains if there are some, shape (k,) or (k + 1,).
        doubt: covariance of the sizes.
        growth: standard deviation of the noise in proportion to the force, as a share of it.
        gain: standard deviation of the gains.
    """

    residuals: Residuals
    parts: Array
    size: Array
    doubt: Array
    growth: float
    gain: float

    @property
    def spread(self) -> Array:
        """Standard deviation of each number, but for the gains, in standard deviations of its component, shape (m,).

        At least a tenth of the noise in proportion to the force is there without force.
        """
        growing = self.growth**2 * self.residuals.force**2
        count = np.maximum(np.bincount(self.residuals.component, minlength=4), 1)
        least = 0.01 * np.bincount(self.residuals.component, growing, 4) / count
        constant = np.maximum(self.size[:4], least)[self.residuals.component]
        return np.sqrt(np.maximum(constant / self.residuals.spread**2 + growing, FLOOR))

    def variance(self, lever: Array) -> tuple[Array, Array, Array]:
        """Variance of combinations of the numbers, and its degrees of freedom.

        The degrees of freedom are those of [Satterthwaite, Biometrics Bulletin 2, 1946].

        Args:
            lever: shape (p, m), in the order of the residuals.

        Returns:
            Variance, degrees of freedom, each of shape (p,), and the part of each component in it, shape (4, p).
        """
        by_part = self.parts @ (lever**2).T
        if len(self.size) > len(self.parts):
            by_series = self.residuals.sums((lever * self.residuals.force).T)
            by_part = np.vstack([by_part, np.sum(by_series**2, axis=0)])
        variance = self.size @ by_part
        doubt = np.einsum("kp,kl,lp->p", by_part, self.doubt, by_part)
        freedom = 2.0 * variance**2 / np.where(doubt > 0.0, doubt, np.inf)
        return variance, np.where(doubt > 0.0, freedom, 1.0), self.size[:4, None] * by_part[:4]


def estimate_noise(residuals: Residuals, with_growth: bool, with_gains: bool, correlation: float = 0.0) -> Noise:
    """Sizes of the parts by restricted maximum likelihood [Patterson, Thompson, Biometrika 58, 1971].

    Neighbours that err alike count as fewer numbers, (1 - rho) / (1 + rho) of them.

    Args:
        residuals: of a fit.
        with_growth: whether a part of the noise may grow with the force.
        with_gains: whether series may have gains of their own.
        correlation: rho of neighbours in a series.
    """
    constant = (residuals.component == np.arange(4)[:, None]) / residuals.spread**2
    parts = np.vstack([constant, residuals.force**2]) if with_growth else constant
    size, information = _likeliest(Likelihood(residuals, parts, with_gains))
    scale = np.diag(information)
    known = (size > 0.0) & (scale > _LEAST * scale.max(initial=0.0))
    doubt = np.zeros_like(information)
    doubt[np.ix_(known, known)] = np.linalg.pinv(information[np.ix_(known, known)])
    fewer = np.where(np.arange(len(size)) < len(parts), (1.0 + correlation) / (1.0 - correlation), 1.0)
    size, doubt = size * fewer, doubt * np.outer(fewer, fewer) ** 1.5
    return Noise(residuals, parts, size, doubt, float(np.sqrt(size[4])) if with_growth else 0.0,
                 float(np.sqrt(size[-1])) if with_gains else 0.0)  # fmt: skip


def _likeliest(likelihood: Likelihood) -> tuple[Array, Array]:
    """Sizes of the largest restricted likelihood, and the information on them."""
    from scipy.optimize import minimize

    start = likelihood.start

    def score(logarithms: Array) -> tuple[float, Array]:
        size = start * np.exp(logarithms)
        criterion, slope = likelihood.at(size)
        return criterion, size * slope

    limits = [(np.log(FLOOR), -np.log(FLOOR))] * len(start)
    found = minimize(score, np.zeros(len(start)), jac=True, method="L-BFGS-B", bounds=limits, options={"ftol": 1e-5})
    at_floor = found.x <= 0.99 * np.log(FLOOR)
    size = np.where(at_floor, 0.0, start * np.exp(found.x))
    return size, likelihood.information(size)
