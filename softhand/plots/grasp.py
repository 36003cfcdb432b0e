"""A grasp at its start: object, fingers, friction cones and forces, obliquely, from the front and from above."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from softhand.closed_loop.grasp_stiffness import GraspStiffness
from softhand.grasping.quality import GraspQuality
from softhand.plots.grasp_fingers import FORCE, ForceScale, Touch, draw_finger, draw_touch
from softhand.plots.grasp_object import Hull, draw_object, hulls_of
from softhand.plots.grasp_stiffness import draw_ellipsoids, handles
from softhand.plots.panels import draw_legend, draw_title, from_top, new_figure
from softhand.plots.style import STYLE, WARNING, finger_color
from softhand.plots.view import View, draw_arrow, name_axis, view_from

_HEIGHT = 6.0  # [in]
_LONGEST = 0.75  # of the longest arrow, over the characteristic length of the object
_WIDEST = 1.1  # of the longest semi-axis of a compliance, likewise
_WEIGHT = "0.45"
_OBLIQUE = -62.0, 22.0  # [deg] azimuth and elevation


def draw_grasp(quality: GraspQuality, title: str, stiffness: GraspStiffness | None = None) -> Figure:
    """Three views of a grasp.

    The height of a friction cone is the normal force and its base is mu times as wide: the arrow of the contact force
    ends inside the base as long as the contact holds.

    Args:
        quality: of a scenario.
        title: of the figure.
        stiffness: of the held object, drawn as ellipsoids of its compliance.
    """
    with rc_context(STYLE):
        figure = new_figure(_HEIGHT)
        warning = "" if quality.refusal is None else f"No grasp at rest: {quality.refusal}"
        draw_legend(figure, _handles(quality), from_top(figure, 0.34), loc="upper left")
        if stiffness is not None:
            draw_legend(figure, handles(stiffness), from_top(figure, 0.58), loc="upper left")
        lines = 1 + len(textwrap.wrap(warning, 145)) if warning else 0
        top = draw_title(figure, title, warning) - 0.02 - 0.004 * lines - (0.03 if stiffness else 0.0)
        grid = figure.add_gridspec(2, 2, width_ratios=(1.75, 1.0), left=0.012, right=0.985, top=top, bottom=0.085,
                                   wspace=0.16, hspace=0.30)  # fmt: skip
        oblique = figure.add_subplot(grid[:, 0])
        hulls, view = hulls_of(quality.shape), _view(quality, *_OBLIQUE)
        _draw(oblique, quality, hulls, view)
        _draw_giving(oblique, quality, stiffness, view)
        _draw_compass(oblique, view)
        _write_figures(oblique, quality)
        front, above = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])
        for axes, name, elevation in ((front, "from the front", 0.0), (above, "from above", 90.0)):
            view = _view(quality, -90.0, elevation)
            _draw(axes, quality, hulls, view)
            _draw_giving(axes, quality, stiffness, view)
            axes.set_title(name, loc="left")
            name_axis(axes.xaxis, view.right, "to the right")
            name_axis(axes.yaxis, view.up, "upwards" if axes is front else "to the back")
            axes.xaxis.labelpad = 1.0
            axes.yaxis.set_label_coords(-0.125, 0.5)
    return figure


def _handles(quality: GraspQuality) -> list[Artist]:
    fingers = [
        Line2D([], [], color=finger_color(i), lw=4.0, label=finger.name.removesuffix("_tip"))
        for i, finger in enumerate(quality.fingers)
    ]
    cone = Patch(facecolor="0.6", alpha=0.35, label="friction cone")
    force = Line2D([], [], color=FORCE, lw=1.6, label="force on the object")
    weight = Line2D([], [], color=_WEIGHT, lw=1.6, label="weight")
    return [*fingers, cone, force, weight]


def _view(quality: GraspQuality, azimuth: float, elevation: float) -> View:
    return view_from(azimuth, elevation, quality.weight, 1e3 * quality.centre_of_mass)


def _draw(axes: Axes, quality: GraspQuality, hulls: Sequence[Hull], view: View) -> None:
    """All of the grasp, from one side."""
    draw_object(axes, view, hulls, quality.position, quality.rotation)
    scale, contacts = _force_scale(quality), quality.contacts
    for i, (finger, line) in enumerate(zip(quality.fingers, quality.fingers_at, strict=True)):
        color, point = finger_color(i), 1e3 * quality.points[i]
        draw_finger(axes, view, 1e3 * line, 1e3 * quality.radius, color)
        draw_touch(axes, view, Touch(point, contacts.normals[i], contacts.friction[i], quality.forces[i]), scale, color)
        if finger.missing or quality.opening:
            gap = view.flat(np.array([1e3 * line[-1], point]))
            axes.plot(*gap.T, color=WARNING if finger.missing else "0.35", ls=(0, (2, 1.5)), lw=1.2, zorder=12)
    middle = view.middle
    draw_arrow(axes, view.flat(middle), view.flat(middle + scale.mm_per_newton * quality.weight), _WEIGHT)
    axes.plot(*view.flat(middle), "o", color=_WEIGHT, ms=3.5, zorder=11)
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    axes.margins(0.04)


def _draw_giving(axes: Axes, quality: GraspQuality, stiffness: GraspStiffness | None, view: View) -> None:
    if stiffness is not None:
        draw_ellipsoids(axes, view, stiffness, _WIDEST * 1e3 * quality.contacts.length)


def _draw_compass(axes: Axes, view: View) -> None:
    """No axes, but their directions."""
    axes.set_axis_off()
    place, size, box = np.array([0.06, 0.085]), 0.085, axes.get_position()
    width, height = axes.get_figure().get_size_inches()  # type: ignore[union-attr]
    ratio = box.width / box.height * width / height
    arrow = {"arrowstyle": "-|>", "lw": 0.9, "color": "0.35", "shrinkA": 0, "shrinkB": 0}
    ways = size * view.flat(np.eye(3)) * np.array([1.0 / ratio, 1.0])
    place -= np.minimum(1.4 * ways.min(axis=0), 0.0) * [0.0, 1.0]
    for name, way in zip("xyz", ways, strict=True):
        (x, y), (label_x, label_y) = place + way, place + 1.28 * way
        axes.annotate("", (x, y), tuple(place), "axes fraction", "axes fraction", arrow)
        axes.text(label_x, label_y, name, transform=axes.transAxes, ha="center", va="center", color="0.35", size=7.5)


def _write_figures(axes: Axes, quality: GraspQuality) -> None:
    """The key figures and the scale of the arrows."""
    closure = f"{quality.margin:.3f} N per newton" if quality.margin > 0.0 else "none"
    lines = [f"force-closure margin {closure},  smallest singular value of G {quality.singular_values[-1]:.2f}"]
    if np.isfinite(quality.forces).all():
        use = max(finger.friction_use for finger in quality.fingers)
        worst = "a contact pulls" if math.isinf(use) else f"largest friction use {use:.2f}"
        lines.append(f"{worst},  arrows {_force_scale(quality).mm_per_newton:.2g} mm a newton")
    elif quality.opening:
        lines.append(f"open start: the tips stand {1e3 * quality.opening:.3g} mm off their contact points")
    axes.text(0.0, -0.02, "\n".join(lines), transform=axes.transAxes, va="top", color="0.25", linespacing=1.5)


def _force_scale(quality: GraspQuality) -> ForceScale:
    largest = float(np.nanmax(np.linalg.norm([*quality.forces, quality.weight], axis=1)))
    longest = _LONGEST * 1e3 * quality.contacts.length
    return ForceScale(longest / max(largest, 1e-9), longest)
