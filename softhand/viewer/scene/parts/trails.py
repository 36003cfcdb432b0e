"""Where contacts have been, in the picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from softhand.numerics.arrays import Array
from softhand.viewer.scene.item import OBJECT_FRAME, Part, Update, item
from softhand.viewer.scene.moment import Moment, Past
from softhand.viewer.scene.palette import TRAIL
from softhand.viewer.scene.shapes.mesh import Mesh, grid_faces

_POINTS, _SIDES = 64, 6  # of a tube


class Trails(Part):
    """Where each contact has been on the faces of the object; seen through all else, for it lies below the arrow."""

    def __init__(self, names: Sequence[str], unit: float) -> None:
        self._unit = unit
        empty = Mesh(tube(np.zeros((0, 3)), np.array([0.0, 0.0, 1.0]), 0.0), grid_faces(_POINTS, _SIDES))
        looks = {"soft": True, "on_top": True, "frame": OBJECT_FRAME}
        self.items = [item(f"trails/{name}", empty, TRAIL, **looks) for name in names]

    def update(self, moment: Moment, past: Past) -> list[Update]:
        """A tube on the face."""
        updates = []
        to_object = moment.object_pose[:3, :3].T
        for i in range(len(self.items)):
            normal = -to_object @ moment.contact_normal[i]
            updates.append(Update(moment.object_pose, tube(past.path[:, i], normal, 0.04 * self._unit)))
        return updates


def tube(path: Array, normal: Array, radius: float) -> Array:
    """A tube along a path on a face, of a fixed number of vertices: a ring a point.

    Args:
        path: [m], shape (samples, 3).
        normal: of the face, unit length, shape (3,).
        radius: [m].
    """
    if not len(path):
        return np.zeros((_POINTS * _SIDES, 3))
    where = np.linspace(0.0, len(path) - 1.0, _POINTS)
    known = np.arange(len(path))
    points = np.stack([np.interp(where, known, path[:, k]) for k in range(3)], axis=1)
    forward = np.gradient(points, axis=0)
    length = np.linalg.norm(forward, axis=1)
    moving = length > 1e-9
    if not moving.any():
        return np.repeat(points, _SIDES, axis=0)
    last = np.maximum.accumulate(np.where(moving, np.arange(_POINTS), np.argmax(moving)))
    side = np.cross(normal, forward[last] / length[last, None])
    around = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)[:, None]
    vertices: Array = points[:, None] + radius * (np.cos(around) * side[:, None] + np.sin(around) * normal)
    return vertices.reshape(-1, 3)
