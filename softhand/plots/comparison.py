"""The paper's simulation figure: runs with and without torsion compensation against each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D

from softhand.numerics.arrays import Array
from softhand.plots.panels import (
    desired_handle,
    draw_legend,
    draw_title,
    finish,
    from_top,
    new_figure,
    panel,
    plain_powers,
    plot_desired,
    split,
    widen,
)
from softhand.plots.quantities import OBJECT_ARRAYS, check, object_quantities
from softhand.plots.style import DASH_DOTTED, ON_TOP, SOLID, STYLE, TARGETS
from softhand.recording.recording import Recording

_ROUNDING = 1e-9  # [s]


class Compared(NamedTuple):
    """Two runs to one target, with and without compensation of the torsion moments; the label is short, like "A"."""

    label: str
    compensated: Recording
    uncompensated: Recording


def draw_comparison(pairs: Sequence[Compared], title: str, window: float = 0.5) -> Figure:
    """The paper's simulation figure: position, orientation and internal force, with and without compensation.

    Solid with compensation, dash-dotted without, desired values thin and black on top. The last row, on a logarithmic
    scale, is the length of the mean of the error vector over the `window` before: swings cancel, a steady error stays.
    A cross marks where an incomplete run stopped, and the head says why.

    Args:
        pairs: the runs of each target, up to three, all with the same number of contacts.
        title: heading of the figure.
        window: time over which the last row is averaged [s].

    Raises:
        RecordingError: an array that the figure shows is not in a recording.
    """
    for pair in pairs:
        for run in pair[1:]:
            check(run, *OBJECT_ARRAYS)
    with rc_context(STYLE):
        figure = new_figure(7.2)
        top = _draw_comparison_head(figure, pairs, title)
        grid = figure.add_gridspec(1, 3, left=0.075, right=0.975, top=top, bottom=0.065, wspace=0.32)
        for k in range(3):
            _compare_column(figure, grid[k], k, pairs, window)
        finish(figure, max((run.time[-1] for pair in pairs for run in pair[1:] if len(run)), default=1.0))
    return figure


def _compare_column(figure: Figure, place: SubplotSpec, k: int, pairs: Sequence[Compared], window: float) -> None:
    """Components of one quantity, and below them its mean error."""
    first = object_quantities(pairs[0].compensated)[k]
    *spots, last = split(place, len(first.labels) + 1, 1, hspace=0.17)
    rows = [
        panel(figure, spot, f"{label} [{first.unit}]", "" if row else first.title)
        for row, (label, spot) in enumerate(zip(first.labels, spots, strict=True))
    ]
    below = panel(figure, last, f"mean error [{first.unit}]", bottom=True)
    below.set_yscale("log")
    plain_powers(below.yaxis)
    below.set_title(f"mean over the last {window:g} s", loc="right", size=7.5, weight="normal", color="0.35", pad=2.0)
    for pair, colors in zip(pairs, TARGETS, strict=False):
        for run, color, style in ((pair.uncompensated, colors[1], DASH_DOTTED), (pair.compensated, colors[0], SOLID)):
            quantity = object_quantities(run)[k]
            error = _mean_error(run.time, quantity.values - quantity.desired, window)
            for axes, values in zip([*rows, below], [*quantity.values.T, error], strict=True):
                axes.plot(run.time, values, color=color, ls=style)
                if not run.complete:
                    axes.plot(run.time[-1:], values[-1:], "x", color=color, ms=6, mew=2, zorder=ON_TOP + 1)
            for axes, desired in zip(rows, quantity.desired.T, strict=True):
                plot_desired(axes, run.time, desired)
                if style == SOLID and len(run):
                    axes.annotate(pair.label, (1.02, desired[-1]), xycoords=axes.get_yaxis_transform(), color=color,
                                  weight="bold", va="center", annotation_clip=False)  # fmt: skip
    for axes, down in zip(rows, first.falling or [False] * len(rows), strict=True):
        widen(axes, first.least)
        if down:
            axes.invert_yaxis()


def _mean_error(time: Array, error: Array, window: float) -> Array:
    """Length of the mean of the error vector over the time before each sample, shape (samples,); at first NaN."""
    total = np.vstack([np.zeros(error.shape[1]), np.cumsum(error, axis=0)])
    last = np.arange(1, len(time) + 1)
    first = np.searchsorted(time, time - window + _ROUNDING)
    length: Array = np.linalg.norm(total[last] - total[first], axis=1) / (last - first)
    return np.where(time < window - _ROUNDING, np.nan, length)


def _draw_comparison_head(figure: Figure, pairs: Sequence[Compared], title: str) -> float:
    handles, stops = [], []
    for pair, colors in zip(pairs, TARGETS, strict=False):
        for run, color, style, how in zip(pair[1:], colors, (SOLID, DASH_DOTTED), ("with", "without"), strict=True):
            handles.append(Line2D([], [], color=color, ls=style, lw=1.6, label=f"{pair.label}, {how} compensation"))
            if not run.complete:
                stops.append(f"{pair.label}, {how} compensation, stopped at {run.stop_time:g} s: {run.reason}")
    draw_legend(figure, [*handles, desired_handle()], from_top(figure, 0.34), loc="upper left")
    return draw_title(figure, title, *stops)
