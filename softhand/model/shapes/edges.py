"""The straight edges of a shape."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from softhand.model.shapes.box import Box
from softhand.model.shapes.polyhedron import Polyhedron
from softhand.model.shapes.shape import Shape
from softhand.numerics.arrays import Array


class Edge(NamedTuple):
    """Between two corners, in the object frame."""

    middle: Array
    """[m], shape (3,)."""
    direction: Array
    """Unit vector, shape (3,)."""
    half: float
    """Half its length [m]."""


def edges_of(shape: Shape) -> list[Edge]:
    """All straight edges at which two plane faces meet; none of a round shape."""
    if isinstance(shape, Box):
        corners = shape.corners()  # their numbers in binary tell the three sides
        pairs = {(k, k | bit) for k in range(8) for bit in (1, 2, 4) if not k & bit}
    elif isinstance(shape, Polyhedron):
        corners = shape.corners()
        rings = [polygon.tolist() for polygon in shape.polygons]
        sides = [(a, b) for ring in rings for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]
        pairs = {(min(side), max(side)) for side in sides}
    else:
        return []
    found = []
    for a, b in sorted(pairs):
        way = corners[b] - corners[a]
        length = float(np.linalg.norm(way))
        found.append(Edge(0.5 * (corners[a] + corners[b]), way / length, 0.5 * length))
    return found
