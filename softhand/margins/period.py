"""How long a torque may be held: the loop at other control periods."""

from __future__ import annotations

import numpy as np

from softhand.errors import SofthandError
from softhand.margins.loop import close_loop, is_stable
from softhand.margins.place import Place
from softhand.margins.search import edge

_GROW, _TIMES = 1.25, 24
"""How much longer each period is that is tried, and how many are: up to 200 times."""


def growth_at(place: Place, period: float) -> float:
    """Growth with torques held for a period [s], in 1/s; NaN where the loop cannot be found."""
    try:
        return close_loop(place, period).growth
    except SofthandError:
        return np.nan


def largest_period(place: Place) -> float:
    """The longest control period up to which no motion grows [s].

    From that of the scenario upwards; downwards if motions grow there. NaN if they do with all that were tried, a
    two-hundredth of it, and infinite if with none, up to two hundred times as long.
    """
    stable, now = np.nan, place.period
    factor = _GROW if is_stable(growth_at(place, now)) else 1.0 / _GROW
    period = now
    for _ in range(_TIMES):
        last, period = period, period * factor
        if is_stable(growth_at(place, period)) != (factor > 1.0):
            stable, lost = (last, period) if factor > 1.0 else (period, last)
            return edge(lambda tried: growth_at(place, tried), stable, lost)
    return np.inf if factor > 1.0 else np.nan
