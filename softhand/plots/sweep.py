"""Many runs of a study: how often they succeed over what varies, maps over two keys, and what outcomes depend on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from softhand.numerics.arrays import AnyArray, Array
from softhand.plots.panels import draw_legend, draw_note, draw_title, from_top, new_figure
from softhand.plots.style import FINGERS, STYLE
from softhand.plots.varied import Varied

_RATE_NOTE = (
    "Share of the runs that succeed, over each key that varies and whatever the others are, with the Wilson interval "
    "of 95 % that so many runs leave. Dashed: all runs. Good: high, and flat over what cannot be known beforehand."
)
_MAP_NOTE = (
    "Mean over all runs in a cell, whatever else varies. A cell without a run, or of which no run has reached its end, "
    "is grey. Good: the place where one works is not at the edge of what succeeds."
)
_SOBOL_NOTE = (
    "Share of the variance of an outcome that is due to a key: alone (first order) and together with others (total), "
    "with 95 % intervals by bootstrap. A total near zero: the key can be left as it is. Much more total than first "
    "order: it matters together with another one."
)
_RANK_NOTE = (
    "Spearman's rank correlation of an outcome with each key, with 95 % intervals: 1 where the one always grows with "
    'the other. What goes up and down again is not seen by it; method = "saltelli" gives Sobol indices, which see it.'
)
_ROW, _COLUMNS = 2.3, 3  # [in] height of a row of panels


class Map(NamedTuple):
    """What is drawn over two keys.

    Attributes:
        label: of the colours.
        values: of the runs, NaN where there is none, shape (runs,).
        is_rate: whether they are from 0 to 1.
    """

    label: str
    values: Array
    is_rate: bool


class Bars(NamedTuple):
    """What one outcome depends on.

    Attributes:
        title: of its panel.
        keys: what varies.
        series: name, values, and ends of their intervals, shape (keys,) each.
    """

    title: str
    keys: tuple[str, ...]
    series: Sequence[tuple[str, Array, Array, Array]]


Interval = Callable[[AnyArray], tuple[float, float, float]]
"""Rate of some runs, and the ends of its interval; the argument says which, shape (runs,) of booleans."""


def draw_rates(keys: Sequence[Varied], interval: Interval, title: str) -> Figure:
    """Rates of success over each key."""
    with rc_context(STYLE):
        rows = -(-len(keys) // _COLUMNS)
        figure, top = _begin(0.9 + _ROW * rows, title, _RATE_NOTE, [])
        whole = interval(np.ones(len(keys[0].places), dtype=bool))[0]
        columns = min(len(keys), _COLUMNS)
        axes = figure.subplots(rows, columns, sharey=True, squeeze=False, gridspec_kw=_places(figure, top))
        for place, key in zip(axes.flat, keys, strict=False):
            at, found = zip(*((at, interval(which)) for at, which in key.groups()), strict=True)
            rate, low, high = np.array(found).T
            place.axhline(whole, color="0.5", lw=0.8, ls="--")
            place.errorbar(at, rate, [rate - low, high - rate], color=FINGERS[0], marker="o", ms=4, lw=1.0,
                           capsize=2.5, ls="" if key.names else "-")  # fmt: skip
            place.set_ylim(-0.03, 1.03)
            key.prepare(place)
        for place in axes.flat[len(keys) :]:
            place.set_axis_off()
        for place in axes[:, 0]:
            place.set_ylabel("share of successes")
    return figure


def draw_map(x: Varied, y: Varied, maps: Sequence[Map], title: str) -> Figure:
    """Means over cells of two keys."""
    with rc_context(STYLE):
        figure, top = _begin(4.0, title, _MAP_NOTE, [])
        axes = figure.subplots(1, len(maps), sharey=True, squeeze=False, gridspec_kw={
            "left": 0.1, "right": 0.97, "top": top - 0.04, "bottom": 0.15, "wspace": 0.12})[0]  # fmt: skip
        edges = x.edges(), y.edges()
        for place, own in zip(axes, maps, strict=True):
            there = np.isfinite(own.values)
            at = x.places[there], y.places[there]
            count = np.histogram2d(*at, bins=edges)[0]
            total = np.histogram2d(*at, bins=edges, weights=own.values[there])[0]
            with np.errstate(invalid="ignore"):
                mean = np.where(count > 0, total / count, np.nan)
            place.set_facecolor("0.85")
            place.grid(False)
            limits = {"vmin": 0.0, "vmax": 1.0} if own.is_rate else {}
            mesh = place.pcolormesh(*edges, mean.T, cmap="cividis" if own.is_rate else "cividis_r", **limits)
            x.prepare(place)
            figure.colorbar(mesh, ax=place, pad=0.02, fraction=0.06).outline.set_visible(False)
            place.set_title(own.label, loc="left", weight="normal")
        y.prepare(axes[0], is_x=False)
    return figure


def draw_sensitivity(bars: Sequence[Bars], title: str) -> Figure:
    """What outcomes depend on."""
    names = [name for name, *_ in bars[0].series]
    with rc_context(STYLE):
        handles: list[Any] = [
            Line2D([], [], ls="", marker="s", ms=6, color=FINGERS[k], label=name)
            for k, name in enumerate(names)
            if len(names) > 1
        ]
        columns = min(len(bars), 2)
        rows = -(-len(bars) // columns)
        height = 0.75 + 0.26 * len(bars[0].keys) * len(names) ** 0.5
        figure, top = _begin(1.0 + height * rows, title, _SOBOL_NOTE if len(names) > 1 else _RANK_NOTE, handles)
        axes = figure.subplots(rows, columns, squeeze=False, sharex=True, gridspec_kw={
            "left": 0.19, "right": 0.975, "top": top - 0.03, "bottom": 0.5 / figure.get_figheight(), "wspace": 0.62,
            "hspace": 0.4})  # fmt: skip
        for place, own in zip(axes.flat, bars, strict=False):
            _draw_bars(place, own)
        for place in axes.flat[len(bars) :]:
            place.set_axis_off()
        for place in axes[-1]:
            place.set_xlabel("share of the variance" if len(names) > 1 else "rank correlation")
    return figure


def _draw_bars(place: Any, own: Bars) -> None:
    at = np.arange(len(own.keys))
    for k, (_, values, low, high) in enumerate(own.series):
        shift = 0.36 * (k - 0.5 * (len(own.series) - 1))
        place.barh(at + shift, values, height=0.32, color=FINGERS[k])
        place.hlines(at + shift, low, high, color="black", lw=1.0)
    place.axvline(0.0, color="0.4", lw=0.8)
    place.set_yticks(at, own.keys)
    place.invert_yaxis()
    place.grid(False, axis="y")
    place.set_title(own.title, loc="left", weight="normal")


def _begin(height: float, title: str, note: str, handles: list[Any]) -> tuple[Figure, float]:
    """An empty figure with title, note and legend; returns where the axes may begin."""
    figure = new_figure(height)
    room = draw_note(figure, note, 0.34)
    if handles:
        draw_legend(figure, handles, from_top(figure, 0.42 + room), loc="upper left", handlelength=1.0)
        return figure, draw_title(figure, title, room=room) - 0.02
    return figure, draw_title(figure, title, room=room - 0.25)


def _places(figure: Figure, top: float) -> dict[str, float]:
    return {"left": 0.075, "right": 0.98, "top": top, "bottom": 0.5 / figure.get_figheight(), "wspace": 0.1,
            "hspace": 0.45}  # fmt: skip
