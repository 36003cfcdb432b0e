"""Triangles as a surface: vertices at one place made one, and whether it is closed."""

from __future__ import annotations

import numpy as np

from softhand.model.shapes.mesh_file import Mesh, Triangles, refused
from softhand.numerics.arrays import Array

_SAME_POINT = 1e-7  # of the size of the mesh: files hold numbers of six or seven digits


def size_of(vertices: Array) -> float:
    """The diagonal of the box around vertices [m]."""
    return float(np.linalg.norm(np.ptp(vertices, axis=0)))


def welded(mesh: Mesh) -> tuple[Array, Triangles]:
    """Vertices at one place made one, and no triangles that have then fewer than three."""
    grid = np.round((mesh.vertices - mesh.vertices.min(axis=0)) / (_SAME_POINT * size_of(mesh.vertices)))
    _, first, index = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    triangles = index.reshape(-1)[mesh.triangles]
    distinct = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return mesh.vertices[first], triangles[distinct]


def check_closed(triangles: Triangles, name: str) -> None:
    """Each edge has one triangle on either side, which pass it in opposite directions.

    Raises:
        ModelError: there are edges of which this is not so.
    """
    begins, ends = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    base = int(triangles.max(initial=0)) + 1
    edges = np.unique(begins * base + ends)
    twice = begins.size - edges.size
    if twice:
        raise refused(
            name, f"has {twice} edges along which triangles look to different sides, some of them inside out, or more "
            "than two meet", "make its normals consistent, or set object.hull = true to take its convex hull",
        )  # fmt: skip
    begins, ends = np.divmod(edges, base)
    loose = int(np.sum(~np.isin(ends * base + begins, edges)))
    if loose:
        raise refused(
            name, f"is open: {loose} edges have a triangle on one side only",
            "close its holes, or set object.hull = true to take its convex hull",
        )  # fmt: skip
