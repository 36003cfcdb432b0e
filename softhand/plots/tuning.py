"""A tuning: figures before and after in worlds that the search has not seen, where the numbers went, and the search."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from softhand.numerics.arrays import Array
from softhand.plots.panels import draw_legend, draw_note, draw_title, from_top, new_figure
from softhand.plots.style import DASHED, FINGERS, STYLE

_NOTE = (
    "Above: share of the held-out worlds in which a figure is at most so large; good is to the left, and left of a "
    "dashed limit of the mean. Below: where each number was between its bounds and where it went; the least cost found."
)
_BEFORE, _AFTER = FINGERS[1], FINGERS[0]
_LONGEST = 34  # letters of a name


class Spread(NamedTuple):
    """One figure in the held-out worlds: name and unit, values before and after, shape (worlds,), and its limit."""

    label: str
    before: Array
    after: Array
    limit: float


class Moved(NamedTuple):
    """One number: its name, its bounds, before and after as shares of the way between them, and both in words."""

    name: str
    before: float
    after: float
    words: str


def draw_tuning(spreads: Sequence[Spread], moved: Sequence[Moved], history: Array, title: str, *notes: str) -> Figure:
    """Distributions of the figures, the numbers between their bounds, and the search.

    Args:
        spreads: the figures.
        moved: the numbers.
        history: runs, and the least cost after them, shape (n, 2).
        title: of the figure.
        notes: warnings below it.
    """
    below = max(1.5, 0.21 * len(moved))
    with rc_context(STYLE):
        figure = new_figure(4.1 + below)
        room = draw_note(figure, _NOTE, 0.34)
        handles = [Line2D([], [], color=color, label=word) for color, word in ((_BEFORE, "before"), (_AFTER, "after"))]
        handles.append(Line2D([], [], color="black", lw=0.8, ls=DASHED, label="limit of the mean"))
        draw_legend(figure, handles, from_top(figure, 0.42 + room), "upper left")
        top = draw_title(figure, title, *notes, room=room) + 0.01
        height = float(figure.get_figheight())
        middle, bottom = (below + 1.05) / height, 0.5 / height
        upper = figure.add_gridspec(1, max(len(spreads), 1), left=0.06, right=0.985, top=top, bottom=middle, wspace=0.2)
        for k, spread in enumerate(spreads):
            _draw_spread(figure.add_subplot(upper[k]), spread, is_first=k == 0)
        floor = figure.add_gridspec(1, 2, left=0.235, right=0.985, top=(below + 0.4) / height, bottom=bottom,
                                    wspace=0.72, width_ratios=(1.35, 1.0))  # fmt: skip
        _draw_moved(figure.add_subplot(floor[0]), moved)
        _draw_history(figure.add_subplot(floor[1]), history)
    return figure


def _draw_spread(axes: Axes, spread: Spread, is_first: bool) -> None:
    for values, color in ((spread.before, _BEFORE), (spread.after, _AFTER)):
        there = np.sort(values[np.isfinite(values)])
        if len(there):
            share = np.arange(len(there) + 1) / len(there)
            axes.step([there[0], *there], share, where="post", color=color)
            axes.plot(float(np.mean(there)), 0.5, "o", color=color, ms=4)
    if np.isfinite(spread.limit):
        axes.axvline(spread.limit, color="black", lw=0.8, ls=DASHED)
    axes.set_ylim(0.0, 1.02)
    axes.set_xlabel(spread.label)
    axes.locator_params(axis="x", nbins=5)
    if is_first:
        axes.set_ylabel("share of worlds")
    else:
        axes.tick_params(labelleft=False)


def _draw_moved(axes: Axes, moved: Sequence[Moved]) -> None:
    for k, one in enumerate(moved):
        axes.annotate("", (one.after, k), (one.before, k), arrowprops={
            "arrowstyle": "-", "color": "0.6", "lw": 1.0, "shrinkA": 0.0, "shrinkB": 0.0})  # fmt: skip
        axes.plot(one.before, k, "o", color=_BEFORE, ms=4.5, clip_on=False, zorder=3)
        axes.plot(one.after, k, "o", color=_AFTER, ms=4.5, clip_on=False, zorder=4)
        axes.annotate(one.words, (1.0, k), (6.0, 0.0), textcoords="offset points", va="center", size=7.0, color="0.3",
                      annotation_clip=False)  # fmt: skip
    axes.set_yticks(range(len(moved)), [_short(one.name) for one in moved])
    axes.set_ylim(len(moved) - 0.5, -0.5)
    axes.set_xlim(0.0, 1.0)
    axes.set_xticks([0.0, 1.0], ["lower bound", "upper bound"])
    axes.grid(False, axis="x")


def _draw_history(axes: Axes, history: Array) -> None:
    axes.step(history[:, 0], history[:, 1], where="post", color=_AFTER)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("runs of the search")
    axes.set_ylabel("cost", color=_AFTER)


def _short(name: str) -> str:
    return name if len(name) <= _LONGEST else f"…{name[1 - _LONGEST :]}"
