"""Squeeze by margin, the margin to slip of a run, and the pushes that a grasp survives."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from scipy.spatial import ConvexHull

from softhand.holding.curve import SqueezeCurve
from softhand.holding.margin import SlipMargin
from softhand.holding.push_record import WorstPush
from softhand.plots.panels import draw_legend, draw_note, draw_title, finish, from_top, new_figure, panel
from softhand.plots.style import DASHED, FINGERS, STYLE, WARNING, finger_color

_SQUEEZE_NOTE = (
    "Sum of the normal forces of all tips. Between the two curves some internal forces hold every load with that "
    "margin; where they meet, or end, none holds with more. Good: the cross is between them, with room on both sides."
)
_MARGIN_NOTE = (
    "Above: share of the limit surface of force and torsion that each tip has left. Good: never below the warning. "
    "Below: how long the nearest tip will hold if all goes on as in the last {window:g} s; 0 is slip."
)
_PUSH_NOTE = (
    "Left: the largest push of each direction that is survived, in base axes. Right: the same by size, beside what the "
    "contact forces' linear answer at rest says. Good: the worst push is well above what may happen."
)
_LONGEST = 2.0  # [s] of hold times that are shown


def draw_squeeze(curve: SqueezeCurve, title: str) -> Figure:
    """The least and the largest sum of normal forces that hold, over the margin.

    Args:
        curve: of a grasp and its loads.
        title: of the figure.
    """
    with rc_context(STYLE):
        figure = new_figure(4.2)
        room = draw_note(figure, _SQUEEZE_NOTE, 0.34)
        handles: list[Any] = [
            Line2D([], [], color=FINGERS[0], label="least that holds"),
            Line2D([], [], color=FINGERS[1], label="largest that holds"),
            Line2D([], [], color="black", marker="+", ms=8, mew=1.6, ls="", label="now, at the margin asked for"),
        ]
        draw_legend(figure, handles, from_top(figure, 0.42 + room), loc="upper left")
        top = draw_title(figure, title, room=room) - 0.02
        axes = figure.add_axes((0.075, 0.13, 0.9, top - 0.13))
        share = 100.0 * curve.margin
        axes.plot(share, curve.least, color=FINGERS[0], marker="o", ms=3)
        axes.plot(
            share, np.where(np.isfinite(curve.largest), curve.largest, np.nan), color=FINGERS[1], marker="o", ms=3
        )
        finite = np.isfinite(curve.least) & np.isfinite(curve.largest)
        axes.fill_between(share[finite], curve.least[finite], curve.largest[finite], color=FINGERS[2], alpha=0.12, lw=0)
        axes.plot(100.0 * curve.chosen, curve.present, "+", color="black", ms=9, mew=1.8)
        axes.set_xlabel("margin: share of the limit surface that is left free [%]")
        axes.set_ylabel("sum of normal forces [N]")
        axes.set_xlim(-2.0, 92.0)
        axes.set_ylim(bottom=0.0)
    return figure


def draw_margin(slip: SlipMargin, title: str) -> Figure:
    """The margin of each tip and the hold time over time, with the warnings.

    Args:
        slip: of a run.
        title: of the figure.
    """
    with rc_context(STYLE):
        figure = new_figure(5.4)
        room = draw_note(figure, _MARGIN_NOTE.format(window=slip.window), 0.34)
        handles: list[Any] = [
            *(Line2D([], [], color=finger_color(i), label=name) for i, name in enumerate(slip.contacts)),
            Line2D([], [], color=WARNING, ls=DASHED, label="warning"),
        ]
        draw_legend(figure, handles, from_top(figure, 0.42 + room), loc="upper left")
        top = draw_title(figure, title, room=room)
        grid = figure.add_gridspec(2, 1, left=0.075, right=0.975, top=top - 0.03, bottom=0.09, hspace=0.22)
        above = panel(figure, grid[0], "margin [%]", "Margin to slip")
        for i in range(len(slip.contacts)):
            above.plot(slip.time, 100.0 * slip.margin[:, i], color=finger_color(i))
        above.axhline(100.0 * slip.warning, color=WARNING, ls=DASHED, lw=0.9)
        above.set_ylim(min(-5.0, 105.0 * float(np.nanmin(slip.margin, initial=0.0))), 105.0)
        below = panel(figure, grid[1], "hold time [s]", "Time until slip, as it goes on", bottom=True)
        below.plot(slip.time, np.minimum(slip.hold_time, _LONGEST), color="black")
        below.set_ylim(-0.05 * _LONGEST, 1.05 * _LONGEST)
        below.set_yticks([0.0, 0.5, 1.0, 1.5, 2.0], ["0", "0.5", "1", "1.5", "≥ 2"])
        for event in slip.events:
            color = finger_color(slip.contacts.index(event.finger))
            above.plot(event.time, 100.0 * slip.warning, "v", color=color, ms=6, mec="white", mew=0.5, clip_on=False)
        finish(figure, float(slip.time[-1]))
    return figure


def draw_push(push: WorstPush, title: str) -> Figure:
    """What is survived in each direction, in space and by size.

    Args:
        push: of a grasp.
        title: of the figure.
    """
    with rc_context(STYLE):
        figure = new_figure(5.2)
        room = draw_note(figure, _PUSH_NOTE, 0.34)
        handles: list[Any] = [
            Line2D([], [], color=WARNING, lw=2.0, label="worst"),
            Line2D([], [], color="black", marker="o", ms=3, ls="", label="survived in simulation"),
            Line2D([], [], color=FINGERS[0], marker="_", ms=7, ls="", label="by the linear answer"),
        ]
        draw_legend(figure, handles, from_top(figure, 0.42 + room), loc="upper left")
        top = draw_title(figure, title, room=room)
        height = top - 0.02
        solid = figure.add_axes((0.02, 0.02, 0.46, height - 0.02), projection="3d")
        assert isinstance(solid, Axes3D)
        bar = figure.add_axes((0.03, 0.16, 0.012, height - 0.3))
        _draw_solid(solid, bar, push)
        axes = figure.add_axes((0.575, 0.115, 0.4, height - 0.15))
        _draw_sizes(axes, push)
    return figure


def _draw_solid(axes: Axes3D, bar: Axes, push: WorstPush) -> None:
    points = push.directions * push.sizes[:, None]
    simplices = ConvexHull(push.directions).simplices
    sizes = np.mean(push.sizes[simplices], axis=1)
    colors = ScalarMappable(Normalize(0.0, float(np.max(push.sizes))), "viridis")
    faces = Poly3DCollection(points[simplices], facecolors=colors.to_rgba(sizes), edgecolors="white", lw=0.4, alpha=0.6)
    axes.add_collection3d(faces)
    far = 1.05 * float(np.max(np.abs(points)))
    worst = push.worst_direction * far
    axes.plot(*zip(np.zeros(3), worst, strict=True), color=WARNING, lw=2.0, zorder=20)
    axes.set(xlim=(-far, far), ylim=(-far, far), zlim=(-far, far))
    axes.set_box_aspect((1.0, 1.0, 1.0))
    axes.view_init(elev=22.0, azim=-60.0)
    axes.set_xlabel(f"x [{push.unit}]", labelpad=-2.0)
    axes.set_ylabel(f"y [{push.unit}]", labelpad=-2.0)
    axes.set_zlabel(f"z [{push.unit}]", labelpad=-2.0)
    axes.tick_params(pad=-1.0)
    axes.figure.colorbar(colors, cax=bar)
    bar.set_title(push.unit, loc="left", weight="normal")


def _draw_sizes(axes: Axes, push: WorstPush) -> None:
    order = np.argsort(push.sizes)
    place = np.arange(len(order)) + 1
    axes.plot(place, push.linear[order], "_", color=FINGERS[0], ms=6, mew=1.2)
    axes.plot(place, push.sizes[order], "o", color="black", ms=2.5)
    axes.axhline(push.worst, color=WARNING, lw=1.0)
    axes.annotate(f"worst {push.worst:.3g} {push.unit}", (place[-1], push.worst), (0, 3), textcoords="offset points",
                  ha="right", color=WARNING)  # fmt: skip
    axes.set_xlabel("directions, the worst first")
    axes.set_ylabel(f"largest {push.kind} survived [{push.unit}]")
    finite = push.linear[np.isfinite(push.linear)]
    axes.set_ylim(0.0, 1.1 * float(max(np.max(push.sizes), np.max(finite, initial=0.0))))
    axes.set_xlim(0.0, len(order) + 1.0)
