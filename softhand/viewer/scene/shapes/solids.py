"""Solids about the origin: box, cylinder, ball, capsule, arrow, disc [m]."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from softhand.viewer.scene.shapes.mesh import Mesh, grid_faces


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
