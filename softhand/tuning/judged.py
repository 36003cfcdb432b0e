"""Before and after in worlds that the search has not seen: differences with their intervals, and what follows."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from softhand.numerics.arrays import Array
from softhand.tuning.figures import FIGURES
from softhand.tuning.objective import Bound
from softhand.tuning.settings import Term
from softhand.tuning.trials import Tried

LEVEL = 0.95
"""Of all intervals."""


class Judged(NamedTuple):
    """One figure before and after, over the held-out worlds in which both runs came to their end.

    Attributes:
        name: in `FIGURES`.
        unit: of it.
        weight: in the cost.
        over: `mean` or `worst`, what before and after are of the worlds.
        before: the figure of the scenario as it was.
        after: the figure with what was turned.
        change: mean of after - before, world by world.
        half_width: of the interval of that mean, 95 %; NaN of a single world.
        limit: largest figure, or infinity.
        is_kept: whether the limit holds.
    """

    name: str
    unit: str
    weight: float
    over: str
    before: float
    after: float
    change: float
    half_width: float
    limit: float
    is_kept: bool

    @property
    def percent(self) -> float:
        """The change of the figure as a share of what it was [%]."""
        return 100.0 * (self.after - self.before) / abs(self.before) if self.before else math.nan


class Judgement(NamedTuple):
    """What the held-out worlds say.

    Attributes:
        figures: a line each.
        lost: share of lost runs before and after.
        astray: share of runs that are lost or not settled if they go on, before and after.
        gain: mean of the cost before less after, and half the width of its interval.
        reasons: why what was found is not better; empty if it is.
    """

    figures: tuple[Judged, ...]
    lost: tuple[float, float]
    astray: tuple[float, float]
    gain: tuple[float, float]
    reasons: tuple[str, ...]


def judge(
    terms: Mapping[str, Term], bounds: Sequence[Bound], before: Tried, after: Tried,
    astray: tuple[float, float] = (0.0, 0.0),
) -> Judgement:  # fmt: skip
    """Whether what was found is better than what was there.

    It is if no larger share of runs is lost, nor goes astray later, if each limit holds, and if the cost fell, by the
    whole interval of its mean, or fewer runs are lost. The limit "before" holds where the interval of the mean change
    is at most 0; a number where that of the mean is at most the number. Where the worst world counts, it alone is
    compared.

    Args:
        terms: as set.
        bounds: with their scales; the limit "before" is taken from the held-out worlds anew.
        before: one candidate in the held-out worlds.
        after: likewise.
        astray: share of runs that are lost or not settled if they go on for longer, before and after.
    """
    lost = float(np.mean(before.lost > 0.0)), float(np.mean(after.lost > 0.0))
    both = (before.lost[0] == 0.0) & (after.lost[0] == 0.0)
    first, second = before.figures[0][both], after.figures[0][both]
    if not len(first):
        return Judgement((), lost, astray, (math.nan, math.nan), ("no held-out world has a run that came to its end.",))
    figures = tuple(
        _judged(bound, terms[bound.name], first[:, k], second[:, k]) for k, bound in enumerate(bounds)
    )  # fmt: skip
    saved = sum(
        (bound.weight / bound.scale * (first[:, k] - second[:, k]) for k, bound in enumerate(bounds)),
        np.zeros(len(first)),
    )
    gain = float(np.mean(saved)), _half_width(saved)
    return Judgement(figures, lost, astray, gain, tuple(_reasons(figures, lost, astray, gain)))


def _judged(bound: Bound, term: Term, first: Array, second: Array) -> Judged:
    change, half = float(np.mean(second - first)), _half_width(second - first)
    of = np.max if term.over == "worst" else np.mean
    before, after = float(of(first)), float(of(second))
    slack = 1e-9 * max(abs(before), FIGURES[bound.name].least)
    limit = before if term.at_most == "before" else bound.limit
    if term.over == "worst":
        upper = after
    elif term.at_most == "before":
        upper = before + change + _or_zero(half)
    else:
        upper = after + _or_zero(_half_width(second))
    return Judged(
        bound.name, FIGURES[bound.name].unit, bound.weight, term.over, before, after, change, half, limit,
        upper <= limit + slack,
    )  # fmt: skip


def _reasons(
    figures: Sequence[Judged], lost: tuple[float, float], astray: tuple[float, float], gain: tuple[float, float]
) -> list[str]:
    reasons = []
    if astray[1] > astray[0]:
        reasons.append(
            f"{100.0 * astray[1]:.3g} % of the runs are lost or not settled if they go on for longer, "
            f"{100.0 * astray[0]:.3g} % were before."
        )
    if lost[1] > lost[0]:
        reasons.append(f"{100.0 * lost[1]:.3g} % of the runs are lost, {100.0 * lost[0]:.3g} % were before.")
    for one in figures:
        if not one.is_kept:
            reasons.append(
                f"{FIGURES[one.name].words} is {one.after:.4g} {_unit(one.unit)}, and it is not sure to be at most "
                f"{one.limit:.4g} (95 %)."
            )
    fell = gain[0] - _or_zero(gain[1]) > 0.0
    if not fell and not lost[1] < lost[0]:
        reasons.append(
            f"the cost did not surely fall: by {gain[0]:.3g} +- {_or_zero(gain[1]):.2g} (95 %) in multiples of what "
            "it was."
        )
    return reasons


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit


def _half_width(values: Array) -> float:
    """Of the interval of the mean of independent values."""
    if len(values) < 2:
        return math.nan
    factor = float(student.ppf(0.5 + 0.5 * LEVEL, len(values) - 1))
    return factor * float(np.std(values, ddof=1)) / math.sqrt(len(values))


def _or_zero(value: float) -> float:
    return 0.0 if math.isnan(value) else value
