"""Volume, centre and spread of solids of uniform density, from which a mass and an inertia are made."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from softhand.errors import ModelError
from softhand.model.shapes.mesh_file import Mesh, Triangles, read_mesh, refused
from softhand.model.shapes.surface import check_closed, size_of, welded
from softhand.model.urdf.geometry import Geometry
from softhand.numerics.arrays import Array

_THINNEST = 1e-9  # volume of a mesh, as a share of the cube of its size


class Solid(NamedTuple):
    """A solid of uniform density."""

    volume: float
    """[m^3]"""
    centre: Array
    """[m], shape (3,)."""
    spread: Array
    """S, the integral of x x^T over the volume, x from the centre [m^5], shape (3, 3)."""

    @property
    def inertia(self) -> Array:
        """About the centre at 1 kg/m^3, tr(S) 1 - S [kg m^2], shape (3, 3)."""
        return np.asarray(np.trace(self.spread) * np.eye(3) - self.spread)


def solid_of(shape: Geometry) -> tuple[Solid, bool]:
    """The solid that a shape is, in the frame of its link, and whether it is the convex hull of a mesh that is open.

    Raises:
        ModelError: a mesh is not there, cannot be read or has no volume.
    """
    is_hull = False
    if shape.kind == "mesh":
        if shape.file is None:
            raise ModelError(f'filename="{shape.filename}": there is no such mesh', file=shape.filename)
        solid, is_hull = _of_mesh(read_mesh(shape.file, shape.size))
    else:
        volume, moments = _plain(shape.kind, shape.size.tolist())
        solid = Solid(volume, np.zeros(3), np.diag(moments))
    turned = shape.rotation @ solid.spread @ shape.rotation.T
    return Solid(solid.volume, shape.position + shape.rotation @ solid.centre, turned), is_hull


def joined(solids: list[Solid]) -> Solid:
    """Several solids as one; what they have in common counts as often as it is there."""
    volume = sum(solid.volume for solid in solids)
    centre = np.asarray(sum(solid.volume * solid.centre for solid in solids) / volume)
    arms = [solid.centre - centre for solid in solids]
    spread = sum(solid.spread + solid.volume * np.outer(arm, arm) for solid, arm in zip(solids, arms, strict=True))
    return Solid(volume, centre, np.asarray(spread))


def ball(radius: float) -> Solid:
    """A ball about the origin [m]."""
    volume, moments = _plain("sphere", [radius])
    return Solid(volume, np.zeros(3), np.diag(moments))


def _plain(kind: str, size: list[float]) -> tuple[float, list[float]]:
    """Volume of a plain shape about its origin, and the diagonal of its spread."""
    if kind == "box":
        volume = math.prod(size)
        return volume, [volume * edge**2 / 12.0 for edge in size]
    r = size[0]
    sphere = 4.0 / 3.0 * math.pi * r**3
    if kind == "sphere":
        return sphere, [sphere * r**2 / 5.0] * 3
    half = 0.5 * size[1]
    volume = 2.0 * math.pi * r**2 * half
    across, along = volume * r**2 / 4.0, volume * half**2 / 3.0
    if kind == "capsule":  # a half ball at each end, its centre of mass 3/8 r further out
        across += sphere * r**2 / 5.0
        along += sphere * (half**2 + 0.75 * half * r + r**2 / 5.0)
        volume += sphere
    return volume, [across, across, along]


def _of_mesh(mesh: Mesh) -> tuple[Solid, bool]:
    vertices, triangles = welded(mesh)
    least = _THINNEST * size_of(vertices) ** 3
    try:
        check_closed(triangles, mesh.name)
        solid = _of_triangles(vertices, triangles)
        if abs(solid.volume) > least and np.linalg.eigvalsh(solid.spread)[0] > 0.0:
            return solid, False
    except ModelError:
        pass
    from scipy.spatial import ConvexHull, QhullError  # 27 MB that few URDFs need

    try:
        hull = ConvexHull(vertices)
    except (QhullError, ValueError) as error:
        raise refused(mesh.name, "is flat", "export the surface of a solid") from error
    corners = hull.points[hull.simplices]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("ij,ij->i", normals, hull.equations[:, :3]) < 0.0
    outward = np.where(inward[:, None], hull.simplices[:, ::-1], hull.simplices).astype(np.int64)
    solid = _of_triangles(vertices, outward)
    if not (solid.volume > least and np.linalg.eigvalsh(solid.spread)[0] > 0.0):
        raise refused(mesh.name, "is flat", "export the surface of a solid")
    return solid, True


def _of_triangles(vertices: Array, triangles: Triangles) -> Solid:
    """Of a closed surface: the sum of the tetrahedra over its triangles, those that look inward negative."""
    middle = vertices.mean(axis=0)
    corners = vertices[triangles] - middle
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    volume = float(volumes.sum())
    sign = -1.0 if volume < 0.0 else 1.0  # a mesh that is inside out
    volumes, volume = sign * volumes, sign * volume
    if volume == 0.0:
        return Solid(0.0, middle, np.zeros((3, 3)))
    total = a + b + c
    centre = volumes @ total / (4.0 * volume)
    moments = sum(np.einsum("i,ij,ik->jk", volumes, x, x) for x in (a, b, c, total)) / 20.0
    return Solid(volume, middle + centre, np.asarray(moments - volume * np.outer(centre, centre)))
