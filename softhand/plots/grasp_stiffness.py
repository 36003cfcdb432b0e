"""How a held object gives way, on paper: ellipsoids of its compliance, from any side."""

from __future__ import annotations

import math

import numpy as np
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from softhand.assembly.probe import recorded_scenario
from softhand.assembly.resolve import resolve
from softhand.closed_loop.grasp_stiffness import GraspStiffness
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.plots.grasp_object import draw_object, hulls_of
from softhand.plots.panels import draw_legend, draw_title, from_top, new_figure
from softhand.plots.style import STYLE, finger_color
from softhand.plots.view import View, draw_arrow, name_axis, view_from
from softhand.recording.recording import Recording

SHIFT, TURN = "#7B3FA0", "#A8155F"
"""Colours of translation and rotation."""
_TURN_STYLE = (0, (4, 2))


def draw_ellipsoids(axes: Axes, view: View, found: GraspStiffness, longest: float) -> None:
    """Outline and principal axes of both ellipsoids about the origin of the object.

    The radius along a direction of a principal axis is its compliance: how far the object gives way to a force of the
    same size, and how far a couple of the same size turns it. Each has its own scale, its softest axis is the longest.

    Args:
        axes: where to.
        view: from where.
        found: of the object.
        longest: semi-axis [mm].
    """
    middle = 1e3 * found.position
    for values, ways, color, style in (
        (found.translation, found.translation_directions, SHIFT, "-"),
        (found.rotation, found.rotation_directions, TURN, _TURN_STYLE),
    ):
        semi = semi_axes(values, longest)
        if semi is None:
            continue
        outline, place = ellipse_of(semi, ways @ np.stack([view.right, view.up], axis=1)), view.flat(middle)
        axes.fill(*(place + outline).T, color=color, alpha=0.10, lw=0.0, zorder=11.0)
        axes.plot(*(place + outline).T, color=color, lw=1.3, ls=style, zorder=11.1)
        for length, way in zip(semi, ways, strict=True):
            ends = view.flat(middle + np.outer([-length, length], way))
            axes.plot(*ends.T, color=color, lw=0.9, ls=style, zorder=11.2)


def semi_axes(stiffness: Array, longest: float) -> Array | None:
    """Semi-axes of a compliance from principal stiffnesses, shape (3,); None where one is not above zero."""
    if not np.all(stiffness > 0.0):
        return None
    semi: Array = longest * np.min(stiffness) / stiffness
    return semi


def ellipse_of(semi: Array, flat: Array) -> Array:
    """The outline of an ellipsoid on paper about its middle, shape (n, 2).

    Args:
        semi: its semi-axes, shape (3,).
        flat: their directions on paper, shape (3, 2).
    """
    matrix = (flat * semi[:, None] ** 2).T @ flat
    values, ways = np.linalg.eigh(matrix)
    a = np.linspace(0.0, 2.0 * math.pi, 121)
    circle = np.column_stack([np.cos(a), np.sin(a)])
    outline: Array = circle * np.sqrt(np.maximum(values, 0.0)) @ ways.T
    return outline


def handles(found: GraspStiffness) -> list[Artist]:
    """Lines of the legend, with the softest of each."""
    shift, turn = found.translation, found.rotation
    named = [
        (shift, SHIFT, "-", f"gives way to a force, softest {1e-3 * shift[0]:.3g} N/mm"),
        (turn, TURN, _TURN_STYLE, f"turns by a couple, softest {turn[0]:.3g} N m/rad"),
    ]
    return [
        Line2D([], [], color=color, ls=style, lw=1.3, label=label)
        for values, color, style, label in named
        if np.all(values > 0.0)
    ]


def draw_stiffness(recording: Recording, found: GraspStiffness, title: str) -> Figure:
    """Three views of the object at the time of a stiffness, the forces of the tips, and both ellipsoids.

    Args:
        recording: of the run.
        found: of one of its samples.
        title: of the figure.
    """
    k = int(np.argmin(np.abs(recording.time - found.time)))
    rotation = rotation_of(recording.object_rpy[k])
    world = resolve(recorded_scenario(recording)).world
    hulls, gravity = hulls_of(world.shape), world.gravity
    force = np.einsum("kij,kj->ki", recording.contact_rotation[k], recording.contact_force[k, :, :3])
    size = 1e3 * found.length
    scale = 0.75 * size / max(float(np.max(np.linalg.norm(force, axis=1))), 1e-9)
    with rc_context(STYLE):
        figure = new_figure(4.2)
        top = draw_title(figure, title, "") - 0.05
        draw_legend(figure, handles(found), from_top(figure, 0.34), loc="upper left")
        grid = figure.add_gridspec(1, 3, left=0.055, right=0.985, top=top, bottom=0.12, wspace=0.28)
        for column, (name, azimuth, elevation) in enumerate(_SIDES):
            axes = figure.add_subplot(grid[0, column])
            view = view_from(azimuth, elevation, gravity, 1e3 * found.position)
            draw_object(axes, view, hulls, found.position, rotation)
            for i, (point, push) in enumerate(zip(1e3 * recording.contact_point[k], force, strict=True)):
                draw_arrow(axes, view.flat(point), view.flat(point + scale * push), "0.12")
                axes.plot(*view.flat(point), "o", color=finger_color(i), ms=5.0, zorder=11.5)
            draw_ellipsoids(axes, view, found, 1.1 * size)
            axes.set_title(name, loc="left")
            name_axis(axes.xaxis, view.right, "to the right")
            name_axis(axes.yaxis, view.up, "upwards")
            axes.set_aspect("equal", adjustable="datalim")
    return figure


_SIDES = (("obliquely", -62.0, 22.0), ("from the front", -90.0, 0.0), ("from above", -90.0, 90.0))
