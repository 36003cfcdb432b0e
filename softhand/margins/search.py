"""How far a number can go before a loop is lost: a coarse way first, then the edge between two of its numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from softhand.margins.loop import NEUTRAL, is_stable

FACTORS = tuple(float(2.0 ** (k / 4)) for k in range(-24, 25))
"""Tried of a gain, from 1/64 to 64, and zero."""
_CLOSE = 1e-4
"""Share to which an edge is found."""
_FAR = 1e3  # [1/s]


class Range(NamedTuple):
    """Factors of a number with which a loop is stable: those about 1, or if it is not stable there, the nearest.

    NaN where none of those that were tried is stable.
    """

    low: float
    """0 where it is stable down to nothing."""
    high: float
    """Infinite where the largest factor that was tried, 64, is stable."""

    @property
    def has_now(self) -> bool:
        """Whether 1 is among them."""
        return self.low <= 1.0 <= self.high

    def __str__(self) -> str:
        if np.isnan(self.low):
            return "none from 0 to 64"
        if self.low == 0.0:
            return "any from 0 to 64" if np.isinf(self.high) else f"below {self.high:.4g}"
        return f"above {self.low:.4g}" if np.isinf(self.high) else f"{self.low:.4g} to {self.high:.4g}"


def stable_range(growth: Callable[[float], float]) -> Range:
    """Factors with which the loop is stable.

    Args:
        growth: of the fastest growing motion with a factor [1/s]; NaN where it cannot be found, which is not stable.
    """
    now = FACTORS.index(1.0)
    tried: dict[int, bool] = {}

    def holds(k: int) -> bool:
        if k not in tried:
            tried[k] = is_stable(growth(FACTORS[k] if k >= 0 else 0.0))
        return tried[k]

    middle = next((k for k in sorted(range(-1, len(FACTORS)), key=lambda k: abs(k - now)) if holds(k)), None)
    if middle is None:
        return Range(np.nan, np.nan)
    low, high = middle, middle
    while low > -1 and holds(low - 1):
        low -= 1
    while high < len(FACTORS) - 1 and holds(high + 1):
        high += 1
    value = (0.0, *FACTORS)  # by k + 1
    least = 0.0 if low == -1 else edge(growth, value[low + 1], value[low])
    most = np.inf if high == len(FACTORS) - 1 else edge(growth, value[high + 1], value[high + 2])
    return Range(least, most)


def edge(growth: Callable[[float], float], stable: float, lost: float) -> float:
    """Where motions begin to grow on the way from a stable number to one that is not, to 0.01 %.

    Args:
        growth: [1/s], NaN counts as lost.
        stable: one end.
        lost: the other.
    """

    def beyond(value: float) -> float:
        found = growth(value) - NEUTRAL
        return _FAR if np.isnan(found) else float(np.clip(found, -_FAR, _FAR))

    return float(brentq(beyond, stable, lost, xtol=_CLOSE * abs(lost - stable) / 4.0, rtol=_CLOSE / 4.0))


def first_edge(growth: Callable[[float], float], ways: Sequence[float]) -> float:
    """The last stable number before the first of some that is not; NaN if the first is lost, infinite if none is."""
    for before, value in zip((None, *ways), ways):  # noqa: B905  one shorter
        if not is_stable(growth(value)):
            return np.nan if before is None else edge(growth, before, value)
    return np.inf
