"""A fit and what its residuals say of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from softhand.identification.fitting.solving import SINGULAR, Solution, scaled, solve
from softhand.identification.record import Measurements
from softhand.identification.residuals.noise import Noise, estimate_noise
from softhand.identification.residuals.offset import Offset, free_offset
from softhand.identification.residuals.patterns import LIKELY, SHOWN, Pattern, Patterns, find_patterns
from softhand.identification.residuals.remainder import find_residuals
from softhand.numerics.arrays import Array


@dataclass(frozen=True, eq=False)
class Judgement:
    """What the residuals say.

    Attributes:
        plain: the fit without an offset of dr, with the weights that the residuals ask for.
        offset: the fit with one.
        patterns: in the residuals.
        noise: its sizes.
        has_offset: whether the data show the offset.
    """

    plain: Solution
    offset: Offset
    patterns: Patterns
    noise: Noise
    has_offset: bool

    @property
    def solution(self) -> Solution:
        """The fit whose values are given."""
        return self.offset.solution if self.has_offset else self.plain


def judge(plain: Solution, measurements: Measurements) -> Judgement:
    """Look at the residuals of a fit; where scatter grows with the force, weigh by that and look once more."""
    spread = np.ones(len(plain.model.measured))
    offset, patterns, noise = _look(plain, measurements, spread)
    if patterns.growing.chance < SHOWN:
        spread[noise.residuals.number] = noise.spread
        plain = solve(plain.model, plain.linear, spread, plain.values)
        growing = patterns.growing
        offset, patterns, noise = _look(plain, measurements, spread, growing)
    return Judgement(plain, offset, patterns, noise, _is_shown(offset, noise))


def _look(
    plain: Solution, measurements: Measurements, spread: Array, growing: Pattern | None = None
) -> tuple[Offset, Patterns, Noise]:
    """The fit with an offset, the patterns of its residuals, and the noise that they call for."""
    offset = free_offset(plain, measurements, spread)
    residuals = find_residuals(offset.solution, spread, measurements)
    patterns = find_patterns(residuals)
    if growing is not None:
        patterns = replace(patterns, growing=growing)
    correlation = patterns.correlation.size if patterns.correlation.chance < LIKELY else 0.0
    noise = estimate_noise(residuals, patterns.has_growth, patterns.gains.chance < LIKELY, correlation)
    return offset, patterns, noise


def _is_shown(offset: Offset, noise: Noise) -> bool:
    """t-test of an offset of dr."""
    from scipy.special import stdtr

    if offset.kind != "fitted":
        return False
    A, length = scaled(offset.solution.weighted_slope)
    lever: Array = np.linalg.pinv(A, rcond=SINGULAR)[-1:, noise.residuals.number].astype(float)
    variance, freedom, _ = noise.variance(lever)
    ratio = abs(offset.solution.values[-1]) * length[-1] / np.sqrt(max(float(variance[0]), 1e-300))
    return bool(2.0 * stdtr(max(freedom[0], 0.5), -ratio) < SHOWN)
