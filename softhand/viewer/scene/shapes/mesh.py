"""Triangles: a surface as vertices and faces, moved, merged, pressed flat.

Triangles are counter-clockwise seen from outside.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.arrays import Array
from softhand.viewer.scene.poses import to_world

Faces = NDArray[np.int32]


class Mesh(NamedTuple):
    """Vertices [m], shape (n, 3), and triangles (segments for lines), shape (m, 3) or (m, 2)."""

    vertices: Array
    faces: Faces


def merged(meshes: list[Mesh]) -> Mesh:
    """Several meshes as one."""
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces).astype(np.int32))


def moved(mesh: Mesh, pose: Array) -> Mesh:
    """The mesh under a pose, shape (4, 4)."""
    return Mesh(to_world(mesh.vertices, pose), mesh.faces)


def pressed_flat(mesh: Mesh, pose: Array) -> Mesh:
    """The mesh with what is in front of a plane pressed onto it.

    Args:
        mesh: a surface.
        pose: its x axis is the normal of the plane and points to the front, its origin lies in it, shape (4, 4).
    """
    ahead = np.maximum((mesh.vertices - pose[:3, 3]) @ pose[:3, 0], 0.0)
    return Mesh(mesh.vertices - ahead[:, None] * pose[:3, 0], mesh.faces)


def grid_faces(rows: int, columns: int) -> Faces:
    """Triangles of a grid of vertices, row by row, whose last column meets its first.

    The outside is along (from column to column) x (from row to row).
    """
    a = np.arange(rows - 1)[:, None] * columns
    j, k = np.arange(columns), (np.arange(columns) + 1) % columns
    first = np.stack([a + j, a + k, a + columns + k], axis=-1).reshape(-1, 3)
    second = np.stack([a + j, a + columns + k, a + columns + j], axis=-1).reshape(-1, 3)
    return np.concatenate([first, second]).astype(np.int32)
