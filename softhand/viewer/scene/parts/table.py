"""The table in the picture."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from softhand.numerics.arrays import Array
from softhand.viewer.scene.item import Part, Update, item
from softhand.viewer.scene.moment import Moment, Past
from softhand.viewer.scene.palette import TABLE, darker
from softhand.viewer.scene.poses import along, axes_along, pose
from softhand.viewer.scene.shapes.edges import feature_edges
from softhand.viewer.scene.shapes.mesh import moved
from softhand.viewer.scene.shapes.solids import box

_SIDE = 16.0  # in units


class Plane(NamedTuple):
    """Where a table is."""

    height: float
    """Along the normal, from the origin of the base frame [m]."""
    normal: Array
    """Unit vector, shape (3,)."""


class Table(Part):
    """A slab under the object, as large as the picture needs; the table itself has no end.

    Args:
        plane: of the table.
        under: what it is under [m], shape (3,), or the places where that goes, shape (n, 3).
        unit: length by which things are drawn [m].
    """

    def __init__(self, plane: Plane, under: Array, unit: float) -> None:
        thick, axes = 0.6 * unit, axes_along(plane.normal)
        places = np.atleast_2d(under) @ axes
        low, high = places.min(axis=0), places.max(axis=0)
        self._pose = along(plane.normal, axes @ [*(0.5 * (low + high))[:2], plane.height])
        size = (*(high - low)[:2] + _SIDE * unit, thick)
        slab = moved(box(size), pose(np.eye(3), (0.0, 0.0, -0.5 * thick)))
        self.items = [
            item("table/slab", slab, TABLE, opacity=0.55),
            item("table/edges", feature_edges(slab, 0.05 * unit), darker(TABLE)),
        ]

    def update(self, moment: Moment, past: Past) -> list[Update]:
        """It stays."""
        return [Update(self._pose)] * len(self.items)
