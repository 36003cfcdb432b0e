"""What figures are made of: title and legend, panels over time, curves of fingers and desired values."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import Any

from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter, NullLocator

from softhand.numerics.arrays import Array
from softhand.plots.style import ON_TOP, WARNING, finger_color

_LABEL_DISTANCE = 0.45  # [in] from an axis to its label
_WIDTH = 9.0  # [in], 900 px in a README
_LINE = 0.14  # [in] of text below the title
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def new_figure(height: float) -> Figure:
    """An empty figure of the common width and a height [in]."""
    figure = Figure(figsize=(_WIDTH, height), facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def from_top(figure: Figure, inches: float) -> float:
    """Height in the figure, 0 to 1, of a distance from its top [in]."""
    return 1.0 - inches / float(figure.get_figheight())


def draw_title(figure: Figure, title: str, *warnings: str, room: float = 0.0) -> float:
    """Title and warnings, with room for a legend between them, and more [in]; returns where the axes may begin."""
    figure.text(0.012, from_top(figure, 0.1), textwrap.shorten(title, 90), weight="bold", size=11, va="top")
    lines = [line for warning in warnings if warning for line in textwrap.wrap(warning, 145)]
    figure.text(0.012, from_top(figure, 0.56 + room), "\n".join(lines), color=WARNING, va="top")
    return from_top(figure, 0.82 + room + 0.14 * len(lines))


def draw_note(figure: Figure, text: str, inches: float = 0.56) -> float:
    """What a figure shows and what good looks like, in grey at a distance from its top; returns the height [in]."""
    lines = textwrap.wrap(text, 150)
    figure.text(0.012, from_top(figure, inches), "\n".join(lines), color="0.3", va="top", linespacing=1.25)
    return _LINE * len(lines)


def draw_legend(figure: Figure, handles: Sequence[Artist], height: float, loc: Any, handlelength: float = 2.4) -> None:
    """One line of legend whose corner `loc` is at the side of the figure, at a height (0 to 1)."""
    corner = (0.012 if loc.endswith("left") else 0.988, height)
    legend = figure.legend(handles=list(handles), loc=loc, bbox_to_anchor=corner, ncols=len(handles),
                           handlelength=handlelength, columnspacing=1.4, borderpad=0.2, borderaxespad=0.0)  # fmt: skip
    legend.set_zorder(ON_TOP)


def split(place: SubplotSpec, rows: int, columns: int, **spacing: Any) -> list[SubplotSpec]:
    """Cells of a place, row by row."""
    grid = place.subgridspec(rows, columns, **spacing)
    return [grid[row, column] for row in range(rows) for column in range(columns)]


def panel(figure: Figure, place: SubplotSpec, label: str, title: str = "", bottom: bool = False) -> Axes:
    """Empty axes over time; only those at the bottom of a block say so."""
    axes: Axes = figure.add_subplot(place)
    axes.set_ylabel(label)
    axes.set_title(title, loc="left")
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10], min_n_ticks=3))
    axes.xaxis.set_major_locator(_times() if bottom else NullLocator())
    axes.tick_params(which="both", left=False, bottom=False)
    if bottom:
        axes.set_xlabel("time [s]")
    return axes


def _times() -> MaxNLocator:
    return MaxNLocator(4, steps=[1, 2, 2.5, 5, 10])


def plain_powers(axis: Axis) -> None:
    """Labels of a logarithmic axis in plain letters: the usual ones are math text, which figures do not parse."""
    axis.set_major_formatter(FuncFormatter(lambda value, _: power_of_ten(value)))
    axis.set_minor_formatter(NullFormatter())


def power_of_ten(value: float) -> str:
    """A power of ten as a label: 0.01 to 100 in full, others as 10 with its exponent."""
    if value == 0.0 or 0.01 <= abs(value) <= 100.0:
        return f"{value:g}".replace("-", "\N{MINUS SIGN}")
    sign = "\N{MINUS SIGN}" if value < 0.0 else ""
    return f"{sign}10{str(round(math.log10(abs(value)))).translate(_RAISED)}"


def plot_fingers(axes: Axes, time: Array, values: Array, fingers: Sequence[int]) -> None:
    """One line a finger in its colour, each narrower than those below it, which so are seen where they are equal.

    Values have the shape (samples, fingers).
    """
    for k, (finger, column) in enumerate(zip(fingers, values.T, strict=True)):
        axes.plot(time, column, color=finger_color(finger), lw=0.9 + 1.3 * 0.6**k)


def plot_desired(axes: Axes, time: Array, desired: Array) -> None:
    """Thin, black, on top."""
    axes.plot(time, desired, color="black", lw=0.7, zorder=ON_TOP)


def desired_handle() -> Line2D:
    """What a legend shows for desired values."""
    return Line2D([], [], color="black", lw=0.7, label="desired")


def widen(axes: Axes, least: float) -> None:
    """Let the axis span at least `least`, so that rounding errors do not look like motion."""
    low, high = axes.get_ylim()
    if high - low < least:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - 0.5 * least, middle + 0.5 * least)


def warn(axes: Axes, text: str) -> None:
    """A short warning above a panel."""
    axes.set_title(text, loc="right", size=7.5, weight="normal", color=WARNING, pad=2.0)


def finish(figure: Figure, end: float) -> None:
    """One time axis for all, and the labels of each column in line.

    The labels are put where they are: letting matplotlib align them takes a third of the time of a figure. Above the
    lowest panels the grid is drawn as lines, without the ticks that would carry no label: a tick costs as much as a
    curve.
    """
    width = float(figure.get_figwidth())
    times = [time for time in _times().tick_values(0.0, end) if 0.0 < time < end]
    for axes in figure.axes:
        axes.set_xlim(0.0, end)
        if isinstance(axes.xaxis.get_major_locator(), NullLocator):
            axes.add_collection(LineCollection(
                [[(time, 0.0), (time, 1.0)] for time in times], transform=axes.get_xaxis_transform(),
                colors=rcParams["grid.color"], linewidths=rcParams["grid.linewidth"], zorder=0.5,
            ), autolim=False)  # fmt: skip
        axes.yaxis.set_label_coords(-_LABEL_DISTANCE / (width * axes.get_position().width), 0.5)
