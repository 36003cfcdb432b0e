"""Figures of recordings: one run in all its quantities, and runs against each other as in the paper's Fig. 16.

Drawn on `matplotlib.figure.Figure` without pyplot: no display, no window, no state left behind.
"""

from __future__ import annotations

import io
import os
import sys
import textwrap
from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from softhand.errors import RecordingError, SofthandError
from softhand.recording import Recording, _write_whole

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

Array = npt.NDArray[np.float64]

FORMATS = ("png", "pdf", "svg")
"""Endings that `save_figure` takes."""

FINGERS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00")
"""One colour a finger, safe for the colour-blind [Okabe, Ito]; a sixth finger starts again."""

TARGETS = (("#0072B2", "#56B4E9"), ("#D55E00", "#E69F00"), ("#009E73", "#7CCBB2"))
"""Two colours a target: with compensation and without."""

SOLID, DASH_DOTTED, DASHED = "-", (0, (5, 1.5, 1, 1.5)), (0, (4, 2))

_OBJECT, _WARNING = "#56B4E9", "#A50026"
_ON_TOP = 10  # zorder of desired values
_FRICTION_TOP = 3.0  # friction use above this is cut off
_WIDTH = 9.0  # [in], 900 px in a README
_DEGREES = 180.0 / np.pi
_ROUNDING = 1e-9  # [s]
_OBJECT_ARRAYS = tuple(
    f"{name}{kind}" for name in ("object_position", "object_rpy", "internal_force") for kind in ("", "_desired")
)
_CONTACT_ARRAYS = ("contact_force", "deformation", "contact_angles", "friction_use", "joint_torque", "torque_limited")
_STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "mathtext.fontset": "dejavusans",
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
    "savefig.dpi": 200,
    "svg.fonttype": "none",
    "svg.hashsalt": "softhand",
    "pdf.fonttype": 42,
}


class Compared(NamedTuple):
    """Two runs to one target, with and without compensation of the torsion moments; the label is short, like "A"."""

    label: str
    compensated: Recording
    uncompensated: Recording


class _Quantity(NamedTuple):
    """A column: values and desired values, shape (samples, n), a label for each, and the least span of an axis."""

    title: str
    values: Array
    desired: Array
    labels: tuple[str, ...]
    unit: str
    least: float


def draw_run(recording: Recording) -> Figure:
    """All of one run: pose and internal force against their desired values, then contacts and joint torques.

    Args:
        recording: with any number of contacts and joints. If it is incomplete, the figure says where and why.

    Raises:
        RecordingError: an array that the figure shows is not in the recording.
    """
    _check(recording, *_OBJECT_ARRAYS, *_CONTACT_ARRAYS)
    with rc_context(_STYLE):
        figure = _new_figure(11.4)
        scenario = _scenario_of(recording)
        top = _draw_head(figure, recording, scenario)
        grid = figure.add_gridspec(2, 1, height_ratios=(3.1, 6.6), left=0.075, right=0.98, top=top, bottom=0.04,
                                   hspace=0.15)  # fmt: skip
        _draw_object(figure, grid[0], recording)
        _draw_contacts(figure, grid[1], recording)
        _finish(figure, _time_shown(recording, scenario))
        if not recording.complete:
            _mark_stop(figure, recording.stop_time)
    return figure


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
            _check(run, *_OBJECT_ARRAYS)
    with rc_context(_STYLE):
        figure = _new_figure(7.2)
        top = _draw_comparison_head(figure, pairs, title)
        grid = figure.add_gridspec(1, 3, left=0.075, right=0.975, top=top, bottom=0.065, wspace=0.32)
        for k in range(3):
            _compare_column(figure, grid[k], k, pairs, window)
        _finish(figure, max((run.time[-1] for pair in pairs for run in pair[1:] if len(run)), default=1.0))
    return figure


def save_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure, whole or not at all; text stays text in PDF and SVG.

    Args:
        figure: what to write.
        path: file to write, its format by its ending: .png, .pdf or .svg; an older one is replaced.

    Raises:
        SofthandError: another ending. Carries `.value`.
        RecordingError: the file cannot be written.
    """
    path = Path(path)
    ending = path.suffix.lower().removeprefix(".")
    if ending not in FORMATS:
        got = f"has the unknown ending {path.suffix!r}" if ending else "has no ending"
        allowed = ", ".join(f".{name}" for name in FORMATS)
        raise SofthandError(f"{path}: the name of the figure {got}; choose one of {allowed}.", value=path.suffix)
    _write_whole(path, lambda: _encode(figure, ending))


def _encode(figure: Figure, ending: str) -> bytes:
    undated = {"png": {}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}[ending]
    buffer = io.BytesIO()
    with rc_context(_STYLE):
        figure.savefig(buffer, format=ending, metadata=undated)
    return buffer.getvalue()


# ------------------------------------------------------------------------------------------------------- one run


def _draw_object(figure: Figure, place: SubplotSpec, recording: Recording) -> None:
    """One column a quantity, one axes a component; more than three pairs of contacts share three axes."""
    for quantity, column in zip(_quantities(recording), _split(place, 1, 3, wspace=0.31), strict=True):
        groups = np.array_split(np.arange(len(quantity.labels)), min(len(quantity.labels), 3))
        for row, (group, spot) in enumerate(zip(groups, _split(column, len(groups), 1, hspace=0.2), strict=True)):
            label = quantity.labels[group[0]] if len(group) == 1 else "$f$"
            axes = _panel(
                figure, spot, f"{label} [{quantity.unit}]", "" if row else quantity.title, row == len(groups) - 1
            )
            for k, member in enumerate(group):
                color = _OBJECT if len(group) == 1 else FINGERS[k % len(FINGERS)]
                axes.plot(
                    recording.time, quantity.values[:, member], color=color, lw=1.8, label=quantity.labels[member]
                )
                _plot_desired(axes, recording.time, quantity.desired[:, member])
            if len(group) > 1:
                curves = axes.lines[::2]
                axes.legend(handles=curves, ncols=4, fontsize=7, handlelength=0.9, handletextpad=0.3, columnspacing=0.7,
                            borderpad=0.0, loc="lower right", bbox_to_anchor=(1.0, 0.97))  # fmt: skip
            _widen(axes, quantity.least)


def _draw_contacts(figure: Figure, place: SubplotSpec, recording: Recording) -> None:
    """One panel a quantity, one colour a finger; the joint torques below."""
    force, deformation = recording["contact_force"], recording["deformation"]
    panels = (
        ("normal force [N]", force[:, :, 2], 0.5),
        ("tangential force [N]", np.hypot(force[:, :, 0], force[:, :, 1]), 0.5),
        ("torsion moment [N mm]", 1e3 * force[:, :, 3], 1.0),
        ("friction use [-]", recording["friction_use"], 0.5),
        (r"deformation $\delta r$ [mm]", 1e3 * deformation[:, :, 0], 0.5),
        (r"latitude $\Phi$ [deg]", _DEGREES * recording["contact_angles"][:, :, 1], 1.0),
        (r"deformation $\delta\theta$ [deg]", _DEGREES * deformation[:, :, 1], 1.0),
        (r"deformation $\delta\phi$ [deg]", _DEGREES * deformation[:, :, 2], 1.0),
        (r"deformation $\delta\psi$ [deg]", _DEGREES * deformation[:, :, 3], 1.0),
    )
    upper, lower = _split(place, 2, 1, height_ratios=(3.35, 1.0), hspace=0.13)
    _draw_fingers_legend(figure, recording.labels["contact"], upper)
    for k, ((label, values, least), spot) in enumerate(
        zip(panels, _split(upper, 3, 3, wspace=0.31, hspace=0.16), strict=True)
    ):
        axes = _panel(figure, spot, label, "" if k else "Contacts")
        _plot_fingers(axes, recording.time, values, range(values.shape[1]))
        _widen(axes, least)
        if label.startswith("friction"):
            _mark_friction(axes, recording.time, values)
    _draw_torques(figure, lower, recording)


def _mark_friction(axes: Axes, time: Array, use: Array) -> None:
    """Draw the limit 1, cut the axis off above `_FRICTION_TOP`, and fill what is above 1."""
    highest = float(np.max(np.nan_to_num(use, posinf=np.inf), initial=0.0))
    axes.set_ylim(0.0, min(max(1.15 * highest, 1.2), _FRICTION_TOP))
    axes.axhline(1.0, color="black", lw=0.8, ls=DASHED)
    if highest > 1.0:
        worst = np.minimum(np.max(use, axis=1), 2.0 * _FRICTION_TOP)
        axes.fill_between(time, 1.0, worst, where=worst > 1.0, color=_WARNING, alpha=0.3, lw=0)
        reached = "no normal force" if np.isinf(highest) else f"up to {highest:.3g}"
        _warn(axes, f"above 1: {reached}")


def _draw_torques(figure: Figure, place: SubplotSpec, recording: Recording) -> None:
    """One panel for the first joint of each finger, one for the second, and so on."""
    torque, limited = recording["joint_torque"], recording["torque_limited"].astype(bool)
    hand = _joints_of_fingers(recording.labels["joint"], recording.labels["contact"])
    ranks = max(map(len, hand))
    for k, spot in enumerate(_split(place, 1, ranks, wspace=0.31 + 0.1 * (ranks > 3))):
        axes = _panel(figure, spot, f"torque, joint {k + 1} [N m]", bottom=True, title="" if k else "Joints")
        fingers = [finger for finger, joints in enumerate(hand) if k < len(joints)]
        joints = [hand[finger][k] for finger in fingers]
        _plot_fingers(axes, recording.time, torque[:, joints], fingers)
        _widen(axes, 0.1)
        _mark_limits(axes, recording.time, torque[:, joints], limited[:, joints])


def _mark_limits(axes: Axes, time: Array, torque: Array, limited: npt.NDArray[np.bool_]) -> None:
    """Dots where an effort limit cut a torque, and a line at that limit."""
    if not limited.any():
        return
    for column, cut in zip(torque.T, limited.T, strict=True):
        axes.plot(time[cut], column[cut], ".", color=_WARNING, ms=3, zorder=_ON_TOP)
    for limit in np.unique(np.round(torque[limited], 9)):
        axes.axhline(limit, color=_WARNING, lw=0.8, ls=DASHED)
    _warn(axes, "effort limit reached")


def _joints_of_fingers(joints: Sequence[str], tips: Sequence[str]) -> list[list[int]]:
    """Joints of each finger: those named more like its tip than like any other, else equal shares in their order."""
    hand: list[list[int]] = [[] for _ in tips]
    for k, joint in enumerate(joints):
        alike = [
            sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(joint, tip, strict=False))) for tip in tips
        ]
        if alike.count(max(alike)) > 1:
            return [share.tolist() for share in np.array_split(np.arange(len(joints)), len(tips))]
        hand[alike.index(max(alike))].append(k)
    return hand


def _draw_fingers_legend(figure: Figure, tips: Sequence[str], place: SubplotSpec) -> None:
    handles = [
        Line2D([], [], color=FINGERS[k % len(FINGERS)], lw=1.8, label=tip.removesuffix("_tip").replace("_", " "))
        for k, tip in enumerate(tips)
    ]
    _draw_legend(figure, handles, place.get_position(figure).y1 + 0.005, loc="lower right")


def _draw_head(figure: Figure, recording: Recording, scenario: dict[str, Any]) -> float:
    """Title, settings, legend of the upper part, why an incomplete run stopped; returns where the axes may begin."""
    plugins = {name: scenario.get(name, {}) for name in ("controller", "reference", "stepper")}
    said = [f"{name} {table.get('name', table.get('kind'))}" for name, table in plugins.items() if table]
    figure.text(0.012, _from_top(figure, 0.36), ", ".join(said), color="0.35", va="top")
    handles = [Line2D([], [], color=_OBJECT, lw=1.8, label="object"), _desired_handle()]
    _draw_legend(figure, handles, _from_top(figure, 0.34), loc="upper right")
    stop = "" if recording.complete else f"Incomplete, stopped at {recording.stop_time:g} s: {recording.reason}"
    return _draw_title(figure, scenario.get("description") or "softhand run", stop)


def _time_shown(recording: Recording, scenario: dict[str, Any]) -> float:
    """Duration of the run [s], less if it stopped so early that its curves would be slivers."""
    duration = float(scenario.get("duration", recording.stop_time))
    return min(duration, 4.0 * recording.stop_time) or duration or 1.0


def _mark_stop(figure: Figure, time: float) -> None:
    for axes in figure.axes:
        axes.axvline(time, color=_WARNING, lw=1.0, ls=DASHED)


# --------------------------------------------------------------------------------------------------- comparison


def _compare_column(figure: Figure, place: SubplotSpec, k: int, pairs: Sequence[Compared], window: float) -> None:
    """Components of one quantity, and below them its mean error."""
    first = _quantities(pairs[0].compensated)[k]
    *spots, last = _split(place, len(first.labels) + 1, 1, hspace=0.17)
    rows = [
        _panel(figure, spot, f"{label} [{first.unit}]", "" if row else first.title)
        for row, (label, spot) in enumerate(zip(first.labels, spots, strict=True))
    ]
    below = _panel(figure, last, f"mean error [{first.unit}]", bottom=True)
    below.set_yscale("log")
    below.set_title(f"mean over the last {window:g} s", loc="right", size=7.5, weight="normal", color="0.35", pad=2.0)
    for pair, colors in zip(pairs, TARGETS, strict=False):
        for run, color, style in ((pair.uncompensated, colors[1], DASH_DOTTED), (pair.compensated, colors[0], SOLID)):
            quantity = _quantities(run)[k]
            error = _mean_error(run.time, quantity.values - quantity.desired, window)
            for axes, values in zip([*rows, below], [*quantity.values.T, error], strict=True):
                axes.plot(run.time, values, color=color, ls=style)
                if not run.complete:
                    axes.plot(run.time[-1:], values[-1:], "x", color=color, ms=6, mew=2, zorder=_ON_TOP + 1)
            for axes, desired in zip(rows, quantity.desired.T, strict=True):
                _plot_desired(axes, run.time, desired)
                if style == SOLID and len(run):
                    axes.annotate(pair.label, (1.02, desired[-1]), xycoords=axes.get_yaxis_transform(), color=color,
                                  weight="bold", va="center", annotation_clip=False)  # fmt: skip
    for axes in rows:
        _widen(axes, first.least)


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
    _draw_legend(figure, [*handles, _desired_handle()], _from_top(figure, 0.34), loc="upper left")
    return _draw_title(figure, title, *stops)


# -------------------------------------------------------------------------------------------------------- parts


def _quantities(recording: Recording) -> tuple[_Quantity, ...]:
    """Position, orientation and internal force."""
    pairs = tuple(f"$f_{{{pair}}}$" for pair in recording.labels.get("pair", ()))
    table = (
        ("Position", "object_position", 1e3, ("$x$", "$y$", "$z$"), "mm", 1.0),
        ("Orientation", "object_rpy", _DEGREES, ("roll", "pitch", "yaw"), "deg", 1.0),
        ("Internal force", "internal_force", 1.0, pairs, "N", 0.5),
    )
    return tuple(
        _Quantity(title, scale * recording[name], scale * recording[f"{name}_desired"], labels, unit, least)
        for title, name, scale, labels, unit, least in table
    )


def _check(recording: Recording, *names: str) -> None:
    missing = [name for name in names if name not in recording.variables]
    if missing:
        raise RecordingError(f"The recording cannot be drawn: it has no {', '.join(missing)}.")


def _scenario_of(recording: Recording) -> dict[str, Any]:
    """The recorded scenario; empty if its text cannot be read."""
    try:
        return tomllib.loads(recording.scenario)
    except ValueError:
        return {}


def _new_figure(height: float) -> Figure:
    figure = Figure(figsize=(_WIDTH, height), facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def _split(place: SubplotSpec, rows: int, columns: int, **spacing: Any) -> list[SubplotSpec]:
    grid = place.subgridspec(rows, columns, **spacing)
    return [grid[row, column] for row in range(rows) for column in range(columns)]


def _panel(figure: Figure, place: SubplotSpec, label: str, title: str = "", bottom: bool = False) -> Axes:
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


def _plot_fingers(axes: Axes, time: Array, values: Array, fingers: Sequence[int]) -> None:
    for finger, column in zip(fingers, values.T, strict=True):
        axes.plot(time, column, color=FINGERS[finger % len(FINGERS)])


def _plot_desired(axes: Axes, time: Array, desired: Array) -> None:
    axes.plot(time, desired, color="black", lw=0.7, zorder=_ON_TOP)


def _desired_handle() -> Line2D:
    return Line2D([], [], color="black", lw=0.7, label="desired")


def _widen(axes: Axes, least: float) -> None:
    """Let the axis span at least `least`, so that rounding errors do not look like motion."""
    low, high = axes.get_ylim()
    if high - low < least:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - 0.5 * least, middle + 0.5 * least)


def _warn(axes: Axes, text: str) -> None:
    axes.set_title(text, loc="right", size=7.5, weight="normal", color=_WARNING, pad=2.0)


def _from_top(figure: Figure, inches: float) -> float:
    return 1.0 - inches / float(figure.get_figheight())


def _draw_title(figure: Figure, title: str, *warnings: str) -> float:
    """Title and warnings, with room for a legend between them; returns where the axes may begin."""
    figure.text(0.012, _from_top(figure, 0.1), textwrap.shorten(title, 90), weight="bold", size=11, va="top")
    lines = [line for warning in warnings if warning for line in textwrap.wrap(warning, 145)]
    figure.text(0.012, _from_top(figure, 0.56), "\n".join(lines), color=_WARNING, va="top")
    return _from_top(figure, 0.82 + 0.14 * len(lines))


def _draw_legend(figure: Figure, handles: list[Line2D], height: float, loc: Any) -> None:
    """One line of legend whose corner `loc` is at the side of the figure, at a height (0 to 1)."""
    corner = (0.012 if loc.endswith("left") else 0.988, height)
    legend = figure.legend(handles=handles, loc=loc, bbox_to_anchor=corner, ncols=len(handles), handlelength=2.4,
                           columnspacing=1.4, borderpad=0.2, borderaxespad=0.0)  # fmt: skip
    legend.set_zorder(_ON_TOP)


def _finish(figure: Figure, end: float) -> None:
    """One time axis for all, and the labels of each column in line."""
    columns: dict[float, list[Axes]] = {}
    for axes in figure.axes:
        axes.set_xlim(0.0, end)
        columns.setdefault(round(axes.get_position().x0, 6), []).append(axes)
    for column in columns.values():
        figure.align_ylabels(column)
