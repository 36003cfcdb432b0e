"""The object of a grasp on paper, of any convex shape."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from softhand.model.shapes.shape import Shape
from softhand.model.shapes.union import parts_of
from softhand.numerics.arrays import Array
from softhand.plots.style import OBJECT
from softhand.plots.view import View

_EDGE = "#1F5F86"
_DIRECTIONS = 3000
_FACE = 0.02  # of the surface: smaller ones are taken for parts of a curved one
_SHARP = math.cos(math.radians(25.0))


class _Edge(NamedTuple):
    """Two corners, the two facets beside them, and whether the surface bends there."""

    corners: tuple[int, int]
    facets: tuple[int, int]
    is_sharp: bool


class Hull(NamedTuple):
    """A convex surface in the object frame."""

    corners: Array
    """[m], shape (n, 3)."""
    facets: list[tuple[Array, Array]]
    """Corners of each triangle, shape (3,), and its outward normal."""
    edges: list[_Edge]


def draw_object(axes: Axes, view: View, hulls: Sequence[Hull], position: Array, rotation: Array) -> None:
    """Its outline filled, plane faces that face the eye shaded, their edges, and the hidden edges thinner.

    Args:
        axes: where to.
        view: from where.
        hulls: of the parts of the object, see `hulls_of`.
        position: of the object frame in the world [m].
        rotation: from the object frame to the world.
    """
    for hull in hulls:
        _draw_part(axes, view, hull, position, rotation)


def _draw_part(axes: Axes, view: View, hull: Hull, position: Array, rotation: Array) -> None:
    world = 1e3 * (position + hull.corners @ rotation.T)
    _fill(axes, view.flat(world), 0.16)
    for normal, members in _plane_faces(hull):
        towards = rotation @ normal
        if towards @ view.eye > 0.02:
            _fill(axes, view.flat(world[members]), 0.14 * abs(float(towards @ (0.3 * view.right + 0.8 * view.up))))
    faces_eye = [bool((rotation @ normal) @ view.eye > 1e-6) for _, normal in hull.facets]
    for edge in hull.edges:
        beside = [faces_eye[facet] for facet in edge.facets]
        if edge.is_sharp or beside[0] != beside[1]:
            _draw_edge(axes, view.flat(world[list(edge.corners)]), any(beside))


def _fill(axes: Axes, points: Array, alpha: float) -> None:
    from scipy.spatial import ConvexHull

    outline = points[ConvexHull(points).vertices]
    axes.add_patch(Polygon(outline, closed=True, fc=OBJECT, ec="none", alpha=alpha, zorder=5.0))


def _draw_edge(axes: Axes, ends: Array, is_in_front: bool) -> None:
    if is_in_front:
        axes.plot(*ends.T, color=_EDGE, lw=1.0, zorder=5.1, solid_capstyle="round")
    else:
        axes.plot(*ends.T, color=_EDGE, lw=0.6, alpha=0.45, ls=(0, (3, 2)), zorder=4.9)


def hulls_of(shape: Shape) -> list[Hull]:
    """Of each convex part of a shape."""
    return [_hull_of(part) for part in parts_of(shape)]


def _hull_of(shape: Shape) -> Hull:
    """The hull of the surface points nearest to points far away, so that sharp corners are among them."""
    from scipy.spatial import ConvexHull

    found = np.array([shape.nearest(1e2 * direction)[0] for direction in _directions()])
    hull = ConvexHull(np.unique(np.round(found, 9), axis=0))
    normals = hull.equations[:, :3]
    facets = [(simplex, normal) for simplex, normal in zip(hull.simplices, normals, strict=True)]
    edges = []
    for one, (simplex, neighbours) in enumerate(zip(hull.simplices, hull.neighbors, strict=True)):
        for opposite, other in enumerate(neighbours):
            if one < other:
                a, b = (int(corner) for j, corner in enumerate(simplex) if j != opposite)
                edges.append(_Edge((a, b), (one, int(other)), bool(normals[one] @ normals[other] < _SHARP)))
    return Hull(hull.points, facets, edges)


def _directions() -> Array:
    """Unit vectors spread evenly over all directions, on a spiral, shape (n, 3)."""
    k = np.arange(_DIRECTIONS) + 0.5
    polar, turn = np.arccos(1.0 - 2.0 * k / _DIRECTIONS), math.pi * (1.0 + math.sqrt(5.0)) * k
    return np.column_stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)])


def _plane_faces(hull: Hull) -> list[tuple[Array, list[int]]]:
    """Normal and corners of the facets that lie in one plane, if they are more than a sliver of the surface."""
    groups: dict[tuple[float, ...], tuple[float, set[int]]] = {}
    for facet, normal in hull.facets:
        a, b, c = hull.corners[facet]
        key = tuple(np.round(normal, 5) + 0.0)
        area, members = groups.get(key, (0.0, set()))
        groups[key] = (area + 0.5 * float(np.linalg.norm(np.cross(b - a, c - a))), members | set(facet.tolist()))
    whole = sum(area for area, _ in groups.values())
    return [(np.array(key), sorted(members)) for key, (area, members) in groups.items() if area > _FACE * whole]
