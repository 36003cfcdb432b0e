"""Tubes along an arc about z."""

from __future__ import annotations

import numpy as np

from softhand.numerics.arrays import Array
from softhand.viewer.scene.shapes.mesh import Mesh, grid_faces


def ring_tube(radius: float, angles: Array, thickness: Array, sides: int) -> Mesh:
    """A tube along an arc about z.

    Args:
        radius: of the arc [m].
        angles: of the rings of vertices along it, from x to y [rad], shape (rings,).
        thickness: radius of the tube at each ring [m], shape (rings,).
        sides: vertices a ring.
    """
    around = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)[:, None]
    radial = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=-1)[:, None]
    offset = np.cos(around) * radial + np.sin(around) * np.array([0.0, 0.0, 1.0])
    vertices: Array = radius * radial + thickness[:, None, None] * offset
    return Mesh(vertices.reshape(-1, 3), grid_faces(len(angles), sides))
