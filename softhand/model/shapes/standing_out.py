"""Corners and edges of convex parts at which their union is convex: what of it another body can meet.

Where the surfaces of two parts cross, the union is hollow, and nothing but a corner or an edge of the other body gets
there. A corner of a part stands out, and so does a piece of its edges, if a plane through it leaves all parts on one
side nearby: if no sum of the ways along the parts, with weights that are not negative, is zero.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from softhand.model.shapes.edges import Edge, edges_of
from softhand.model.shapes.foot import Foot
from softhand.model.shapes.polyhedron import Polyhedron
from softhand.model.shapes.protruding import feet_on, outline
from softhand.model.shapes.shape import Shape
from softhand.model.shapes.sphere import Sphere
from softhand.model.shapes.union import Union
from softhand.numerics.arrays import Array

_CLOSE = 1e-6  # [m] what is closer than this is one place
_PARALLEL = 1e-6  # sine of the angle between two ways that are one
_ON_ONE_SIDE = 1e-6  # least length of the shortest such sum of unit vectors, its weights 1 together


def feet_that_stand_out(shape: Shape) -> tuple[Foot, ...]:
    """The feet of a shape that another body can meet, each place once; all of a convex one."""
    if not isinstance(shape, Union):
        return shape.feet()
    parts, found = shape.parts, list[Foot]()
    for index, part in enumerate(parts):
        if isinstance(part, Polyhedron):
            feet = [foot for foot in part.feet() if _stands_out(parts, index, foot.position, None)]
        else:
            others = [other for k, other in enumerate(parts) if k != index]
            is_free = [all(other.near(place)[6] > -_CLOSE for other in others) for place in outline(part)]
            feet = feet_on(part, np.array(is_free))
        found += [replace(foot, name=f"{foot.name} of part {index + 1}") for foot in feet]
    return tuple(found)


def edges_that_stand_out(shape: Shape) -> list[Edge]:
    """The straight edges of a shape that another body can meet, each once; all of a convex one."""
    if not isinstance(shape, Union):
        return edges_of(shape)
    parts, found = shape.parts, list[Edge]()
    for index, part in enumerate(parts):
        others = [other for k, other in enumerate(parts) if k != index]
        for edge in edges_of(part):
            start, length = edge.middle - edge.half * edge.direction, 2.0 * edge.half
            inner = sorted(cut for other in others for cut in _cuts(other, start, edge.direction) if 0.0 < cut < length)
            for low, high in pairwise([0.0, *inner, length]):
                middle = start + 0.5 * (low + high) * edge.direction
                if high - low > _CLOSE and _stands_out(parts, index, middle, edge.direction):
                    _add(found, Edge(middle, edge.direction, 0.5 * (high - low)))
    return found


def _add(found: list[Edge], edge: Edge) -> None:
    """Add an edge, as one with another that it goes on."""
    for k, other in enumerate(found):
        if np.linalg.norm(np.cross(other.direction, edge.direction)) > _PARALLEL:
            continue
        way = edge.middle - other.middle
        along = float(way @ other.direction)
        if np.linalg.norm(way - along * other.direction) < _CLOSE and abs(along) - edge.half - other.half < _CLOSE:
            low, high = min(-other.half, along - edge.half), max(other.half, along + edge.half)
            del found[k]
            _add(found, Edge(other.middle + 0.5 * (low + high) * other.direction, other.direction, 0.5 * (high - low)))
            return
    found.append(edge)


def _stands_out(parts: Sequence[Any], index: int, place: Array, along: Array | None) -> bool:
    """Whether all parts lie on one side of a plane through a place, near to it; not so if an earlier part has it too.

    Args:
        parts: of the union.
        index: of the part of which it is a corner, or on an edge.
        place: in the object frame [m].
        along: direction of that edge; None at a corner.
    """
    ways = []
    for k, part in enumerate(parts):
        if part.near(place)[6] > _CLOSE:
            continue
        own = _ways(part, place, along)
        if own is None or k < index:
            return False
        ways.append(own)
    return _are_on_one_side(np.concatenate(ways))


def _ways(part: Any, place: Array, along: Array | None) -> Array | None:
    """Unit vectors from a corner of a part along its edges, or from an edge across its two faces; None elsewhere."""
    if not isinstance(part, Polyhedron):
        return None
    if along is None:
        ways = [way / np.linalg.norm(way) for way in _from_corner(part, place)]
        return np.array(ways) if ways else None
    faces = [face for face in part.faces() if abs(face.distance(place)) <= _CLOSE]
    normals = [face.normal for face in faces if abs(face.normal @ along) < _PARALLEL]
    if len(faces) != 2 or len(normals) != 2:
        return None
    a, b = normals
    return np.array([way / np.linalg.norm(way) for way in ((a @ b) * a - b, (a @ b) * b - a)])


def _from_corner(part: Polyhedron, place: Array) -> Iterator[Array]:
    """The ways from the corner at a place to the other ends of its edges; none if there is no corner."""
    for edge in edges_of(part):
        for side in (-edge.half, edge.half):
            if np.linalg.norm(edge.middle + side * edge.direction - place) <= _CLOSE:
                yield -side * edge.direction


def _are_on_one_side(ways: Array) -> bool:
    """Whether the shortest sum of unit vectors, with weights that are 1 together, is not zero."""
    from scipy.optimize import nnls

    system = np.vstack([ways.T, np.ones(len(ways))])
    return bool(nnls(system, np.array([0.0, 0.0, 0.0, 1.0]))[1] > _ON_ONE_SIDE)


def _cuts(part: Any, start: Array, direction: Array) -> list[float]:
    """Where a line crosses the planes of the faces of a part, or its round surface [m]."""
    if isinstance(part, Polyhedron):
        normals, offsets = part.normals @ part.rotation.T, part.offsets
        slopes, levels = normals @ direction, offsets - normals @ (start - part.centre)
        crossing = np.abs(slopes) > 1e-12
        return [float(cut) for cut in levels[crossing] / slopes[crossing]]
    p, e = part.rotation.T @ (start - part.centre), part.rotation.T @ direction
    if isinstance(part, Sphere):
        return _roots(e @ e, p @ e, p @ p - part.radius**2)
    ends = [float((side - p[2]) / e[2]) for side in (-part.half, part.half)] if abs(e[2]) > 1e-12 else []
    return ends + _roots(e[:2] @ e[:2], p[:2] @ e[:2], p[:2] @ p[:2] - part.radius**2)


def _roots(a: float, b: float, c: float) -> list[float]:
    """Of a t^2 + 2 b t + c."""
    room = b * b - a * c
    if a < 1e-24 or room <= 0.0:
        return []
    root = float(np.sqrt(room))
    return [(-b - root) / a, (-b + root) / a]
