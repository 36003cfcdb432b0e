"""The feet of several convex parts that a plane can come to: those on the convex hull of all parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softhand.model.shapes.foot import Foot
from softhand.model.shapes.polyhedron import Polyhedron
from softhand.model.shapes.sphere import Sphere
from softhand.numerics.arrays import Array

_SAME = 1e-9  # of the size of the whole: corners closer than this are one
_TURNS = 64  # points of a rim
_BALL = 400  # points of a ball


def feet_of_hull(parts: Sequence[Any]) -> tuple[Foot, ...]:
    """The feet of all parts that are on the convex hull of all: a plane comes to no others.

    A corner that several parts share is one foot, and corners within a face of the hull are none, so that two halves
    of a box stand as the box does.
    """
    from scipy.spatial import ConvexHull  # 27 MB that few runs need

    outlines = [outline(part) for part in parts]
    points = np.concatenate(outlines)
    is_extreme = np.zeros(len(points), dtype=bool)
    is_extreme[_once(points, ConvexHull(points).vertices)] = True
    found, first = list[Foot](), 0
    for k, (part, own) in enumerate(zip(parts, outlines, strict=True), 1):
        counts = is_extreme[first : first + len(own)]
        first += len(own)
        found += [replace(foot, name=f"{foot.name} of part {k}") for foot in feet_on(part, counts)]
    return tuple(found)


def outline(part: Any) -> Array:
    """Its corners, or points of its rims or of its surface [m], shape (n, 3)."""
    if isinstance(part, Polyhedron):
        return part.corners()
    if isinstance(part, Sphere):
        return part.surface_points(_BALL)[0]
    angle = 2.0 * np.pi * np.arange(_TURNS) / _TURNS
    ring = np.column_stack([part.radius * np.cos(angle), part.radius * np.sin(angle), np.zeros(_TURNS)])
    up = np.array([0.0, 0.0, part.half])
    ends = np.concatenate([ring - up, ring + up])
    places: Array = part.in_object(ends, ends)[0]
    return places


def feet_on(part: Any, counts: NDArray[np.bool_]) -> list[Foot]:
    """The feet of a part of whose `outline` some points count."""
    feet = part.feet()
    if isinstance(part, Polyhedron):
        is_on = counts.tolist()
    elif isinstance(part, Sphere):
        is_on = [bool(counts.any())]
    else:
        lower, upper = bool(counts[:_TURNS].any()), bool(counts[_TURNS:].any())
        points = (len(feet) - 3) // 2  # on each flat end; then its lower rim, its side, its upper rim
        is_on = [*[lower] * points, *[upper] * points, lower, lower and upper, upper]
    return [foot for foot, on in zip(feet, is_on, strict=True) if on]


def _once(points: Array, index: NDArray[np.int32]) -> list[int]:
    """Of some points one at each place, the first."""
    close = _SAME * float(np.linalg.norm(np.ptp(points, axis=0)))
    found = list[int]()
    for k in np.sort(index).tolist():
        if not found or np.min(np.linalg.norm(points[found] - points[k], axis=1)) > close:
            found.append(k)
    return found
