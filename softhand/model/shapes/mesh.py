"""Meshes as convex polyhedra: what is refused, and how triangles become faces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from softhand.model.shapes.mesh_file import Mesh, Triangles, refused
from softhand.model.shapes.polyhedron import Polyhedron
from softhand.model.shapes.surface import check_closed, size_of, welded
from softhand.numerics.arrays import Array

if TYPE_CHECKING:
    from scipy.spatial import ConvexHull

MOST_FACES = 5000
# shares of the size of the mesh: files hold numbers of six or seven digits
_SAME_PLANE = 1e-6
_CONVEX = 1e-5
_FLAT = 1e-4


def as_polyhedron(mesh: Mesh, rotation: Array, centre: Array, take_hull: bool = False) -> Polyhedron:
    """The convex polyhedron that a mesh is, coplanar triangles merged into faces.

    Args:
        mesh: from `mesh_file.read_mesh`.
        rotation: axes of the mesh in the object frame, shape (3, 3).
        centre: its origin there [m], shape (3,).
        take_hull: take the convex hull of whatever the mesh is.

    Raises:
        ModelError: the mesh is flat, open, inside out or not convex, or has too many faces.
    """
    from scipy.spatial import ConvexHull, QhullError  # 27 MB that few runs need

    if take_hull:
        vertices, triangles = welded(mesh)
        _check_thickness(vertices, size_of(vertices), mesh.name)
    else:
        vertices, triangles = check_solid(mesh)
    size = size_of(vertices)
    try:
        hull = ConvexHull(vertices)
    except QhullError as error:
        raise refused(mesh.name, "is too thin to have a convex hull", "export the surface of a solid") from error
    planes, polygons = _merge(vertices, hull, _SAME_PLANE * size, mesh.name)
    if not take_hull:
        _check_convex(vertices, triangles, planes, size, mesh.name)
    used, index = np.unique(np.concatenate(polygons), return_inverse=True)
    parts = np.split(index, np.cumsum([len(polygon) for polygon in polygons])[:-1])
    return Polyhedron(rotation, centre, vertices[used], tuple(parts), planes[:, :3].copy())


def check_solid(mesh: Mesh) -> tuple[Array, Triangles]:
    """Vertices and triangles of a mesh, welded, if it is the surface of a solid.

    Raises:
        ModelError: the mesh is flat, open or inside out.
    """
    vertices, triangles = welded(mesh)
    _check_thickness(vertices, size_of(vertices), mesh.name)
    check_closed(triangles, mesh.name)
    _check_orientation(vertices, triangles, mesh.name)
    return vertices, triangles


def _check_thickness(vertices: Array, size: float, name: str) -> None:
    axes = np.linalg.svd(vertices - vertices.mean(axis=0), full_matrices=False)[2]
    thickness = float(np.min(np.ptp(vertices @ axes.T, axis=0))) if len(axes) == 3 else 0.0
    if thickness < _FLAT * size:
        raise refused(
            name, f"is flat: {1e3 * size:.3g} mm large, {1e3 * thickness:.3g} mm thick", "export the surface of a solid"
        )  # fmt: skip


def _check_orientation(vertices: Array, triangles: Triangles, name: str) -> None:
    a, b, c = (vertices[triangles[:, k]] - vertices.mean(axis=0) for k in range(3))
    if np.einsum("ij,ij->", a, np.cross(b, c)) < 0.0:
        raise refused(
            name, "is inside out: its triangles run clockwise as seen from outside",
            "flip its normals, or set object.hull = true to take its convex hull",
        )  # fmt: skip


def _check_convex(vertices: Array, triangles: Triangles, planes: Array, size: float, name: str) -> None:
    """All vertices and the middles of all triangles lie on the hull; a middle does only with its whole triangle."""
    points = np.concatenate([vertices[np.unique(triangles)], vertices[triangles].mean(axis=1)])
    depth = np.full(len(points), np.inf)
    for plane in planes:
        np.minimum(depth, -(points @ plane[:3] + plane[3]), out=depth)
    worst = int(np.argmax(depth))
    if depth[worst] > _CONVEX * size:
        place = ", ".join(f"{1e3 * x:.4g}" for x in points[worst])
        raise refused(
            name, f"is not convex: its surface at ({place}) mm lies {1e3 * depth[worst]:.3g} mm inside its convex hull",
            "set object.decompose = true to cut it into convex parts, which takes the extra `decompose`, or "
            "object.hull = true to take the hull",
        )  # fmt: skip


def _merge(vertices: Array, hull: ConvexHull, close: float, name: str) -> tuple[Array, list[NDArray[np.int64]]]:
    """Planes and polygons of the hull: each the facets about the largest one left that lie in its plane."""
    corners = vertices[hull.simplices]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    free = np.ones(len(areas), dtype=bool)
    planes: list[Array] = []
    polygons: list[NDArray[np.int64]] = []
    for seed in np.argsort(-areas, kind="stable"):
        if not free[seed]:
            continue
        if len(planes) == MOST_FACES:
            raise refused(
                name, f"has more than {MOST_FACES} faces, of which a contact looks at each in every step",
                f"simplify it to at most {MOST_FACES}, or use <sphere> or <cylinder>",
            )  # fmt: skip
        normal, offset = hull.equations[seed, :3], hull.equations[seed, 3]
        free[seed] = False
        members, waiting = [seed], [seed]
        while waiting:
            for other in hull.neighbors[waiting.pop()]:
                is_thin = areas[other] < close**2
                if free[other] and (is_thin or np.all(np.abs(corners[other] @ normal + offset) < close)):
                    free[other] = False
                    members.append(other)
                    waiting.append(other)
        polygon = _outline(vertices, np.unique(hull.simplices[members]), normal)
        planes.append(hull.equations[seed])
        polygons.append(polygon)
    return np.array(planes), polygons


def _outline(vertices: Array, members: NDArray[np.int64], normal: Array) -> NDArray[np.int64]:
    """The corners of a plane polygon, counter-clockwise about its normal."""
    if len(members) == 3:
        a, b, c = vertices[members]
        return members if np.cross(b - a, c - a) @ normal > 0.0 else members[::-1]
    from scipy.spatial import ConvexHull

    first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    first /= np.linalg.norm(first)
    flat = vertices[members] @ np.column_stack([first, np.cross(normal, first)])
    outline: NDArray[np.int64] = members[ConvexHull(flat).vertices]
    return outline
