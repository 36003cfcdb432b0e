"""Points of the surface of link shapes: how far they reach, and how wide they are."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path

import numpy as np

from softhand.errors import ModelError
from softhand.model.shapes.mesh_file import read_mesh
from softhand.model.urdf.geometry import Geometry
from softhand.numerics.arrays import Array

_ROUND = 24  # points of a circle
_MOST = 3000  # of a mesh


def shape_points(shapes: Iterable[Geometry]) -> Array:
    """Points spread over the surfaces of some shapes of a link, in its frame [m], shape (points, 3).

    A mesh that cannot be read, or is not there, has none.
    """
    found = [points @ shape.rotation.T + shape.position for shape in shapes if len(points := _points(shape))]
    return np.concatenate(found) if found else np.empty((0, 3))


def _points(shape: Geometry) -> Array:
    size = shape.size
    if shape.kind == "mesh":
        return np.empty((0, 3)) if shape.file is None else _of_mesh(shape.file, tuple(size))
    if shape.kind == "box":
        grid = np.linspace(-0.5, 0.5, 5)
        corners = np.stack(np.meshgrid(grid, grid, grid), axis=-1).reshape(-1, 3)
        return np.asarray(corners[np.abs(corners).max(axis=1) == 0.5] * size)
    if shape.kind == "sphere":
        return np.asarray(size[0] * _ball())
    radius, length = size
    if shape.kind == "capsule":
        ball = radius * _ball()
        return ball + np.sign(ball[:, 2:]) * np.array([0.0, 0.0, 0.5 * length])
    angle = 2.0 * np.pi * np.arange(_ROUND) / _ROUND
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_ROUND)])
    heights = np.linspace(-0.5, 0.5, 9)[:, None, None] * np.array([0.0, 0.0, length])
    return np.concatenate([(radius * ring + heights).reshape(-1, 3), 0.5 * radius * ring + heights[0]])


def _ball() -> Array:
    """Points of the unit sphere, poles among them."""
    lat, lon = np.meshgrid(np.linspace(-0.5 * np.pi, 0.5 * np.pi, 13), 2.0 * np.pi * np.arange(_ROUND) / _ROUND)
    points = np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=-1)
    return np.asarray(points.reshape(-1, 3))


@lru_cache(maxsize=64)
def _of_mesh(file: Path, scale: tuple[float, ...]) -> Array:
    """Vertices, and the middles of the edges of large triangles; the outermost ones of very many."""
    try:
        mesh = read_mesh(file, np.array(scale))
    except ModelError:
        return np.empty((0, 3))
    corners = mesh.vertices[mesh.triangles]
    sides = 0.5 * (corners + np.roll(corners, 1, axis=1))
    points = np.concatenate([mesh.vertices, sides.reshape(-1, 3)])
    if len(points) <= _MOST:
        return points
    kept = np.random.default_rng(0).choice(len(points), _MOST, replace=False)
    ways = _ball()
    return points[np.union1d(kept, np.argmax(points @ ways.T, axis=0))]
