"""How the pressure of a law is spread over its contact, told from how its force grows."""

from __future__ import annotations

from functools import lru_cache
from math import radians

import numpy as np

from softhand.laws.law import Law

_FEWEST, _MOST = 0.0, 2.0
_DEPTHS = np.geomspace(0.005, 1.0, 25)
"""At which the force is asked for, over the deepest for which the law is meant."""
_COARSE = 0.05  # steps of m, downwards
_APART = 1e-3  # of a depth, between two for a slope


@lru_cache(maxsize=256)
def pressure_exponent(law: Law) -> float:
    """m of the pressure p ~ (1 - rho^2 / a^2)^m over the contact of a law.

    A force that grows as f ~ d^n has a pressure that grows steadily at each place, and none that falls where another
    rises, if m <= n - 1: with a^2 ~ d, p ~ f / a^2 (1 - rho^2 / a^2)^m ~ (d - rho^2 ...)^m for m = n - 1. This takes
    the least slope n = d ln f / d ln d of the law, m = n - 1: Hertz's force, n = 3/2, has Hertz's pressure, m = 1/2;
    columns, n = 2, have one that is as high as they are compressed, m = 1.

    Args:
        law: of the tip.
    """
    angle = radians(0.5 * sum(law.Phi_range))
    slopes = []
    for depth in law.deepest * law.radius * _DEPTHS:
        low, high = (float(law((depth * share, 0.0, 0.0, 0.0), angle)[0]) for share in (1.0 - _APART, 1.0 + _APART))
        if 0.0 < low < high:
            slopes.append(float(np.log(high / low) / np.log((1.0 + _APART) / (1.0 - _APART))))
    least = min(slopes, default=1.0)
    return float(np.clip(_COARSE * np.floor((least - 1.0) / _COARSE + 0.01), _FEWEST, _MOST))
