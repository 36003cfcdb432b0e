"""The contacts and joints in the figure of a run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D

from softhand.numerics.arrays import Array
from softhand.plots.panels import draw_legend, panel, plot_fingers, split, warn, widen
from softhand.plots.quantities import (
    BEYOND_LIMIT,
    FRICTION_TOP,
    contact_quantities,
    finger_name,
    joints_of_fingers,
    torque_and_unit,
)
from softhand.plots.style import DASHED, ON_TOP, WARNING, finger_color
from softhand.recording.events import find_events
from softhand.recording.recorded import is_coulomb
from softhand.recording.recording import Recording

_MARKS = {
    "slip": "v",
    "torsional slip": "s",
    "slip ends": "|",
    "lift-off": "x",
    "touch": "o",
    "edge": "^",
    "vertex": "D",
}


def draw_contacts(figure: Figure, place: SubplotSpec, recording: Recording) -> None:
    """One panel a quantity, one colour a finger; the joint torques below."""
    upper, lower = split(place, 2, 1, height_ratios=(3.35, 1.0), hspace=0.13)
    _draw_legend(figure, recording.labels["contact"], upper)
    spots = split(upper, 3, 3, wspace=0.31, hspace=0.16)
    for k, (quantity, spot) in enumerate(zip(contact_quantities(recording), spots, strict=True)):
        axes = panel(figure, spot, f"{quantity.name} [{quantity.unit}]", "" if k else "Contacts")
        plot_fingers(axes, recording.time, quantity.values, range(quantity.values.shape[1]))
        widen(axes, quantity.least)
        if quantity.name == "friction use":
            _finish_friction(axes, recording)
    _draw_torques(figure, lower, recording)


def _finish_friction(axes: Axes, recording: Recording) -> None:
    """The limit, and the use of the limit surface of force and torsion, if it is recorded."""
    use = recording["friction_use"]
    if "limit_surface_use" in recording.variables:
        coupled = recording["limit_surface_use"]
        use = coupled if is_coulomb(recording) else np.fmax(use, coupled)
        axes.text(0.02, 0.03, "dotted: with torsion", transform=axes.transAxes, size=7.5, color="0.3",
                  bbox={"facecolor": "white", "alpha": 0.8, "lw": 0, "pad": 1.0}, zorder=ON_TOP)  # fmt: skip
        _add_coupled(axes, recording, coupled)
    _mark_friction(axes, recording, use)


def _add_coupled(axes: Axes, recording: Recording, use: Array) -> None:
    """The use of the limit surface, dotted; where friction has a limit, a mark on it for each event at a contact."""
    events = find_events(recording) if is_coulomb(recording) else []
    for i, finger in enumerate(recording.labels["contact"]):
        color = finger_color(i)
        axes.plot(recording.time, use[:, i], color=color, lw=1.0, ls=":")
        for kind, mark in _MARKS.items():
            times = [event.time for event in events if (event.kind, event.finger) == (kind, finger)]
            axes.plot(times, np.ones(len(times)), mark, color=color, ms=4, zorder=ON_TOP)


def _mark_friction(axes: Axes, recording: Recording, use: Array) -> None:
    """Draw the limit 1, cut the axis off above `FRICTION_TOP`, fill what is above 1 and say where that was."""
    known = np.nan_to_num(use, posinf=np.inf)
    highest = float(np.max(known, initial=0.0))
    axes.set_ylim(0.0, min(max(1.15 * highest, 1.2), FRICTION_TOP))
    axes.axhline(1.0, color="black", lw=0.8, ls=DASHED)
    if highest > BEYOND_LIMIT:
        time, worst = recording.time, np.minimum(np.max(use, axis=1), 2.0 * FRICTION_TOP)
        axes.fill_between(time, 1.0, worst, where=worst > 1.0, color=WARNING, alpha=0.3, lw=0)
        sample, contact = np.unravel_index(int(np.argmax(known)), known.shape)
        reached = "no normal force" if np.isinf(highest) else f"{highest:.3g}"
        where = f"{finger_name(recording.labels['contact'][contact])}, {time[sample]:.3g} s"
        warn(axes, f"above 1 a real tip slips: {reached} ({where})")


def _draw_torques(figure: Figure, place: SubplotSpec, recording: Recording) -> None:
    """One panel for the first joint of each finger, one for the second, and so on."""
    torque, limited = recording["joint_torque"], recording["torque_limited"].astype(bool)
    hand = joints_of_fingers(recording.labels["joint"], recording.labels["contact"])
    ranks = max(map(len, hand))
    for k, spot in enumerate(split(place, 1, ranks, wspace=0.31 + 0.1 * (ranks > 3))):
        fingers = [finger for finger, joints in enumerate(hand) if k < len(joints)]
        joints = [hand[finger][k] for finger in fingers]
        what, unit = torque_and_unit(recording, joints)
        axes = panel(figure, spot, f"{what}, joint {k + 1} [{unit}]", bottom=True, title="" if k else "Joints")
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


def _draw_legend(figure: Figure, tips: Sequence[str], place: SubplotSpec) -> None:
    handles = [Line2D([], [], color=finger_color(k), lw=1.8, label=finger_name(tip)) for k, tip in enumerate(tips)]
    draw_legend(figure, handles, place.get_position(figure).y1 + 0.012, loc="lower right")
