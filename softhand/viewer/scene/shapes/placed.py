"""Shapes of the contact model as meshes, where they are."""

from __future__ import annotations

import numpy as np

from softhand.model.shapes.box import Box
from softhand.model.shapes.cylinder import Cylinder
from softhand.model.shapes.ellipsoid import Ellipsoid
from softhand.model.shapes.polyhedron import Polyhedron
from softhand.model.shapes.shape import Shape
from softhand.model.shapes.sphere import Sphere
from softhand.viewer.scene.poses import pose
from softhand.viewer.scene.shapes.mesh import Mesh, moved
from softhand.viewer.scene.shapes.solids import box, cylinder, ellipsoid, sphere


def placed_mesh(shape: Shape) -> Mesh:
    """The surface of a shape, in the frame that it is placed in [m]."""
    return moved(_mesh_of(shape), pose(shape.rotation, shape.centre))


def _mesh_of(shape: Shape) -> Mesh:
    if isinstance(shape, Box):
        return box(2.0 * shape.half)
    if isinstance(shape, Cylinder):
        return cylinder(shape.radius, 2.0 * shape.half)
    if isinstance(shape, Sphere):
        return sphere(shape.radius)
    if isinstance(shape, Ellipsoid):
        return ellipsoid(shape.semi_axes)
    assert isinstance(shape, Polyhedron)
    vertices, faces = list[list[float]](), list[list[int]]()
    for polygon in shape.polygons:  # with vertices of its own, so that edges stay sharp
        first = len(vertices)
        vertices += shape.vertices[polygon].tolist()
        faces += [[first, first + k, first + k + 1] for k in range(1, len(polygon) - 1)]
    return Mesh(np.array(vertices), np.array(faces, dtype=np.int32))
