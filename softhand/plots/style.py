"""What all figures share: one style, panels, legends, and saving by file name."""

from __future__ import annotations

import io
import os
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from softhand.errors import RecordingError, SofthandError
from softhand.numerics.arrays import Array
from softhand.recording.recording import Recording
from softhand.recording.whole_file import write_whole

FORMATS = ("png", "pdf", "svg")
"""Endings that `save_figure` takes."""

FINGERS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00")
"""One colour a finger, safe for the colour-blind [Okabe, Ito]; a sixth finger starts again."""

TARGETS = (("#0072B2", "#56B4E9"), ("#D55E00", "#E69F00"), ("#009E73", "#7CCBB2"))
"""Two colours a target: with compensation and without."""

SOLID, DASH_DOTTED, DASHED = "-", (0, (5, 1.5, 1, 1.5)), (0, (4, 2))
OBJECT, WARNING = "#56B4E9", "#A50026"
ON_TOP = 10  # zorder of desired values
FRICTION_TOP = 3.0  # friction use above this is cut off
_FAST_PNG = {"compress_level": 1}  # a fifth larger, twice as fast
_SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")  # plain text: math text takes a quarter of the time of a figure
_LABEL_DISTANCE = 0.45  # [in] from an axis to its label
_WIDTH = 9.0  # [in], 900 px in a README
DEGREES = 180.0 / np.pi
ROUNDING = 1e-9  # [s]

OBJECT_ARRAYS = tuple(
    f"{name}{kind}" for name in ("object_position", "object_rpy", "internal_force") for kind in ("", "_desired")
)

CONTACT_ARRAYS = ("contact_force", "deformation", "contact_angles", "friction_use", "joint_torque", "torque_limited")

STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 9.0,
    "axes.titleweight": "bold",
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "savefig.dpi": 150,
    "svg.fonttype": "none",
    "svg.hashsalt": "softhand",
    "pdf.fonttype": 42,
}


class _Quantity(NamedTuple):
    """A column: values and desired values, shape (samples, n), a label for each, and the least span of an axis."""

    title: str
    values: Array
    desired: Array
    labels: tuple[str, ...]
    unit: str
    least: float


def save_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure, whole or not at all; text stays text in PDF and SVG.

    Args:
        figure: what to write.
        path: file to write, its format by its ending: .png, .pdf or .svg; an older one is replaced.

    Raises:
        SofthandError: another ending. Carries `.value`.
        RecordingError: the file cannot be written.
    """
    ending = figure_format(Path(path))
    write_whole(Path(path), lambda: _encode(figure, ending))


def figure_format(path: Path) -> str:
    """png, pdf or svg, by the ending of a file's name; SofthandError for another."""
    ending = path.suffix.lower().removeprefix(".")
    if ending not in FORMATS:
        got = f"has the unknown ending {path.suffix!r}" if ending else "has no ending"
        allowed = ", ".join(f".{name}" for name in FORMATS)
        raise SofthandError(f"{path}: the name of the figure {got}; choose one of {allowed}.", value=path.suffix)
    return ending


def _encode(figure: Figure, ending: str) -> bytes:
    options: dict[str, dict[str, Any]] = {
        "png": {"pil_kwargs": _FAST_PNG},
        "pdf": {"metadata": {"CreationDate": None}},
        "svg": {"metadata": {"Date": None}},
    }
    buffer = io.BytesIO()
    with rc_context(STYLE):
        figure.savefig(buffer, format=ending, **options[ending])
    return buffer.getvalue()


def quantities(recording: Recording) -> tuple[_Quantity, ...]:
    """Position, orientation and internal force."""
    pairs = tuple(f"f{pair.translate(_SUBSCRIPTS)}" for pair in recording.labels.get("pair", ()))
    table = (
        ("Position", "object_position", 1e3, ("x", "y", "z"), "mm", 1.0),
        ("Orientation", "object_rpy", DEGREES, ("roll", "pitch", "yaw"), "deg", 1.0),
        ("Internal force", "internal_force", 1.0, pairs, "N", 0.5),
    )
    return tuple(
        _Quantity(title, scale * recording[name], scale * recording[f"{name}_desired"], labels, unit, least)
        for title, name, scale, labels, unit, least in table
    )


def check(recording: Recording, *names: str) -> None:
    """Refuse a recording that lacks an array, by the name of the array."""
    missing = [name for name in names if name not in recording.variables]
    if missing:
        raise RecordingError(f"The recording cannot be drawn: it has no {', '.join(missing)}.")


def new_figure(height: float) -> Figure:
    """An empty figure of the common width and a height [in]."""
    figure = Figure(figsize=(_WIDTH, height), facecolor="white")
    FigureCanvasAgg(figure)
    return figure


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
    axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
    axes.tick_params(labelbottom=bottom)
    if bottom:
        axes.set_xlabel("time [s]")
    return axes


def plot_fingers(axes: Axes, time: Array, values: Array, fingers: Sequence[int]) -> None:
    """One line a finger in its colour; values have the shape (samples, fingers)."""
    for finger, column in zip(fingers, values.T, strict=True):
        axes.plot(time, column, color=FINGERS[finger % len(FINGERS)])


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


def from_top(figure: Figure, inches: float) -> float:
    """Height in the figure, 0 to 1, of a distance from its top [in]."""
    return 1.0 - inches / float(figure.get_figheight())


def draw_title(figure: Figure, title: str, *warnings: str, room: float = 0.0) -> float:
    """Title and warnings, with room for a legend between them, and more [in]; returns where the axes may begin."""
    figure.text(0.012, from_top(figure, 0.1), textwrap.shorten(title, 90), weight="bold", size=11, va="top")
    lines = [line for warning in warnings if warning for line in textwrap.wrap(warning, 145)]
    figure.text(0.012, from_top(figure, 0.56 + room), "\n".join(lines), color=WARNING, va="top")
    return from_top(figure, 0.82 + room + 0.14 * len(lines))


def draw_legend(figure: Figure, handles: list[Line2D], height: float, loc: Any, handlelength: float = 2.4) -> None:
    """One line of legend whose corner `loc` is at the side of the figure, at a height (0 to 1)."""
    corner = (0.012 if loc.endswith("left") else 0.988, height)
    legend = figure.legend(handles=handles, loc=loc, bbox_to_anchor=corner, ncols=len(handles),
                           handlelength=handlelength, columnspacing=1.4, borderpad=0.2, borderaxespad=0.0)  # fmt: skip
    legend.set_zorder(ON_TOP)


def finish(figure: Figure, end: float) -> None:
    """One time axis for all, and the labels of each column in line.

    The labels are put where they are: letting matplotlib align them takes a third of the time of a figure.
    """
    width = float(figure.get_figwidth())
    for axes in figure.axes:
        axes.set_xlim(0.0, end)
        axes.yaxis.set_label_coords(-_LABEL_DISTANCE / (width * axes.get_position().width), 0.5)
