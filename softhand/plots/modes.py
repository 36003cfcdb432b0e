"""The modes of a loop: how fast each grows and rings, by name."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from softhand.margins.stability import Stability
from softhand.plots.panels import draw_note, draw_title, new_figure
from softhand.plots.style import FINGERS, STYLE, WARNING

_NOTE = (
    "Each mark is a motion of the closed loop that keeps its shape. Left: eigenvalues of one control period; within "
    "the circle a motion dies out. Right: the slowest to die out, by growth and frequency; right of the line it grows. "
    "The numbers are those of the list."
)
_NAMED = 6
_WIDTH = 30.0  # [1/s] of the right panel at least


def draw_modes(found: Stability, title: str) -> Figure:
    """Eigenvalues in the plane of one period, the slowest modes against growth and frequency, and their names.

    Args:
        found: from `stability`.
        title: of the figure.
    """
    with rc_context(STYLE):
        figure = new_figure(6.4)
        room = draw_note(figure, _NOTE, 0.34)
        top = draw_title(figure, title, room=room - 0.14) - 0.03
        left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.35), gridspec_kw={
            "left": 0.075, "right": 0.975, "top": top, "bottom": 0.30, "wspace": 0.2})  # fmt: skip
        _draw_circle(left, found)
        _draw_rates(right, found)
        for k, mode in enumerate(found.modes[:_NAMED]):
            ringing = f" at {mode.frequency:.3g} Hz" if mode.frequency else ""
            figure.text(0.03, 0.205 - 0.032 * k, f"{k + 1}", weight="bold", fontsize=8, color=_color(mode.is_stable))
            figure.text(0.05, 0.205 - 0.032 * k, f"{mode.growth:+.3g} 1/s{ringing}:  {mode.name}", fontsize=7.5)
    return figure


def _color(is_stable: bool) -> str:
    return FINGERS[0] if is_stable else WARNING


def _draw_circle(axes: Axes, found: Stability) -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 200)
    axes.plot(np.cos(angles), np.sin(angles), color="0.4", lw=0.8)
    for mode in found.modes:
        x, y = mode.multiplier
        axes.plot([x, x], [y, -y], ls="", marker="x", ms=5, mew=1.2, color=_color(mode.is_stable))
    axes.set_aspect("equal")
    axes.set_title("(a)  eigenvalues of one control period", loc="left", weight="normal")
    axes.set_xlabel("real part")
    axes.set_ylabel("imaginary part")


def _draw_rates(axes: Axes, found: Stability) -> None:
    rates = np.array([mode.growth for mode in found.modes])
    frequencies = np.array([mode.frequency for mode in found.modes])
    highest = rates[0]
    low = min(highest - _WIDTH, rates[:_NAMED][-1] - 3.0)
    shown = rates > low
    for mode in np.array(found.modes, dtype=object)[shown]:
        axes.plot(mode.growth, mode.frequency, marker="x", ms=6, mew=1.4, ls="", color=_color(mode.is_stable))
    for k in range(min(_NAMED, int(shown.sum()))):
        axes.annotate(f"{k + 1}", (rates[k], frequencies[k]), (4.0, 3.0), textcoords="offset points", fontsize=8)
    end = max(highest, 0.0)
    axes.set_xlim(low, end + 0.08 * (end - low))
    axes.axvline(0.0, color=WARNING, lw=0.8)
    axes.axvspan(0.0, axes.get_xlim()[1], color=WARNING, alpha=0.08, lw=0.0)
    axes.set_ylim(bottom=-0.03 * max(1.0, float(np.max(frequencies[shown]))))
    axes.set_title("(b)  the slowest to die out", loc="left", weight="normal")
    axes.set_xlabel("growth [1/s]")
    axes.set_ylabel("frequency [Hz]")
