"""How fast small motions grow along a run."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from softhand.margins.along import StabilityAlong
from softhand.plots.panels import draw_note, draw_title, finish, from_top, new_figure, panel
from softhand.plots.style import DASHED, FINGERS, STYLE, WARNING

_NOTE = (
    "Rate of the three fastest growing small motions, were the loop to stay as it is at each sample. Good: below zero, "
    "where all motions die out; above it a disturbance grows by a factor e in 1/rate. The dashed lines are where the "
    "phases of the run begin."
)
_COLORS = ("black", FINGERS[0], FINGERS[2])
_FAR = 60.0  # [1/s] below the fastest, from which on a motion is not drawn


def draw_stability_along(along: StabilityAlong, title: str) -> Figure:
    """Growth against time above, the frequency of the same motions below.

    Args:
        along: from `stability_along`.
        title: of the figure.
    """
    with rc_context(STYLE):
        figure = new_figure(5.6)
        room = draw_note(figure, _NOTE, 0.34)
        top = draw_title(figure, title, room=room + 0.02)
        grid = figure.add_gridspec(2, 1, left=0.085, right=0.975, top=top - 0.03, bottom=0.085, hspace=0.3,
                                   height_ratios=(1.6, 1.0))  # fmt: skip
        growth = panel(figure, grid[0], "growth [1/s]", f"Growth, the torque held for {1e3 * along.period:g} ms")
        frequency = panel(figure, grid[1], "frequency [Hz]", "How fast the same motions ring", bottom=True)
        for k, color in enumerate(_COLORS):
            label = ("fastest growing", "second", "third")[k]
            growth.plot(along.time, along.growth[:, k], color=color, lw=1.6 if k == 0 else 0.9, label=label)
            frequency.plot(along.time, along.frequency[:, k], color=color, ls="", marker=".", ms=4 if k == 0 else 2.5)
        lowest, highest = np.nanmin(along.growth[:, 0], initial=0.0), np.nanmax(along.growth[:, 0], initial=0.0)
        low, high = growth.get_ylim()
        low = max(low, min(lowest, highest - _FAR) - 2.0)
        growth.set_ylim(low, max(high, 0.5, 0.05 * (high - low)))
        growth.axhspan(0.0, growth.get_ylim()[1], color=WARNING, alpha=0.08, lw=0.0)
        growth.axhline(0.0, color=WARNING, lw=0.8)
        _draw_phases((growth, frequency), along)
        figure.legend(
            handles=list(growth.lines[:3]), loc="upper left", ncols=3, borderpad=0.2, borderaxespad=0.0,
            bbox_to_anchor=(0.012, from_top(figure, 0.42 + room)),
        )  # fmt: skip
        finish(figure, float(along.time[-1]) or 1.0)
    return figure


def _draw_phases(every: tuple[Axes, ...], along: StabilityAlong) -> None:
    for name, begin in along.phases:
        for axes in every:
            axes.axvline(begin, color="0.5", lw=0.7, ls=DASHED)
        every[0].annotate(
            name, (begin, 0.0), (2.0, 3.0), xycoords=("data", "axes fraction"), textcoords="offset points",
            va="bottom", fontsize=6.5, color="0.35", rotation=90,
        )  # fmt: skip
