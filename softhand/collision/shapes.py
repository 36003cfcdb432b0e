"""The shapes of links for coal, and what is left of one outside a soft ball."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import coal
import numpy as np

from softhand.errors import ModelError
from softhand.model.shapes.box import Box
from softhand.model.shapes.cylinder import Cylinder
from softhand.model.shapes.ellipsoid import Ellipsoid
from softhand.model.shapes.mesh_file import read_mesh
from softhand.model.shapes.polyhedron import Polyhedron
from softhand.model.shapes.shape import Shape
from softhand.model.shapes.sphere import Sphere
from softhand.model.urdf.geometry import Geometry
from softhand.numerics.arrays import Array

_MOST_TRIANGLES = 1_000_000
_DIRECTIONS, _SECTORS = 400, 48
_ROUNDED = 1.001  # of the radius of a ball: a rigid tip is as large as the soft one, to the digits of a URDF
_THIN = 1e-6  # [m]


class SoftBall(NamedTuple):
    """The ball of a soft tip or of a palm, in the frame of the joint that carries it."""

    name: str
    centre: Array
    """[m], shape (3,)."""
    radius: float
    """[m]"""


def as_coal(geometry: Geometry) -> coal.ShapeBase:
    """The shape about its own origin; a mesh is its convex hull.

    Raises:
        ModelError: the mesh is not there, or cannot be read.
    """
    size = geometry.size.tolist()
    if geometry.kind == "box":
        return coal.Box(*size)
    if geometry.kind == "sphere":
        return coal.Sphere(*size)
    if geometry.kind == "cylinder":
        return coal.Cylinder(*size)
    if geometry.kind == "capsule":
        return coal.Capsule(*size)
    found = _hull_of_mesh(*_key(geometry))
    if found is None:
        raise ModelError(f'filename="{geometry.filename}": too thin to have a convex hull.', file=geometry.filename)
    return found


def corners_of(geometry: Geometry) -> Array:
    """Corners of the hull of a shape, or of a polytope within a curved one, about its own origin [m], shape (n, 3).

    Raises:
        ModelError: the mesh is not there, or cannot be read.
    """
    return _hull_corners(*_key(geometry)) if geometry.kind == "mesh" else _corners_of(geometry.kind, geometry.size)


def outside(geometry: Geometry, balls: Sequence[SoftBall]) -> coal.Convex | None:
    """The convex hull of what is left of a shape outside balls, in the frame of its joint; None if that is nothing.

    Of a polytope P and a ball B every extreme point of the hull of P without B lies on an edge of P: through any other
    point of it a straight line stays outside of B for a while. So the ends of what is left of the edges are enough. A
    curved shape is taken as a polytope within it.

    Args:
        geometry: placed in the frame of the joint.
        balls: likewise.
    """
    return _outside(
        geometry.kind, tuple(geometry.size.tolist()), _key(geometry) if geometry.kind == "mesh" else None,
        geometry.rotation.tobytes(), geometry.position.tobytes(),
        tuple((tuple(np.asarray(ball.centre, dtype=float).tolist()), float(ball.radius)) for ball in balls),
    )  # fmt: skip


def solid_shape(shape: Shape) -> coal.ShapeBase:
    """A shape of the contact model about its own centre and along its own axes."""
    if isinstance(shape, Box):
        return coal.Box(*(2.0 * shape.half))
    if isinstance(shape, Sphere):
        return coal.Sphere(shape.radius)
    if isinstance(shape, Cylinder):
        return coal.Cylinder(shape.radius, 2.0 * shape.half)
    if isinstance(shape, Ellipsoid):
        return coal.Ellipsoid(*shape.semi_axes)
    assert isinstance(shape, Polyhedron)
    return hull_of(shape.vertices)


def hull_of(points: Array) -> coal.Convex | None:
    """The convex hull of points, shape (n, 3); None if they lie in a plane."""
    hull = _qhull(points)
    if hull is None:
        return None
    index = np.full(len(points), -1)
    index[hull.vertices] = np.arange(len(hull.vertices))
    vertices, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for vertex in points[hull.vertices]:
        vertices.append(vertex)
    a, b, c = points[hull.simplices].transpose(1, 0, 2)
    outward = np.sum(np.cross(b - a, c - a) * hull.equations[:, :3], axis=1) > 0.0
    for (i, j, k), is_outward in zip(index[hull.simplices].tolist(), outward, strict=True):
        triangles.append(coal.Triangle(i, j, k) if is_outward else coal.Triangle(i, k, j))
    return coal.Convex(vertices, triangles)


def _qhull(points: Array) -> Any:
    from scipy.spatial import ConvexHull, QhullError  # 27 MB that few runs need

    if len(points) < 4 or np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[-1] < _THIN:
        return None
    try:
        return ConvexHull(points)
    except QhullError:
        return None


def _ends_outside(points: Array, centre: Array, radius: float) -> Array:
    """Ends of the parts of the edges of the hull of points that lie outside a ball, shape (n, 3)."""
    hull, radius = _qhull(points), _ROUNDED * radius
    if hull is None:
        return points[np.linalg.norm(points - centre, axis=1) > radius]
    edges = np.unique(np.sort(hull.simplices[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    start, way = points[edges[:, 0]] - centre, points[edges[:, 1]] - points[edges[:, 0]]
    a, b, c = np.sum(way**2, 1), np.sum(start * way, 1), np.sum(start**2, 1) - radius**2  # |start + t way| = radius
    root = np.sqrt(np.maximum(b**2 - a * c, 0.0))
    cuts = [
        start[here] + time[here, None] * way[here]
        for time in ((-b - root) / a, (-b + root) / a)
        for here in [(b**2 > a * c) & (time > 0.0) & (time < 1.0)]
    ]
    corners = points[hull.vertices] - centre
    return np.concatenate([corners[np.linalg.norm(corners, axis=1) > radius], *cuts]) + centre


def _corners_of(kind: str, size: Array) -> Array:
    """Corners of a plain shape, or of a polytope within a curved one, about its own origin, shape (n, 3)."""
    if kind == "box":
        return np.asarray(0.5 * size * np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T)
    if kind == "cylinder":
        angle = 2.0 * np.pi * np.arange(_SECTORS) / _SECTORS
        ring = size[0] * np.stack([np.cos(angle), np.sin(angle), np.zeros(_SECTORS)], axis=1)
        return np.concatenate([ring - _up(size[1]), ring + _up(size[1])])
    k = np.arange(_DIRECTIONS) + 0.5  # evenly over the ball, along a spiral
    z, angle = 1.0 - 2.0 * k / _DIRECTIONS, np.pi * (1.0 + 5.0**0.5) * k
    across = np.sqrt(1.0 - z**2)
    ball: Array = size[0] * np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)
    if kind == "capsule":
        return np.concatenate([ball - _up(size[1]), ball + _up(size[1])])
    return ball


_Key = tuple[Path, tuple[int, int], tuple[float, ...]]


def _key(geometry: Geometry) -> _Key:
    """A mesh as it is on disk: file, when it was written and how long it is, scale."""
    if geometry.file is None:
        raise ModelError(f'filename="{geometry.filename}": there is no such mesh.', file=geometry.filename)
    try:
        status = geometry.file.stat()
    except OSError as error:
        raise ModelError(f'filename="{geometry.filename}": {error.strerror}.', file=geometry.filename) from error
    return geometry.file, (status.st_mtime_ns, status.st_size), tuple(geometry.size.tolist())


# What is made of meshes is kept: a hand is looked at again and again, with other objects and other postures.


@lru_cache(maxsize=128)
def _hull_corners(file: Path, written: tuple[int, int], scale: tuple[float, ...]) -> Array:
    """Corners of the hull of a mesh, or all of it if that is flat."""
    vertices = read_mesh(file, np.array(scale), _MOST_TRIANGLES).vertices
    hull = _qhull(vertices)
    return vertices if hull is None else vertices[hull.vertices]


@lru_cache(maxsize=128)
def _hull_of_mesh(file: Path, written: tuple[int, int], scale: tuple[float, ...]) -> coal.Convex | None:
    return hull_of(_hull_corners(file, written, scale))


@lru_cache(maxsize=128)
def _outside(
    kind: str, size: tuple[float, ...], mesh: _Key | None, rotation: bytes, position: bytes,
    balls: tuple[tuple[tuple[float, ...], float], ...],
) -> coal.Convex | None:  # fmt: skip
    corners = _hull_corners(*mesh) if mesh else _corners_of(kind, np.array(size))
    points = corners @ np.frombuffer(rotation).reshape(3, 3).T + np.frombuffer(position)
    for centre, radius in balls:
        if not len(points):
            return None
        points = _ends_outside(points, np.array(centre), radius)
    return hull_of(points)


def _up(length: float) -> Array:
    return np.array([0.0, 0.0, 0.5 * length])
