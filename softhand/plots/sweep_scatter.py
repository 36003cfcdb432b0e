"""Many runs of a study as points over two keys, with what lies along each of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from softhand.numerics.arrays import AnyArray
from softhand.plots.panels import draw_legend, draw_note, draw_title, from_top, new_figure
from softhand.plots.style import FINGERS, ON_TOP, STYLE
from softhand.plots.varied import Varied

_NOTE = (
    "Each mark is a run. At the sides: how many there are along each key, one kind upon the other. Numbers: the worst "
    "runs, whose scenarios are in worst/. Good: what fails is together and far from where one works."
)
_KINDS = (("success", FINGERS[0], "o"), ("no success", FINGERS[4], "D"), ("ended early", FINGERS[1], "x"))
_BINS = 20


def draw_scatter(
    x: Varied, y: Varied, is_success: AnyArray, is_lost: AnyArray, worst: Sequence[int], title: str
) -> Figure:
    """Runs over two keys by how they went, with histograms at the sides.

    Args:
        x: key of the horizontal axis.
        y: of the vertical axis.
        is_success: shape (runs,).
        is_lost: which ended early, shape (runs,).
        worst: numbers of the worst runs, the worst first.
        title: of the figure.
    """
    kinds = (is_success, ~is_success & ~is_lost, is_lost)
    with rc_context(STYLE):
        figure = new_figure(5.6)
        room = draw_note(figure, _NOTE, 0.34)
        handles: list[Any] = [
            Line2D([], [], ls="", marker=marker, mfc="none", color=color, label=f"{name} ({int(which.sum())})")
            for (name, color, marker), which in zip(_KINDS, kinds, strict=True)
            if which.any()
        ]
        draw_legend(figure, handles, from_top(figure, 0.42 + room), loc="upper left", handlelength=1.0)
        top = draw_title(figure, title, room=room) - 0.01
        axes = figure.subplots(2, 2, sharex="col", sharey="row", width_ratios=(4.0, 1.0), height_ratios=(1.0, 4.0),
                               gridspec_kw={"left": 0.11, "right": 0.98, "top": top, "bottom": 0.1, "wspace": 0.03,
                                            "hspace": 0.04})  # fmt: skip
        main, above, beside = axes[1, 0], axes[0, 0], axes[1, 1]
        axes[0, 1].set_axis_off()
        at = _spread(x), _spread(y)
        for (_, color, marker), which in zip(_KINDS, kinds, strict=True):
            main.plot(at[0][which], at[1][which], ls="", marker=marker, ms=4, mfc="none", mew=0.9, color=color)
        x.prepare(main)
        y.prepare(main, is_x=False)
        _draw_side(above, x, kinds, "vertical")
        _draw_side(beside, y, kinds, "horizontal")
        above.set_ylabel("runs")
        beside.set_xlabel("runs")
        for number, run in enumerate(worst, 1):
            main.annotate(str(number), (at[0][run], at[1][run]), (4, 3), textcoords="offset points", size=7.5,
                          weight="bold", zorder=ON_TOP)  # fmt: skip
    return figure


def _spread(key: Varied) -> Any:
    """Places of the marks: those of a grid a little apart, always in the same way."""
    if not key.is_grid:
        return key.places
    values = np.unique(key.places)
    shift = 0.12 * np.random.default_rng(0).uniform(-1.0, 1.0, len(key.places))
    if key.is_log:
        return key.places * np.exp(shift * (np.min(np.diff(np.log(values))) if len(values) > 1 else 0.1))
    return key.places + shift * (np.min(np.diff(values)) if len(values) > 1 else 1.0)


def _draw_side(axes: Axes, key: Varied, kinds: Sequence[AnyArray], orientation: Any) -> None:
    edges: Any = key.edges() if key.is_grid else _even(key)
    axes.hist([key.places[which] for which in kinds], bins=edges, stacked=True, orientation=orientation,
              color=[color for _, color, _ in _KINDS], rwidth=0.9)  # fmt: skip


def _even(key: Varied) -> Any:
    low, high = float(np.min(key.places)), float(np.max(key.places))
    return np.geomspace(low, high, _BINS + 1) if key.is_log else np.linspace(low, high, _BINS + 1)
