"""The torsion moments in the picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from softhand.numerics.arrays import Array
from softhand.viewer.scene.item import Part, Update, item
from softhand.viewer.scene.moment import Moment, Past
from softhand.viewer.scene.palette import TORSION
from softhand.viewer.scene.poses import pose
from softhand.viewer.scene.shapes.mesh import Mesh
from softhand.viewer.scene.shapes.rings import ring_tube
from softhand.viewer.scene.shapes.solids import lathe

_RINGS, _SIDES = 48, 8  # of vertices in an arrow
_LARGEST = 1.5 * np.pi  # [rad], arc of the largest torsion
_LEAST = 0.1  # [rad], shorter arcs are left out
_RADIUS = 1.55  # of the arc, in units
_ABOVE = 0.1  # of the unit: how far it lies off the face


class Torsion(Part):
    """A curved arrow about the normal of each contact for the moment on the object, and the track that it runs on."""

    def __init__(self, names: Sequence[str], unit: float, radians_per_moment: float) -> None:
        self._unit, self._scale = unit, radians_per_moment
        gauge, track = torsion_arrow(1.0, unit), _track(unit)
        self.items = []
        for name in names:
            self.items.append(item(f"torsion/{name}", gauge, TORSION, soft=True))
            self.items.append(item(f"torsion/{name}_track", track, TORSION, opacity=0.3))

    def update(self, moment: Moment, past: Past) -> list[Update]:
        """In the plane of the face, around the tip."""
        updates = []
        for i, torsion in enumerate(moment.contact_force[:, 3]):
            middle = moment.contact_point[i] - _ABOVE * self._unit * moment.contact_normal[i]
            place = pose(moment.contact_rotation[i], middle)
            angle = float(np.clip(self._scale * torsion, -_LARGEST, _LARGEST))
            updates.append(Update(place, torsion_arrow(angle, self._unit).vertices, visible=abs(angle) > _LEAST))
            updates.append(Update(place, visible=bool(moment.deformation[i, 0] > 0.0)))
        return updates


def torsion_arrow(angle: float, unit: float) -> Mesh:
    """A curved arrow about z from the x axis over an angle [rad], positive by the right-hand rule."""
    thick = 0.11 * unit
    head = min(0.45, 0.6 * abs(angle))  # [rad] of the arc
    neck = abs(angle) - head
    along = np.array([0.0, *np.linspace(0.0, neck, _RINGS - 3), neck, abs(angle)])
    radii = np.array([0.0, *np.full(_RINGS - 3, thick), 3.0 * thick * min(1.0, head / 0.45), 0.0])
    return ring_tube(_RADIUS * unit, along * np.sign(angle), radii, _SIDES)


def _track(unit: float) -> Mesh:
    """The whole circle, thin."""
    around = np.linspace(0.0, 2.0 * np.pi, 9)
    outline: Array = np.stack([_RADIUS * unit + 0.03 * unit * np.cos(around), 0.03 * unit * np.sin(around)], axis=1)
    return lathe(outline, 64)
