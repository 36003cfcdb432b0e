"""A grasp at its start: object, fingers, friction cones and forces, obliquely, from the front and from above."""

from __future__ import annotations

import math
import textwrap
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch, Patch, Polygon

from softhand.grasping.quality import GraspQuality
from softhand.model.shapes.shape import Shape
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import upright
from softhand.plots.style import FINGERS, OBJECT, STYLE, WARNING, draw_legend, draw_title, from_top, new_figure

_WIDTH, _HEIGHT = 9.0, 6.0  # [in]
_LONGEST = 0.75  # of the longest arrow, over the characteristic length of the object
_WIDEST = 5.0  # mu of a cone as drawn
_ARROW = "0.12"
_WEIGHT = "0.45"
_DIRECTIONS = 3000
_FACE = 0.02  # of the surface: smaller ones are taken for parts of a curved one
_SHARP = math.cos(math.radians(25.0))


class _View(NamedTuple):
    """Unit vectors to the right, upwards and to the eye, in the world."""

    right: Array
    up: Array
    eye: Array

    def flat(self, points: Array) -> Array:
        """Points of the world [mm] on the paper, shape (..., 2)."""
        return points @ np.stack([self.right, self.up], axis=1)

    def depth(self, points: Array) -> float:
        """Where things lie on the way to the eye: a zorder from 1 to 9."""
        return 5.0 + 4.0 * math.tanh(float(np.mean(np.atleast_2d(points) @ self.eye)) / 60.0)


def _view(azimuth: float, elevation: float, quality: GraspQuality) -> _View:
    """As seen with gravity downwards, whatever it is in the world."""
    a, e = math.radians(azimuth), math.radians(elevation)
    right = np.array([-math.sin(a), math.cos(a), 0.0])
    eye = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
    turn = upright(quality.weight)
    return _View(right @ turn, np.cross(eye, right) @ turn, eye @ turn)


def _name(axis: Axis, direction: Array, otherwise: str) -> None:
    """Label an axis of the paper by that of the world which it shows, if it shows one."""
    k = int(np.argmax(np.abs(direction)))
    if abs(direction[k]) < 1.0 - 1e-9:
        axis.set_label_text(f"{otherwise} [mm]")
        return
    axis.set_label_text(f"{'xyz'[k]} [mm]")
    if direction[k] < 0.0:
        axis.set_major_formatter(lambda value, _: f"{0.0 - value:g}".replace("-", "\N{MINUS SIGN}"))


def draw_grasp(quality: GraspQuality, title: str) -> Figure:
    """Three views of a grasp.

    The height of a friction cone is the normal force and its base is mu times as wide: the arrow of the contact force
    ends inside the base as long as the contact holds.

    Args:
        quality: of a scenario.
        title: of the figure.
    """
    with rc_context(STYLE):
        figure = new_figure(_HEIGHT)
        warning = "" if quality.refusal is None else f"No grasp at rest: {quality.refusal}"
        draw_legend(figure, _handles(quality), from_top(figure, 0.34), loc="upper left")
        lines = 1 + len(textwrap.wrap(warning, 145)) if warning else 0
        top = draw_title(figure, title, warning) - 0.02 - 0.004 * lines
        grid = figure.add_gridspec(2, 2, width_ratios=(1.75, 1.0), left=0.012, right=0.985, top=top, bottom=0.085,
                                   wspace=0.16, hspace=0.30)  # fmt: skip
        oblique = figure.add_subplot(grid[:, 0])
        _draw(oblique, quality, _view(-62.0, 22.0, quality))
        _finish_oblique(oblique, quality)
        front, above = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])
        for axes, name, elevation in ((front, "from the front", 0.0), (above, "from above", 90.0)):
            view = _view(-90.0, elevation, quality)
            _draw(axes, quality, view)
            axes.set_title(name, loc="left")
            _name(axes.xaxis, view.right, "to the right")
            _name(axes.yaxis, view.up, "upwards" if axes is front else "to the back")
            axes.xaxis.labelpad = 1.0
            axes.yaxis.set_label_coords(-0.125, 0.5)
    return figure


def _handles(quality: GraspQuality) -> list[Line2D]:
    handles = [
        Line2D([], [], color=_color(i), lw=4.0, label=finger.name.removesuffix("_tip"))
        for i, finger in enumerate(quality.fingers)
    ]
    cone = Patch(facecolor="0.6", alpha=0.35, label="friction cone")
    force = Line2D([], [], color=_ARROW, lw=1.6, label="force on the object")
    weight = Line2D([], [], color=_WEIGHT, lw=1.6, label="weight")
    return [*handles, cone, force, weight]  # type: ignore[list-item]


def _draw(axes: Axes, quality: GraspQuality, view: _View) -> None:
    middle = 1e3 * quality.centre_of_mass
    _draw_object(axes, quality, view)
    scale = _force_scale(quality)
    for i, (finger, line) in enumerate(zip(quality.fingers, quality.fingers_at, strict=True)):
        _draw_finger(axes, view, 1e3 * line - middle, middle, 1e3 * quality.radius, _color(i))
        point, normal = 1e3 * quality.points[i] - middle, quality.contacts.normals[i]
        _draw_cone(axes, view, point, normal, quality.contacts.friction[i], quality.forces[i], scale, _longest(quality),
                   middle, _color(i))  # fmt: skip
        if finger.missing or quality.opening:
            gap = view.flat(np.array([1e3 * line[-1], point + middle]))
            color = WARNING if finger.missing else "0.35"
            axes.plot(*gap.T, color=color, ls=(0, (2, 1.5)), lw=1.2, zorder=12)
    _arrow(axes, view.flat(middle), view.flat(middle + scale * quality.weight), _WEIGHT)
    axes.plot(*view.flat(middle), "o", color=_WEIGHT, ms=3.5, zorder=11)
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    axes.margins(0.04)


def _draw_object(axes: Axes, quality: GraspQuality, view: _View) -> None:
    """Its outline filled, plane faces that face the eye shaded, their edges, and the hidden edges thinner."""
    from scipy.spatial import ConvexHull

    corners, facets, edges = _hull(quality.shape)
    world = 1e3 * (quality.position + corners @ quality.rotation.T)
    seen = [bool((quality.rotation @ normal) @ view.eye > 1e-6) for _, normal in facets]

    def fill(points: Array, alpha: float) -> None:
        flat = view.flat(points)
        outline = flat[ConvexHull(flat).vertices]
        axes.add_patch(Polygon(outline, closed=True, fc=OBJECT, ec="none", alpha=alpha, zorder=5.0))

    fill(world, 0.16)
    for normal, members in _plane_faces(corners, facets):
        towards = quality.rotation @ normal
        if towards @ view.eye > 0.02:
            fill(world[members], 0.14 * abs(float(towards @ (0.3 * view.right + 0.8 * view.up))))
    for a, b, one, other, is_sharp in edges:
        front = seen[one] or seen[other]
        if not (is_sharp or seen[one] != seen[other]):
            continue
        flat = view.flat(world[[a, b]])
        if front:
            axes.plot(*flat.T, color="#1F5F86", lw=1.0, zorder=5.1, solid_capstyle="round")
        else:
            axes.plot(*flat.T, color="#1F5F86", lw=0.6, alpha=0.45, ls=(0, (3, 2)), zorder=4.9)


def _hull(shape: Shape) -> tuple[Array, list[tuple[Array, Array]], list[tuple[int, int, int, int, bool]]]:
    """Corners, triangles with their normals, and edges with the two triangles beside them, in the object frame.

    The corners are the surface points nearest to points far away, so that sharp corners are among them.
    """
    from scipy.spatial import ConvexHull

    k = np.arange(_DIRECTIONS) + 0.5
    polar, turn = np.arccos(1.0 - 2.0 * k / _DIRECTIONS), math.pi * (1.0 + math.sqrt(5.0)) * k
    away = np.column_stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)])
    found = np.array([shape.nearest(1e2 * direction)[0] for direction in away])
    hull = ConvexHull(np.unique(np.round(found, 9), axis=0))
    normals = hull.equations[:, :3]
    facets = [(simplex, normal) for simplex, normal in zip(hull.simplices, normals, strict=True)]
    edges = []
    for one, (simplex, neighbours) in enumerate(zip(hull.simplices, hull.neighbors, strict=True)):
        for opposite, other in enumerate(neighbours):
            if one < other:
                a, b = (int(corner) for j, corner in enumerate(simplex) if j != opposite)
                edges.append((a, b, one, int(other), bool(normals[one] @ normals[other] < _SHARP)))
    return hull.points, facets, edges


def _plane_faces(corners: Array, facets: list[tuple[Array, Array]]) -> list[tuple[Array, list[int]]]:
    """Normal and corners of the facets that lie in one plane, if they are more than a sliver of the surface."""
    groups: dict[tuple[float, ...], tuple[float, set[int]]] = {}
    for facet, normal in facets:
        a, b, c = corners[facet]
        key = tuple(np.round(normal, 5) + 0.0)
        area, members = groups.get(key, (0.0, set()))
        groups[key] = (area + 0.5 * float(np.linalg.norm(np.cross(b - a, c - a))), members | set(facet.tolist()))
    whole = sum(area for area, _ in groups.values())
    return [(np.array(key), sorted(members)) for key, (area, members) in groups.items() if area > _FACE * whole]


def _draw_finger(axes: Axes, view: _View, line: Array, middle: Array, radius: float, color: str) -> None:
    """Links as thick lines, joints as rings, the soft tip in its true size; `line` is about the object's middle."""
    orders = [view.depth(np.array([a, b])) for a, b in pairwise(line)]
    for a, b, order in zip(line[:-1], line[1:], orders, strict=True):
        flat = view.flat(np.array([a, b]) + middle)
        axes.plot(*flat.T, color="white", lw=7.0, zorder=order, solid_capstyle="round")
        axes.plot(*flat.T, color=color, lw=5.0, alpha=0.85, zorder=order + 0.01, solid_capstyle="round")
    tip = view.flat(line[-1] + middle)
    order = view.depth(line[-1])
    axes.add_patch(Circle(tuple(tip), radius, fc=color, ec=color, alpha=0.30, lw=0.8, zorder=order + 0.02))
    axes.add_patch(Circle(tuple(tip), radius, fc="none", ec=color, lw=0.9, zorder=order + 0.03))
    for joint, before, after in zip(view.flat(line[:-1] + middle), [orders[0], *orders], orders, strict=False):
        axes.plot(*joint, "o", mfc="white", mec=color, mew=1.2, ms=4.6, zorder=max(before, after) + 0.04)
    axes.plot(*view.flat(line[0] + middle), "s", color="0.35", ms=6.5, zorder=orders[0] + 0.05)


def _draw_cone(
    axes: Axes, view: _View, point: Array, normal: Array, friction: float, force: Array, scale: float, longest: float,
    middle: Array, color: str,
) -> None:  # fmt: skip
    from scipy.spatial import ConvexHull

    pressing = float(normal @ force)
    known = not np.isnan(pressing)
    height = scale * pressing if known and pressing > 0.0 else 0.6 * longest
    first = np.cross(normal, [0.3, 0.5, 0.8])
    first /= np.linalg.norm(first)
    a = np.linspace(0.0, 2.0 * math.pi, 61)[:, None]
    side = np.cos(a) * first + np.sin(a) * np.cross(normal, first)
    base = view.flat(point + middle + height * (normal + min(friction, _WIDEST) * side))
    apex = view.flat(point + middle)
    outline = np.vstack([apex, base])
    hull = ConvexHull(outline, qhull_options="QJ")
    axes.add_patch(Polygon(outline[hull.vertices], closed=True, fc=color, ec=color, alpha=0.20, lw=0.5, zorder=9.5))
    axes.plot(*base.T, color=color, lw=0.9, zorder=9.6)
    axes.plot(*apex, "o", color=color, ms=4.0, mec="white", mew=0.6, zorder=11.5)
    if known:
        _arrow(axes, apex, view.flat(point + middle + scale * force), _ARROW)


def _arrow(axes: Axes, start: Array, end: Array, color: str) -> None:
    if np.linalg.norm(end - start) < 0.8:
        return
    axes.add_patch(FancyArrowPatch(tuple(start), tuple(end), arrowstyle="-|>", mutation_scale=9.0, lw=1.6, color=color,
                                   shrinkA=0.0, shrinkB=0.0, zorder=11.0))  # fmt: skip


def _finish_oblique(axes: Axes, quality: GraspQuality) -> None:
    """No axes, but their directions, a scale and the key figures."""
    axes.set_axis_off()
    view = _view(-62.0, 22.0, quality)
    place, size, box = np.array([0.06, 0.085]), 0.085, axes.get_position()
    ratio = box.width / box.height * _WIDTH / _HEIGHT
    arrow = {"arrowstyle": "-|>", "lw": 0.9, "color": "0.35", "shrinkA": 0, "shrinkB": 0}
    ways = size * view.flat(np.eye(3)) * np.array([1.0 / ratio, 1.0])
    place -= np.minimum(1.4 * ways.min(axis=0), 0.0) * [0.0, 1.0]
    for name, way in zip("xyz", ways, strict=True):
        (x, y), (label_x, label_y) = place + way, place + 1.28 * way
        axes.annotate("", (x, y), tuple(place), "axes fraction", "axes fraction", arrow)
        axes.text(label_x, label_y, name, transform=axes.transAxes, ha="center", va="center", color="0.35", size=7.5)
    scale = _force_scale(quality)
    closure = f"{quality.margin:.3f} N per newton" if quality.margin > 0.0 else "none"
    lines = [f"force-closure margin {closure},  smallest singular value of G {quality.singular_values[-1]:.2f}"]
    if np.isfinite(quality.forces).all():
        use = max(finger.friction_use for finger in quality.fingers)
        worst = "a contact pulls" if math.isinf(use) else f"largest friction use {use:.2f}"
        lines.append(f"{worst},  arrows {scale:.2g} mm a newton")
    elif quality.opening:
        lines.append(f"open start: the tips stand {1e3 * quality.opening:.3g} mm off their contact points")
    axes.text(0.0, -0.02, "\n".join(lines), transform=axes.transAxes, va="top", color="0.25", linespacing=1.5)


def _force_scale(quality: GraspQuality) -> float:
    """Length of arrows [mm/N]."""
    largest = float(np.nanmax(np.linalg.norm([*quality.forces, quality.weight], axis=1)))
    return _longest(quality) / max(largest, 1e-9)


def _longest(quality: GraspQuality) -> float:
    """Length of the longest arrow [mm]."""
    return _LONGEST * 1e3 * quality.contacts.length


def _color(index: int) -> str:
    return FINGERS[index % len(FINGERS)]
