"""The figure of a tuning, from its record."""

from __future__ import annotations

import math

from matplotlib.figure import Figure

from softhand.plots.tuning import Moved, Spread, draw_tuning
from softhand.tuning.figures import FIGURES
from softhand.tuning.record import Tuning, Turn


def draw(found: Tuning, title: str) -> Figure:
    """Figures in the held-out worlds, numbers between their bounds, and the search."""
    spreads = [
        Spread(
            FIGURES[one.name].words + ("" if one.unit == "1" else f" [{one.unit}]"),
            found.each[0, :, k],
            found.each[1, :, k],
            one.limit,
        )
        for k, one in enumerate(found.figures)
    ]
    notes = [f"No better than before: {reason}" for reason in found.reasons]
    return draw_tuning(spreads, [_moved(one) for one in found.turned], found.history, title, *notes)


def _moved(one: Turn) -> Moved:
    unit = "" if one.unit == "1" else f" {one.unit}"
    return Moved(one.name, _place(one, one.before), _place(one, one.after), f"{one.before:.3g} → {one.after:.3g}{unit}")


def _place(one: Turn, value: float) -> float:
    value = min(max(value, one.low), one.high)
    if one.is_log:
        return math.log(value / one.low) / math.log(one.high / one.low)
    return (value - one.low) / (one.high - one.low)
