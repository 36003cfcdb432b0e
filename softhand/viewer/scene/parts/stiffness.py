"""How the held object gives way, in the picture: an ellipsoid for forces, one for couples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from softhand.numerics.arrays import Array
from softhand.viewer.scene.ellipsoids import Ellipsoids
from softhand.viewer.scene.item import Part, Update, item
from softhand.viewer.scene.moment import Moment, Past
from softhand.viewer.scene.palette import GIVES, TURNS
from softhand.viewer.scene.poses import pose
from softhand.viewer.scene.shapes.mesh import Mesh
from softhand.viewer.scene.shapes.solids import sphere

_LONGEST = 4.0
"""Of the longest semi-axis of all, in units."""
_SEGMENTS = 48


class Stiffness(Part):
    """Both ellipsoids about the origin of the object, their rings and axes seen through it.

    A semi-axis is a principal compliance: the longest is the softest. Their size is their own, the same at all times.
    """

    def __init__(self, found: Sequence[Ellipsoids], unit: float) -> None:
        self._times = [one.time for one in found]
        self._shapes = [_scaled([getattr(one, name) for one in found], _LONGEST * unit) for name in ("shift", "turn")]
        self.items = []
        if found:
            for name, colour in (("force", GIVES), ("couple", TURNS)):
                self.items.append(item(f"stiffness/{name} rings", _rings(), colour, kind="lines", on_top=True))
                self.items.append(item(f"stiffness/{name}", sphere(1.0), colour, opacity=0.35))

    def update(self, moment: Moment, past: Past) -> list[Update]:
        """Those of the last time before the moment."""
        k = max(int(np.searchsorted(self._times, moment.time + 1e-9, side="right")) - 1, 0)
        updates = []
        for shapes in self._shapes if self.items else ():
            shape = shapes[k]
            place = pose(np.eye(3) if shape is None else shape, moment.object_pose[:3, 3])
            updates += 2 * [Update(place, visible=shape is not None)]
        return updates


def _scaled(shapes: list[Array | None], longest: float) -> list[Array | None]:
    largest = max((float(np.max(np.linalg.norm(shape, axis=0))) for shape in shapes if shape is not None), default=1.0)
    return [None if shape is None else longest / largest * shape for shape in shapes]


def _rings() -> Mesh:
    """Three great circles of a ball of radius 1, and its axes, as segments."""
    a = np.linspace(0.0, 2.0 * np.pi, _SEGMENTS, endpoint=False)
    circle = np.column_stack([np.cos(a), np.sin(a), np.zeros_like(a)])
    vertices = [np.roll(circle, k, axis=1) for k in range(3)]
    turns = np.arange(_SEGMENTS)
    segments = [np.column_stack([turns, (turns + 1) % _SEGMENTS]) + k * _SEGMENTS for k in range(3)]
    ends = np.concatenate([np.eye(3), -np.eye(3)])
    axes = np.column_stack([np.arange(3), np.arange(3, 6)]) + 3 * _SEGMENTS
    return Mesh(np.concatenate([*vertices, ends]), np.concatenate([*segments, axes]))
