"""How large the errors of measured numbers are, and how well the residuals tell that."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softhand.identification.fitting.model import spread_over
from softhand.identification.fitting.solving import span
from softhand.identification.residuals.remainder import Residuals
from softhand.numerics.arrays import Array

_MOST_NUMBERS = 150  # of a component that sizes are estimated from; more tell hardly more
_FLOOR = 1e-6  # of the variance of the residuals, which is 1
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
        return np.sqrt(np.maximum(constant / self.residuals.spread**2 + growing, _FLOOR))

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
    some = _thinned(residuals)
    size, information = _likeliest(residuals.select(some), parts[:, some], with_gains)
    scale = np.diag(information)
    known = (size > 0.0) & (scale > _LEAST * scale.max(initial=0.0))
    doubt = np.zeros_like(information)
    doubt[np.ix_(known, known)] = np.linalg.pinv(information[np.ix_(known, known)])
    fewer = np.where(np.arange(len(size)) < len(parts), (1.0 + correlation) / (1.0 - correlation), 1.0)
    size, doubt = size * fewer, doubt * np.outer(fewer, fewer) ** 1.5
    return Noise(residuals, parts, size, doubt, float(np.sqrt(size[4])) if with_growth else 0.0,
                 float(np.sqrt(size[-1])) if with_gains else 0.0)  # fmt: skip


def _thinned(residuals: Residuals) -> NDArray[np.int64]:
    """Numbers of each component, evenly spread over its series, and over each of them."""
    kept = []
    for component in np.unique(residuals.component):
        there = np.flatnonzero(residuals.component == component)
        series = np.unique(residuals.series[there])
        chosen = series[spread_over(len(series), _MOST_NUMBERS // 2)]
        most = max(_MOST_NUMBERS // len(chosen), 2)
        for one in chosen:
            numbers = there[residuals.series[there] == one]
            kept.append(numbers[spread_over(len(numbers), most)])
    return np.sort(np.concatenate(kept))


def _likeliest(residuals: Residuals, parts: Array, with_gains: bool) -> tuple[Array, Array]:
    """Sizes of the largest restricted likelihood, and their information matrix tr(R V_i R V_j) / 2."""
    from scipy.optimize import minimize

    taken = span(residuals.slope)
    power = max(float(np.mean(residuals.force**2)), 1e-300)
    start = np.array([1.0] * 4 + [0.1 / power] * (len(parts) - 4 + with_gains))

    def score(logarithms: Array) -> tuple[float, Array]:
        size = start * np.exp(logarithms)
        criterion, slope, _ = _likelihood(residuals, taken, parts, size, with_gains)
        return criterion, size * slope

    limits = [(np.log(_FLOOR), -np.log(_FLOOR))] * len(start)
    found = minimize(score, np.zeros(len(start)), jac=True, method="L-BFGS-B", bounds=limits, options={"ftol": 1e-5})
    at_floor = found.x <= 0.99 * np.log(_FLOOR)
    size = np.where(at_floor, 0.0, start * np.exp(found.x))
    return size, _likelihood(residuals, taken, parts, size, with_gains)[2]


def _likelihood(
    residuals: Residuals, taken: Array, parts: Array, size: Array, with_gains: bool
) -> tuple[float, Array, Array]:
    """Minus the logarithm of the restricted likelihood, its derivatives by the sizes, and the information.

    With V the variance of the residuals, A the columns taken out, R = V^-1 - V^-1 A (A' V^-1 A)^-1 A' V^-1:

        2 criterion = log |V| + log |A' V^-1 A| + e' R e
        2 d criterion / d size_i = tr(R V_i) - e' R V_i R e
        information_ij = tr(R V_i R V_j) / 2
    """
    independent = np.maximum(size[: len(parts)] @ parts, _FLOOR)
    R = np.diag(1.0 / independent)
    volume = float(np.sum(np.log(independent)))
    if with_gains:  # one gain a series: V^-1 by Sherman and Morrison, series by series
        gain = residuals.force / independent
        power = 1.0 + size[-1] * residuals.sums(residuals.force * gain)
        same = residuals.series[:, None] == residuals.series
        R -= same * np.outer(gain * (size[-1] / power)[residuals.series], gain)
        volume += float(np.sum(np.log(power)))
    RA = R @ taken
    among = taken.T @ RA
    R -= RA @ np.linalg.solve(among, RA.T)
    error = R @ residuals.error
    slope, information = parts @ (np.diag(R) - error**2), parts @ R**2 @ parts.T
    if with_gains:
        RU = residuals.sums(residuals.force[:, None] * R).T  # a column for each series
        both = residuals.sums(residuals.force[:, None] * RU)
        slope = np.append(slope, np.trace(both) - np.sum(residuals.sums(residuals.force * error) ** 2))
        across = parts @ np.sum(RU**2, axis=1)
        information = np.block([[information, across[:, None]], [across, np.sum(both**2)]])
    criterion = 0.5 * (volume + np.linalg.slogdet(among)[1] + float(residuals.error @ error))
    return criterion, 0.5 * slope, 0.5 * information
