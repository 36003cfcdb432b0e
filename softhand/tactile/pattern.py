"""Where the taxels of a tip sit: regular patterns of equal areas on the hemisphere, without chance."""

from __future__ import annotations

import itertools
import math
from typing import Literal

import numpy as np

from softhand.errors import ScenarioError
from softhand.numerics.arrays import Array
from softhand.settings.guesses import did_you_mean

FEWEST, MOST = 12, 2000
"""Taxels of a tip. With fewer a contact may rest on less than three, which cannot carry a torsion."""

Pattern = Literal["fibonacci", "rings"]


def taxel_pattern(count: int = 100, pattern: str = "fibonacci") -> Array:
    """Middles of the taxels of a tip, each for an area 2 pi r^2 / count.

    `fibonacci`: on a spiral of the golden angle, the same density everywhere. `rings`: one at the apex, and rings of 6,
    12, 18, ... about it.

    Args:
        count: how many.
        pattern: `fibonacci` or `rings`.

    Returns:
        Unit vectors in the finger frame F, x out of the tip, shape (count, 3).

    Raises:
        ScenarioError: there is no such pattern, or no such number of taxels.
    """
    if pattern not in _PATTERNS:
        raise ScenarioError(
            f"tactile.pattern: there is none called {pattern!r}{did_you_mean(str(pattern), _PATTERNS)}; there are: "
            f"{', '.join(_PATTERNS)}.",
            key="tactile.pattern", value=pattern,
        )  # fmt: skip
    if isinstance(count, bool) or not isinstance(count, int) or not FEWEST <= count <= MOST:
        raise ScenarioError(
            f"tactile.count: got {count!r}; a tip has {FEWEST} to {MOST} taxels.", key="tactile.count", value=count
        )
    return _PATTERNS[pattern](count)


def spacing(count: int) -> float:
    """Side of the square that has the area of a taxel, over the radius of the tip."""
    return math.sqrt(2.0 * math.pi / count)


def _fibonacci(count: int) -> Array:
    k = np.arange(count, dtype=float)
    return _at(1.0 - (k + 0.5) / count, math.pi * (3.0 - math.sqrt(5.0)) * k)


def _rings(count: int) -> Array:
    rings = max(round(0.5 * (math.sqrt(1.0 + 4.0 * (count - 1) / 3.0) - 1.0)), 1)
    k = np.arange(rings + 1)
    ends = 1 + np.rint((count - 1) * k * (k + 1) / (rings * (rings + 1))).astype(int)  # taxels up to each ring
    parts = [_at(np.ones(1), np.zeros(1))]
    for j, (begin, end) in enumerate(itertools.pairwise(ends)):
        size = end - begin
        angle = 2.0 * math.pi * (np.arange(size) + 0.5 * (j % 2)) / size
        parts.append(_at(np.full(size, 1.0 - (begin + 0.5 * size) / count), angle))
    return np.concatenate(parts)


def _at(x: Array, angle: Array) -> Array:
    """Unit vectors at these heights and angles about x."""
    flat = np.sqrt(np.maximum(1.0 - x * x, 0.0))
    return np.stack([x, flat * np.cos(angle), flat * np.sin(angle)], axis=-1)


_PATTERNS = {"fibonacci": _fibonacci, "rings": _rings}
