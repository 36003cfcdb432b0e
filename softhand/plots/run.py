"""The figure of one run: object against desired, contacts, joint torques."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import takewhile
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D

from softhand.numerics.arrays import Array
from softhand.plots.style import (
    CONTACT_ARRAYS,
    DASHED,
    DEGREES,
    FINGERS,
    FRICTION_TOP,
    OBJECT,
    OBJECT_ARRAYS,
    ON_TOP,
    STYLE,
    WARNING,
    check,
    desired_handle,
    draw_legend,
    draw_title,
    finish,
    from_top,
    new_figure,
    panel,
    plot_desired,
    plot_fingers,
    quantities,
    split,
    warn,
    widen,
)
from softhand.recording.events import find_events, phases_of
from softhand.recording.recorded import is_coulomb, scenario_of
from softhand.recording.recording import Recording


def draw_run(recording: Recording) -> Figure:
    """All of one run: pose and internal force against their desired values, then contacts and joint torques.

    Args:
        recording: with any number of contacts and joints. If it is incomplete, the figure says where and why.

    Raises:
        RecordingError: an array that the figure shows is not in the recording.
    """
    check(recording, *OBJECT_ARRAYS, *CONTACT_ARRAYS)
    with rc_context(STYLE):
        figure = new_figure(11.4)
        scenario = scenario_of(recording)
        top = _draw_head(figure, recording, scenario)
        grid = figure.add_gridspec(2, 1, height_ratios=(3.1, 6.6), left=0.075, right=0.98, top=top, bottom=0.04,
                                   hspace=0.15)  # fmt: skip
        _draw_object(figure, grid[0], recording)
        _draw_contacts(figure, grid[1], recording)
        finish(figure, _time_shown(recording, scenario))
        _mark_phases(figure, recording)
        if not recording.complete:
            _mark_stop(figure, recording.stop_time)
    return figure


def _draw_object(figure: Figure, place: SubplotSpec, recording: Recording) -> None:
    """One column a quantity, one axes a component; more than three pairs of contacts share three axes."""
    for quantity, column in zip(quantities(recording), split(place, 1, 3, wspace=0.31), strict=True):
        groups = np.array_split(np.arange(len(quantity.labels)), min(len(quantity.labels), 3))
        for row, (group, spot) in enumerate(zip(groups, split(column, len(groups), 1, hspace=0.2), strict=True)):
            label = quantity.labels[group[0]] if len(group) == 1 else "f"
            axes = panel(
                figure, spot, f"{label} [{quantity.unit}]", "" if row else quantity.title, row == len(groups) - 1
            )
            for k, member in enumerate(group):
                color = OBJECT if len(group) == 1 else FINGERS[k % len(FINGERS)]
                axes.plot(
                    recording.time, quantity.values[:, member], color=color, lw=1.8, label=quantity.labels[member]
                )
                plot_desired(axes, recording.time, quantity.desired[:, member])
            if len(group) > 1:
                curves = axes.lines[::2]
                axes.legend(handles=curves, ncols=4, fontsize=7, handlelength=0.9, handletextpad=0.3, columnspacing=0.7,
                            borderpad=0.0, loc="lower right", bbox_to_anchor=(1.0, 0.97))  # fmt: skip
            widen(axes, quantity.least)


def contact_quantities(recording: Recording) -> tuple[tuple[str, str, Array, float], ...]:
    """Of each panel about the contacts: name, unit, values of shape (samples, nc), and the least span of its axis."""
    force, deformation = recording["contact_force"], recording["deformation"]
    return (
        ("normal force", "N", force[:, :, 2], 0.5),
        ("tangential force", "N", np.hypot(force[:, :, 0], force[:, :, 1]), 0.5),
        ("torsion moment", "N mm", 1e3 * force[:, :, 3], 1.0),
        ("friction use", "-", recording["friction_use"], 0.5),
        ("deformation δr", "mm", 1e3 * deformation[:, :, 0], 0.5),
        ("latitude Φ", "deg", DEGREES * recording["contact_angles"][:, :, 1], 1.0),
        ("deformation δθ", "deg", DEGREES * deformation[:, :, 1], 1.0),
        ("deformation δφ", "deg", DEGREES * deformation[:, :, 2], 1.0),
        ("deformation δψ", "deg", DEGREES * deformation[:, :, 3], 1.0),
    )


def _draw_contacts(figure: Figure, place: SubplotSpec, recording: Recording) -> None:
    """One panel a quantity, one colour a finger; the joint torques below."""
    upper, lower = split(place, 2, 1, height_ratios=(3.35, 1.0), hspace=0.13)
    _draw_fingers_legend(figure, recording.labels["contact"], upper)
    for k, ((name, unit, values, least), spot) in enumerate(
        zip(contact_quantities(recording), split(upper, 3, 3, wspace=0.31, hspace=0.16), strict=True)
    ):
        axes = panel(figure, spot, f"{name} [{unit}]", "" if k else "Contacts")
        plot_fingers(axes, recording.time, values, range(values.shape[1]))
        widen(axes, least)
        if name == "friction use":
            shown = values
            if is_coulomb(recording):
                shown = recording["limit_surface_use"]
                axes.set_ylabel("use, coupled dotted [-]")
                _add_coupled(axes, recording, shown)
            _mark_friction(axes, recording.time, shown if is_coulomb(recording) else np.maximum(values, shown))
    _draw_torques(figure, lower, recording)


_ROUNDED = 1e-9  # a tip that slips is on the limit
_MARKS = {
    "slip": "v",
    "torsional slip": "s",
    "slip ends": "|",
    "lift-off": "x",
    "touch": "o",
    "edge": "^",
    "vertex": "D",
}


def _add_coupled(axes: Axes, recording: Recording, use: Array) -> None:
    """The use of the limit surface, dotted, and a mark on the limit for each event at a contact."""
    events = find_events(recording)
    for i, finger in enumerate(recording.labels["contact"]):
        color = FINGERS[i % len(FINGERS)]
        axes.plot(recording.time, use[:, i], color=color, lw=1.0, ls=":")
        for kind, mark in _MARKS.items():
            times = [event.time for event in events if (event.kind, event.finger) == (kind, finger)]
            axes.plot(times, np.ones(len(times)), mark, color=color, ms=4, zorder=ON_TOP)


def _mark_friction(axes: Axes, time: Array, use: Array) -> None:
    """Draw the limit 1, cut the axis off above `FRICTION_TOP`, and fill what is above 1."""
    highest = float(np.max(np.nan_to_num(use, posinf=np.inf), initial=0.0))
    axes.set_ylim(0.0, min(max(1.15 * highest, 1.2), FRICTION_TOP))
    axes.axhline(1.0, color="black", lw=0.8, ls=DASHED)
    if highest > 1.0 + _ROUNDED:
        worst = np.minimum(np.max(use, axis=1), 2.0 * FRICTION_TOP)
        axes.fill_between(time, 1.0, worst, where=worst > 1.0, color=WARNING, alpha=0.3, lw=0)
        reached = "no normal force" if np.isinf(highest) else f"up to {highest:.3g}"
        warn(axes, f"above 1: {reached}")


def _draw_torques(figure: Figure, place: SubplotSpec, recording: Recording) -> None:
    """One panel for the first joint of each finger, one for the second, and so on."""
    torque, limited = recording["joint_torque"], recording["torque_limited"].astype(bool)
    hand = joints_of_fingers(recording.labels["joint"], recording.labels["contact"])
    ranks = max(map(len, hand))
    for k, spot in enumerate(split(place, 1, ranks, wspace=0.31 + 0.1 * (ranks > 3))):
        axes = panel(figure, spot, f"torque, joint {k + 1} [N m]", bottom=True, title="" if k else "Joints")
        fingers = [finger for finger, joints in enumerate(hand) if k < len(joints)]
        joints = [hand[finger][k] for finger in fingers]
        plot_fingers(axes, recording.time, torque[:, joints], fingers)
        widen(axes, 0.1)
        _mark_limits(axes, recording.time, torque[:, joints], limited[:, joints])


def _mark_limits(axes: Axes, time: Array, torque: Array, limited: npt.NDArray[np.bool_]) -> None:
    """Dots where an effort limit cut a torque, and a line at that limit."""
    if not limited.any():
        return
    for column, cut in zip(torque.T, limited.T, strict=True):
        axes.plot(time[cut], column[cut], ".", color=WARNING, ms=3, zorder=ON_TOP)
    for limit in np.unique(np.round(torque[limited], 9)):
        axes.axhline(limit, color=WARNING, lw=0.8, ls=DASHED)
    warn(axes, "effort limit reached")


def joints_of_fingers(joints: Sequence[str], tips: Sequence[str]) -> list[list[int]]:
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
    draw_legend(figure, handles, place.get_position(figure).y1 + 0.005, loc="lower right")


def _draw_head(figure: Figure, recording: Recording, scenario: dict[str, Any]) -> float:
    """Title, settings, legend of the upper part, why an incomplete run stopped; returns where the axes may begin."""
    handles = [Line2D([], [], color=OBJECT, lw=1.8, label="object"), desired_handle()]
    draw_legend(figure, handles, from_top(figure, 0.34), loc="upper right")
    names = ", ".join(f"{k} {name}" for k, (name, _, _) in enumerate(phases_of(recording), start=1))
    figure.text(0.012, from_top(figure, 0.36), settings_line(scenario), color="0.35", va="top")
    if names:
        figure.text(0.012, from_top(figure, 0.53), f"phases: {names}", color="0.35", va="top")
    stop = "" if recording.complete else f"Incomplete, stopped at {recording.stop_time:g} s: {recording.reason}"
    return draw_title(figure, scenario.get("description") or "softhand run", stop, room=0.17 if names else 0.0)


def settings_line(scenario: dict[str, Any]) -> str:
    """What a scenario runs with, in a line."""
    plugins = {name: scenario.get(name, {}) for name in ("controller", "reference", "stepper")}
    return ", ".join(f"{name} {table.get('name', table.get('kind'))}" for name, table in plugins.items() if table)


def _mark_phases(figure: Figure, recording: Recording) -> None:
    """Every other phase of the reference a little darker, its number at the top."""
    for axes in figure.axes:
        for k, (_, begin, end) in enumerate(phases_of(recording), start=1):
            if k % 2:
                axes.axvspan(begin, end, color="0.5", alpha=0.1, lw=0, zorder=0)
            axes.text(0.5 * (begin + end), 0.99, str(k), transform=axes.get_xaxis_transform(), color="0.5", fontsize=6,
                      ha="center", va="top")  # fmt: skip


def _time_shown(recording: Recording, scenario: dict[str, Any]) -> float:
    """Duration of the run [s], less if it stopped so early that its curves would be slivers."""
    duration = float(scenario.get("duration", recording.stop_time))
    return min(duration, 4.0 * recording.stop_time) or duration or 1.0


def _mark_stop(figure: Figure, time: float) -> None:
    for axes in figure.axes:
        axes.axvline(time, color=WARNING, lw=1.0, ls=DASHED)
