"""Any number of runs of one task, a row of small panels each: how far each is from what is desired."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from softhand.numerics.arrays import Array
from softhand.plots.panels import draw_note, draw_title, finish, from_top, new_figure, panel, power_of_ten
from softhand.plots.quantities import FRICTION_TOP
from softhand.plots.style import DASHED, ON_TOP, STYLE, WARNING, finger_color

_SMALLEST = 1e-3  # [mm, deg, N]: what is less is drawn there
_TALLEST, _ALL = 1.1, 7.2  # [in] of a row, and of all rows together
_LEAST = 0.5  # [in] of a row
_AIR = 0.12  # of a row, above and below its curve
_MOST_POINTS = 400  # of a curve: a panel is no wider
_NAME_WIDTH = 19  # letters
_COLUMNS = ("position error [mm]", "orientation error [deg]", "internal-force error [N]", "friction use [-]")
_NOTE = (
    "A row a run, in its colour; all other runs in grey. The scale of a column is the same in all its rows, "
    "logarithmic for errors; the number is the value at the end. Good is low: errors that fall to nothing, friction "
    "use below the dashed 1, above which a tip slips. A cross marks where an incomplete run stopped."
)

_HALO = withStroke(linewidth=2.5, foreground="white")
"""Around a number, where curves pass below it."""


class Lined(NamedTuple):
    """One run: its name, and against time [s] its errors [mm], [deg], [N] and its friction use, shape (samples,)."""

    label: str
    time: Array
    position: Array
    orientation: Array
    force: Array
    friction_use: Array
    complete: bool


class _Scale(NamedTuple):
    """From values to heights within a row, 0 to 1."""

    low: float
    high: float
    is_logarithmic: bool

    def __call__(self, values: Array) -> Array:
        shown = np.log10(np.maximum(values, _SMALLEST)) if self.is_logarithmic else values
        share: Array = np.clip((shown - self.low) / (self.high - self.low), 0.0, 1.0)
        return _AIR + (1.0 - 2.0 * _AIR) * share

    def marks(self) -> list[tuple[float, str]]:
        """Height and label of the two ends of the scale."""
        ends = (self.low, self.high)
        words = [power_of_ten(10.0**end) if self.is_logarithmic else f"{end:g}" for end in ends]
        return [(_AIR, words[0]), (1.0 - _AIR, words[1])]


def draw_line_up(runs: Sequence[Lined], title: str) -> Figure:
    """Errors of position, orientation and internal force on logarithmic scales, and the friction use.

    A cross marks where an incomplete run stopped.

    Args:
        runs: each a row; one without samples has its name alone.
        title: heading of the figure.
    """
    row = min(_TALLEST, max(_LEAST, _ALL / max(len(runs), 1)))
    with rc_context(STYLE):
        figure = new_figure(1.55 + row * len(runs))
        room = draw_note(figure, _NOTE, 0.34)
        draw_title(figure, title)
        place = figure.add_gridspec(1, len(_COLUMNS), left=0.21, right=0.985, top=from_top(figure, 0.72 + room),
                                    bottom=0.42 / float(figure.get_figheight()), wspace=0.24)  # fmt: skip
        for k, label in enumerate(_COLUMNS):
            axes = panel(figure, place[k], "", label, bottom=True)
            _draw_column(axes, runs, k)
        _name_rows(figure.axes[0], runs)
        finish(figure, max((float(run.time[-1]) for run in runs if len(run.time)), default=1.0))
    return figure


def _draw_column(axes: Axes, runs: Sequence[Lined], k: int) -> None:
    """One quantity of all runs, each in its row, the first on top."""
    curves = [np.nan_to_num(run[2 + k], posinf=FRICTION_TOP) for run in runs]
    scale = _scale_of(curves, is_logarithmic=k < 3)
    count = len(runs)
    lines = [
        np.column_stack([run.time, scale(values)])[_some(len(run.time))]
        for run, values in zip(runs, curves, strict=True)
    ]
    axes.set_ylim(0.0, count)
    axes.grid(False, axis="y")
    grey = [_lifted(line, count - 1 - n) for n in range(count) for m, line in enumerate(lines) if m != n]
    axes.add_collection(LineCollection(grey, colors="0.85", linewidths=0.7, zorder=1), autolim=False)
    ends = []
    for n, (run, line, values) in enumerate(zip(runs, lines, curves, strict=True)):
        base, color = count - 1 - n, finger_color(n)
        if n:
            axes.axhline(base + 1.0, color="0.6", lw=0.6, zorder=0)
        if k == 3:
            axes.axhline(base + float(scale(np.ones(1))[0]), color="black", lw=0.7, ls=DASHED, zorder=1)
        if n in (0, count - 1):
            ends += [(base + height, word) for height, word in scale.marks()]
        if len(line):
            _draw_run(axes, run, _lifted(line, base), float(values[-1]), color)
    axes.set_yticks([height for height, _ in ends], [word for _, word in ends])


def _some(count: int) -> NDArray[np.int64]:
    """Samples that are drawn, the last one with them."""
    every = np.arange(0, count, max(count // _MOST_POINTS, 1))
    return np.append(every, count - 1) if count and every[-1] != count - 1 else every


def _lifted(line: Array, base: float) -> Array:
    """A curve, points of time and height, in the row that begins at a height."""
    higher: Array = line + np.array([0.0, base])
    return higher


def _draw_run(axes: Axes, run: Lined, line: Array, last: float, color: str) -> None:
    """The curve of a run in its row, its last value, and a cross where it stopped too early."""
    axes.plot(*line.T, color=color, lw=1.6, zorder=3)
    if not run.complete:
        axes.plot(*line[-1:].T, "x", color=WARNING, ms=6, mew=2, clip_on=False, zorder=ON_TOP)
    share = line[-1, 1] % 1.0
    axes.annotate(f"{last:.2g}", line[-1], (-2.0, 3.0 if share < 0.5 else -3.0), textcoords="offset points", size=7.5,
                  color=color, ha="right", va="bottom" if share < 0.5 else "top", zorder=ON_TOP,
                  path_effects=[_HALO])  # fmt: skip


def _scale_of(curves: Sequence[Array], is_logarithmic: bool) -> _Scale:
    """Whole decades around all errors; from 0 to a little above 1 for a friction use."""
    largest = max((float(values.max()) for values in curves if len(values)), default=1.0)
    if not is_logarithmic:
        return _Scale(0.0, round(min(max(1.2, largest), FRICTION_TOP), 1), False)
    top = np.ceil(np.log10(max(largest, 10.0 * _SMALLEST)))
    return _Scale(np.log10(_SMALLEST), float(top), True)


def _lines_of(name: str) -> list[str]:
    """A name in short lines, broken where it has a blank, a bracket or an underscore."""
    parts = name.replace("(", " (").replace("  ", " ").replace("_", "_ ")
    lines = textwrap.wrap(parts, _NAME_WIDTH, max_lines=4, placeholder=" …")
    return [line.replace("_ ", "_") for line in lines]


def _name_rows(axes: Axes, runs: Sequence[Lined]) -> None:
    """The name of each run beside its row, in its colour."""
    for n, run in enumerate(runs):
        words = "\n".join(_lines_of(run.label))
        axes.annotate(words, (0.0, len(runs) - n - 0.5), (-30.0, 0.0), xycoords=axes.get_yaxis_transform(),
                      textcoords="offset points", color=finger_color(n), weight="bold", size=7.5, ha="right",
                      va="center", annotation_clip=False)  # fmt: skip
