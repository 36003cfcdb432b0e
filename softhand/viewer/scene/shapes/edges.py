"""The edges of a surface, as thin bars."""

from __future__ import annotations

import numpy as np

from softhand.numerics.arrays import Array
from softhand.viewer.scene.poses import along
from softhand.viewer.scene.shapes.mesh import Mesh, merged, moved
from softhand.viewer.scene.shapes.solids import lathe

_SMOOTH = np.cos(np.radians(25.0))  # a surface that bends less between two triangles stands for a smooth one


def feature_edges(mesh: Mesh, radius: float) -> Mesh:
    """The edges of a mesh at which its surface bends or ends, as thin bars; none for a smooth shape.

    Args:
        mesh: a surface; its triangles need not share vertices.
        radius: of the bars [m].
    """
    points, sides = _sides(mesh)
    bars = [
        _bar(points[start], points[end], radius)
        for (start, end), normals in sides.items()
        if len(normals) == 1 or np.min(normals[1:] @ normals[0]) < _SMOOTH
    ]
    return merged(bars) if bars else Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))


def _sides(mesh: Mesh) -> tuple[Array, dict[tuple[int, int], list[Array]]]:
    """Points, equal ones merged, and for each pair that sides of triangles join the normals of these triangles."""
    points, index = np.unique(np.round(mesh.vertices, 9), axis=0, return_inverse=True)
    faces = index.reshape(-1)[mesh.faces]
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1)
    faces, normals = faces[area > 0.0], normals[area > 0.0] / area[area > 0.0, None]
    beside: dict[tuple[int, int], list[Array]] = {}
    for face, normal in zip(faces.tolist(), normals, strict=True):
        for start, end in zip(face, face[1:] + face[:1], strict=True):
            beside.setdefault((min(start, end), max(start, end)), []).append(normal)
    return points, beside


def _bar(start: Array, end: Array, radius: float) -> Mesh:
    """A bar from one point to another, longer by its radius at both ends, so that bars meet in corners."""
    reach = end - start
    half = 0.5 * float(np.linalg.norm(reach)) + radius
    bar = lathe([[0.0, -half], [radius, -half], [radius, half], [0.0, half]], 4)
    return moved(bar, along(reach, 0.5 * (start + end)))
