"""Triangles of the rigid shapes in the picture, and of those that change: plain numpy, metres.

A `Mesh` is vertices, shape (n, 3), and triangles, shape (m, 3), counter-clockwise seen from outside.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softhand.numerics.arrays import Array

Faces = NDArray[np.int32]

_SMOOTH = np.cos(np.radians(25.0))  # a surface that bends less between two triangles stands for a smooth one


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
    return Mesh(mesh.vertices @ pose[:3, :3].T + pose[:3, 3], mesh.faces)


def pressed_flat(mesh: Mesh, pose: Array) -> Mesh:
    """The mesh with what is in front of a plane pressed onto it.

    Args:
        mesh: a surface.
        pose: its x axis is the normal of the plane and points to the front, its origin lies in it, shape (4, 4).
    """
    ahead = np.maximum((mesh.vertices - pose[:3, 3]) @ pose[:3, 0], 0.0)
    return Mesh(mesh.vertices - ahead[:, None] * pose[:3, 0], mesh.faces)


def box(size: ArrayLike) -> Mesh:
    """A box about the origin; its faces share no vertices, so that its edges stay sharp."""
    half = 0.5 * np.asarray(size, dtype=float)
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            corners = np.zeros((4, 3))
            corners[:, axis] = sign * half[axis]
            corners[:, u] = np.array([-1, 1, 1, -1]) * half[u]
            corners[:, v] = np.array([-1, -1, 1, 1]) * half[v] * sign
            faces += [[len(vertices), len(vertices) + 1, len(vertices) + 2]]
            faces += [[len(vertices), len(vertices) + 2, len(vertices) + 3]]
            vertices += corners.tolist()
    return Mesh(np.array(vertices), np.array(faces, dtype=np.int32))


def feature_edges(mesh: Mesh, radius: float) -> Mesh:
    """The edges of a mesh at which its surface bends or ends, as thin bars; none for a smooth shape.

    Args:
        mesh: a surface; its triangles need not share vertices.
        radius: of the bars [m].
    """
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
    bars = []
    for (start, end), normal in beside.items():
        if len(normal) == 1 or np.min(normal[1:] @ normal[0]) < _SMOOTH:
            bars.append(_bar(points[start], points[end], radius))
    return merged(bars) if bars else Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))


def _bar(start: Array, end: Array, radius: float) -> Mesh:
    """A bar from one point to another, longer by its radius at both ends, so that bars meet in corners."""
    pose, reach = np.eye(4), end - start
    pose[:3, :3], pose[:3, 3] = axes_along(reach), 0.5 * (start + end)
    half = 0.5 * float(np.linalg.norm(reach)) + radius
    return moved(lathe([[0.0, -half], [radius, -half], [radius, half], [0.0, half]], 4), pose)


def axes_along(direction: Array) -> Array:
    """A rotation whose z axis has a direction, shape (3, 3)."""
    z = direction / np.linalg.norm(direction)
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def lathe(profile: ArrayLike, segments: int = 32) -> Mesh:
    """A surface of revolution about z.

    Args:
        profile: radius and height of each ring [m], along the outline that has the outside on its right hand side as
            z points up, shape (rings, 2). A corner is a point given twice.
        segments: vertices a ring.
    """
    profile = np.asarray(profile, dtype=float)
    angles = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    radius, height = profile[:, :1], profile[:, 1:]
    vertices = np.stack(
        [radius * np.cos(angles), radius * np.sin(angles), np.broadcast_to(height, (len(profile), segments))], axis=-1
    ).reshape(-1, 3)
    return Mesh(vertices, grid_faces(len(profile), segments))


def grid_faces(rows: int, columns: int) -> Faces:
    """Triangles of a grid of vertices, row by row, whose last column meets its first.

    The outside is along (from column to column) x (from row to row).
    """
    a = np.arange(rows - 1)[:, None] * columns
    j, k = np.arange(columns), (np.arange(columns) + 1) % columns
    first = np.stack([a + j, a + k, a + columns + k], axis=-1).reshape(-1, 3)
    second = np.stack([a + j, a + columns + k, a + columns + j], axis=-1).reshape(-1, 3)
    return np.concatenate([first, second]).astype(np.int32)


def cylinder(radius: float, length: float) -> Mesh:
    """About z, centred at the origin."""
    h = 0.5 * length
    return lathe([[0.0, -h], [radius, -h], [radius, -h], [radius, h], [radius, h], [0.0, h]])


def sphere(radius: float) -> Mesh:
    """About the origin."""
    angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 17)
    return lathe(radius * np.stack([np.cos(angles), np.sin(angles)], axis=1))


def ellipsoid(semi_axes: Sequence[float]) -> Mesh:
    """An ellipsoid about the origin, of three semi-axes [m]."""
    ball = sphere(1.0)
    return Mesh(ball.vertices * semi_axes, ball.faces)


def capsule(radius: float, length: float) -> Mesh:
    """A cylinder of that length about z with half spheres at its ends, centred at the origin."""
    angles = np.linspace(0.0, 0.5 * np.pi, 9)
    top = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1) + [0.0, 0.5 * length]
    return lathe(np.concatenate([top[::-1] * [1.0, -1.0], top]))


def arrow() -> tuple[Mesh, Mesh]:
    """Shaft and head of an arrow along z, each of length and radius one, starting at the origin."""
    shaft = lathe([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 1.0]], 20)
    head = lathe([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0]], 20)
    return shaft, head


def disc() -> Mesh:
    """A flat disc of radius one about z, to be seen from both sides."""
    return lathe([[1.0, 0.0], [0.0, 0.0]], 48)
