"""Patterns in residuals that plain noise does not make, each with the chance that noise would look so."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from softhand.identification.residuals.noise import estimate_noise
from softhand.identification.residuals.remainder import Remainder, Residuals, remainder
from softhand.numerics.arrays import Array

LIKELY = 0.1
"""Chance of plain noise below which the intervals allow for a pattern; generous, since leaving one out is worse."""

SHOWN = 0.01
"""Chance of plain noise below which a pattern is told of."""

_PLENTY = 8  # numbers to spare beside gains, from which scatter is judged beside them
_SHOWN_FORM = 1e-4  # the same for the form of the law, which noise of uneven size can feign


@dataclass(frozen=True)
class Pattern:
    """One kind of pattern.

    Attributes:
        size: how large it is, as a share of the force, a correlation or a ratio.
        chance: that plain noise looks like it, 1 where the data cannot tell.
        count: of what shows it: series, neighbours.
    """

    size: float = 0.0
    chance: float = 1.0
    count: int = 0


@dataclass(frozen=True)
class Patterns:
    """What the residuals show.

    Attributes:
        gains: each series has a gain of its own; the size comes with the noise.
        growing: scatter that grows with the force; the size comes with the noise.
        hysteresis: of each component, forces while the deformation grows less those while it falls back.
        correlation: of neighbours in a series.
        form: of each component, scatter of the residuals over that of the repeats.
    """

    gains: Pattern
    growing: Pattern
    hysteresis: tuple[Pattern, ...]
    correlation: Pattern
    form: tuple[Pattern, ...]

    @property
    def has_growth(self) -> bool:
        """Whether errors may grow with the force; loops do as well."""
        return self.growing.chance < LIKELY or any(loop.chance < SHOWN for loop in self.hysteresis)


def find_patterns(residuals: Residuals) -> Patterns:
    """Look for each pattern after the likely ones of those before it are taken out."""
    hysteresis = tuple(_hysteresis(residuals, c) for c in range(4))
    loops = [c for c in range(4) if hysteresis[c].chance < SHOWN]
    apart = _without(residuals, loops, with_gains=True)  # gains look like growing scatter, and so do loops
    has_plenty = apart.freedom >= _PLENTY
    growing = _growing(residuals, apart if has_plenty else _without(residuals, loops, with_gains=False))
    if growing.chance < LIKELY:
        residuals = residuals.over(estimate_noise(residuals, True, has_plenty).spread)
    plain, apart = (_without(residuals, loops, with_gains) for with_gains in (False, True))
    gains = _gains(residuals, plain, apart)
    rest = apart if gains.chance < LIKELY else plain
    return Patterns(gains, growing, hysteresis, _correlation(residuals, rest),
                    tuple(_form(residuals, rest, c) for c in range(4)))  # fmt: skip


def _without(residuals: Residuals, loops: Sequence[int], with_gains: bool) -> Remainder:
    """What remains without the coefficients, the loops of these components, and the gains if asked."""
    columns = [_loop(residuals, component) for component in loops]
    return remainder(residuals, with_gains, np.column_stack(columns) if columns else None)


def _gains(residuals: Residuals, plain: Remainder, apart: Remainder) -> Pattern:
    """F-test of one gain for all series of a component against one for each."""
    from scipy.special import fdtrc

    gained = plain.freedom - apart.freedom
    if gained < 1 or apart.freedom < 1:
        return Pattern()
    within = float(np.sum(apart.error**2)) / apart.freedom
    between = (float(np.sum(plain.error**2)) - within * apart.freedom) / gained
    return Pattern(
        0.0, float(fdtrc(gained, apart.freedom, between / max(within, 1e-300))), int(residuals.series.max()) + 1
    )


def _loop(residuals: Residuals, component: int) -> Array:
    """What hysteresis in proportion to the force adds, in series of both directions, shape (m,)."""
    there = residuals.component == component
    up, down = (residuals.sums((there & (residuals.direction == sign)).astype(float)) for sign in (1, -1))
    both = (up > 0.0) & (down > 0.0)
    return np.where(there & both[residuals.series], residuals.direction * residuals.force, 0.0)


def _hysteresis(residuals: Residuals, component: int) -> Pattern:
    """t-test of a loop, beside the coefficients, the gains of the series, and a bend that a wrong law would leave."""
    from scipy.special import stdtr

    loop = _loop(residuals, component)
    if not loop.any():
        return Pattern()
    there = residuals.component == component
    bends = np.column_stack([np.where(there, residuals.force**power, 0.0) for power in (2, 3)])
    apart = remainder(residuals, with_gains=True, extra=bends)
    alone = remainder(replace(residuals, error=loop), with_gains=True, extra=bends).error
    length, freedom = float(np.linalg.norm(alone)), apart.freedom - 1
    if freedom < 1 or length <= 1e-3 * float(np.linalg.norm(loop)):
        return Pattern()
    share = float(alone @ apart.error) / length**2
    rest = np.sum((apart.error - share * alone) ** 2) / freedom
    chance = 2.0 * stdtr(freedom, -abs(share) * length / np.sqrt(max(rest, 1e-300)))
    return Pattern(2.0 * share, float(chance), len(np.unique(residuals.series[loop != 0.0])))


def _growing(residuals: Residuals, rest: Remainder) -> Pattern:
    """Test of [Koenker, J. Econometrics 17, 1981]: squares of the residuals against the square of the force."""
    from scipy.special import stdtr

    spare = 1.0 - rest.leverage
    kept = spare > 0.1
    squares, power = rest.error[kept] ** 2 / spare[kept], residuals.force[kept] ** 2
    component = residuals.component[kept]
    count = np.maximum(np.bincount(component, minlength=4), 1)
    mean_square, mean_power = (np.bincount(component, values, 4) / count for values in (squares, power))
    unlike = squares - mean_square[component]
    lever = power / np.where(mean_power > 0.0, mean_power, 1.0)[component] - 1.0
    freedom = rest.freedom - len(np.unique(component)) - 1
    size = np.sqrt(np.sum(unlike**2) / max(freedom, 1) * np.sum(lever**2))
    if freedom < 1 or size <= 1e-12 * np.sum(squares):
        return Pattern()
    return Pattern(0.0, float(stdtr(freedom, -float(lever @ unlike) / size)), len(squares))


def _correlation(residuals: Residuals, rest: Remainder) -> Pattern:
    """Products of neighbours in a series, less what taking out the coefficients makes of them."""
    from scipy.special import ndtr

    pairs = np.flatnonzero(residuals.series[1:] == residuals.series[:-1])
    if len(pairs) < 8 or rest.freedom < 4:
        return Pattern()
    variance = float(np.sum(rest.error**2)) / rest.freedom
    shared = np.sum(rest.taken[pairs] * rest.taken[pairs + 1], axis=1) + rest.gain[pairs] * rest.gain[pairs + 1]
    product = float(rest.error[pairs] @ rest.error[pairs + 1] + variance * np.sum(shared))
    share = product / max(variance * len(pairs), 1e-300)
    return Pattern(float(np.clip(share, 0.0, 0.95)), float(ndtr(-share * np.sqrt(len(pairs)))), len(pairs))


def _form(residuals: Residuals, rest: Remainder, component: int) -> Pattern:
    """F-test of the residuals against the repeats of a setting in its series."""
    from scipy.special import fdtrc

    there = residuals.component == component
    _, group, count = np.unique(residuals.setting[there] * (residuals.series.max() + 1) + residuals.series[there],
                                return_inverse=True, return_counts=True)  # fmt: skip
    error = rest.error[there]
    repeats = len(group) - len(count)
    freedom = float(np.sum(1.0 - rest.leverage[there])) - repeats
    if repeats < 1 or freedom < 1.0:
        return Pattern()
    pure = float(np.sum((error - (np.bincount(group, error) / count)[group]) ** 2)) / repeats
    lack = max(float(np.sum(error**2)) - pure * repeats, 0.0) / freedom
    chance = float(fdtrc(freedom, repeats, lack / max(pure, 1e-300))) * SHOWN / _SHOWN_FORM
    whole = np.sqrt((pure * repeats + lack * freedom) / (repeats + freedom))
    return Pattern(float(whole / np.sqrt(max(pure, 1e-300))), min(chance, 1.0), len(group))
