"""Modes of a loop before and after a design, by how fast they die out and how they ring."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from softhand.margins.modes import Mode
from softhand.plots.panels import draw_legend, draw_note, draw_title, from_top, new_figure
from softhand.plots.style import FINGERS, STYLE, WARNING

_NOTE = (
    "Each mark is a motion of the closed loop that keeps its shape; right of the line it grows. Left: all of them. "
    "Right: the slowest to die out. A good design moves them to the left, and those of low frequency far from the axis."
)
_COLORS = FINGERS[1], FINGERS[0]
_NEAR = 40.0  # [1/s]


def draw_design(before: Sequence[Mode], after: Sequence[Mode], title: str, names: tuple[str, str]) -> Figure:
    """Growth against frequency, before and after.

    Args:
        before: modes with the old controller.
        after: with the new one.
        title: of the figure.
        names: of the controllers.
    """
    with rc_context(STYLE):
        figure = new_figure(4.6)
        room = draw_note(figure, _NOTE, 0.34)
        top = draw_title(figure, title, room=room) - 0.04
        marks = [
            Line2D([], [], ls="", marker="x" if k else "o", mfc="none", color=_COLORS[k], label=f"{word}: {name}")
            for k, (word, name) in enumerate(zip(("before", "after"), names, strict=True))
        ]
        draw_legend(figure, marks, from_top(figure, 0.42 + room), "upper left", handlelength=1.0)
        left, right = figure.subplots(1, 2, gridspec_kw={
            "left": 0.075, "right": 0.975, "top": top, "bottom": 0.12, "wspace": 0.18})  # fmt: skip
        for axes, is_near in ((left, False), (right, True)):
            _draw(axes, before, after, is_near)
        left.set_title("(a)  all motions", loc="left", weight="normal")
        right.set_title("(b)  the slowest to die out", loc="left", weight="normal")
        left.set_ylabel("frequency [Hz]")
    return figure


def _draw(axes: Axes, before: Sequence[Mode], after: Sequence[Mode], is_near: bool) -> None:
    highest = max(0.0, *(mode.growth for mode in (*before, *after)))
    for modes, color, marker in zip((before, after), _COLORS, ("o", "x"), strict=True):
        points = [(mode.growth, mode.frequency) for mode in modes if np.isfinite(mode.growth)]
        chosen = np.array([one for one in points if not is_near or one[0] > -_NEAR]).reshape(-1, 2)
        axes.plot(*chosen.T, ls="", marker=marker, ms=5, mew=1.2, mfc="none", color=color)
    low = -1.05 * _NEAR if is_near else axes.get_xlim()[0]
    axes.set_xlim(low, highest + 0.06 * (highest - low))
    axes.axvline(0.0, color=WARNING, lw=0.8)
    axes.axvspan(0.0, axes.get_xlim()[1], color=WARNING, alpha=0.08, lw=0.0)
    axes.set_xlabel("growth [1/s]")
