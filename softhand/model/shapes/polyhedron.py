"""A convex polyhedron: polygons, each with its plane and its edges."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softhand.model.shapes.box import nearest_face
from softhand.model.shapes.face import Face
from softhand.model.shapes.foot import Foot, points_of
from softhand.model.shapes.shape import (
    EDGE,
    FACE,
    OWN,
    VERTEX,
    CompiledShape,
    point_of,
    set_vector,
    shares,
    unit_square,
)
from softhand.numerics.arrays import Array

_FACE_ROW, _EDGE_ROW = 6, 10


@dataclass(frozen=True, eq=False)
class Polyhedron(CompiledShape):
    """A convex polyhedron."""

    vertices: Array
    """In axes of the shape [m], shape (n, 3)."""
    polygons: tuple[NDArray[np.int64], ...]
    """Vertices of each face, counter-clockwise as seen from outside."""
    normals: Array
    """Outward normal of each face in axes of the shape, shape (m, 3)."""

    @classmethod
    def of_box(cls, rotation: Array, centre: Array, half: Array) -> Polyhedron:
        """A box, its faces and their tangents as those of `Box`; half the length of each side [m], shape (3,)."""
        signs = np.array(list(product((-1.0, 1.0), repeat=3)))  # vertex 4 a + 2 b + c at the signs a, b, c
        polygons = ((4, 6, 7, 5), (1, 3, 2, 0), (2, 3, 7, 6), (4, 5, 1, 0), (1, 5, 7, 3), (2, 6, 4, 0))
        normals = np.array([sign * axis for axis in np.eye(3) for sign in (1.0, -1.0)])
        return cls(rotation, centre, signs * half, tuple(np.array(polygon) for polygon in polygons), normals)

    @cached_property
    def area(self) -> float:
        """Of its surface [m^2]."""
        a, b, c = self._triangles()[0].transpose(1, 0, 2)
        return 0.5 * float(np.sum(np.linalg.norm(np.cross(b - a, c - a), axis=1)))

    @cached_property
    def offsets(self) -> Array:
        """Distance of each face from the centre [m]: no vertex lies beyond it, shape (m,)."""
        return np.array(
            [np.max(self.vertices[polygon] @ n) for polygon, n in zip(self.polygons, self.normals, strict=True)]
        )

    def numbers(self) -> Array:
        """Count of faces; of each its normal, offset, place of its first edge and their count; then the edges.

        Of each edge: its first vertex, its direction, its length, and the normal in the face that points out of it.
        """
        rows: list[list[float]] = []
        edges: list[list[float]] = []
        first = OWN + 1 + _FACE_ROW * len(self.polygons)
        for polygon, normal, offset in zip(self.polygons, self.normals, self.offsets, strict=True):
            rows.append([*normal, offset, first + _EDGE_ROW * len(edges), len(polygon)])
            for start, end in zip(self.vertices[polygon], self.vertices[np.roll(polygon, -1)], strict=True):
                length = float(np.linalg.norm(end - start))
                direction = (end - start) / length
                edges.append([*start, *direction, length, *np.cross(direction, normal)])
        return np.concatenate([[len(rows)], np.ravel(rows), np.ravel(edges)])

    @staticmethod
    def nearest_entry(data: Any, io: Any) -> None:
        """The nearest point of the faces whose planes the point is beyond; from inside the nearest plane.

        Where the foot on the plane of such a face lies in the face, that is it, as the plane bounds the whole body.
        Else it is on the edges that the foot lies beyond.
        """
        x, y, z = point_of(data, io)
        count = int(data[OWN])
        highest, square = -math.inf, math.inf
        best, nx, ny, nz = 0, 0.0, 0.0, 0.0
        io[7] = FACE
        for k in range(count):
            row = OWN + 1 + _FACE_ROW * k
            level = data[row] * x + data[row + 1] * y + data[row + 2] * z - data[row + 3]
            if level > highest:
                highest, best = level, row
            if level <= 0.0:
                continue
            is_over = True
            first = int(data[row + 4])
            for i in range(int(data[row + 5])):
                edge = first + _EDGE_ROW * i
                ax, ay, az = x - data[edge], y - data[edge + 1], z - data[edge + 2]
                if data[edge + 7] * ax + data[edge + 8] * ay + data[edge + 9] * az <= 0.0:
                    continue
                is_over = False
                along = data[edge + 3] * ax + data[edge + 4] * ay + data[edge + 5] * az
                held = min(max(along, 0.0), data[edge + 6])
                ax -= held * data[edge + 3]
                ay -= held * data[edge + 4]
                az -= held * data[edge + 5]
                gap = ax * ax + ay * ay + az * az
                if gap < square:
                    square, nx, ny, nz = gap, ax, ay, az
                    io[7] = EDGE if held == along else VERTEX
            if is_over:
                io[6] = level
                io[7] = FACE
                set_vector(data, data[row], data[row + 1], data[row + 2], io, 3)
                return
        distance = math.sqrt(square)
        if highest > 0.0 and distance > 0.0:
            io[6] = distance
            set_vector(data, nx / distance, ny / distance, nz / distance, io, 3)
        else:
            io[6] = highest
            io[7] = FACE
            set_vector(data, data[best], data[best + 1], data[best + 2], io, 3)

    def faces(self) -> tuple[Face, ...]:
        """Its faces, the tangent along the first edge of each."""
        corners, normals = self.in_object(self.vertices, self.normals)
        faces = []
        for polygon, normal, offset in zip(self.polygons, normals, self.offsets + normals @ self.centre, strict=True):
            starts = corners[polygon]
            out = np.cross(np.roll(starts, -1, axis=0) - starts, normal)
            out /= np.linalg.norm(out, axis=1, keepdims=True)
            ends = tuple(zip(out, np.einsum("ij,ij->i", out, starts).tolist(), strict=True))
            faces.append(Face(normal, np.cross(normal, out[0]), float(offset), ends))
        return tuple(faces)

    def face_at(self, point: ArrayLike) -> Face:
        """The nearest face."""
        return nearest_face(self.faces(), point)

    def feet(self) -> tuple[Foot, ...]:
        """Its vertices."""
        return points_of(self.corners())

    def corners(self) -> Array:
        """Its vertices."""
        return self.centre + self.vertices @ self.rotation.T

    def surface_points(self, count: int) -> tuple[Array, Array]:
        """Spread over the triangles into which the polygons are cut."""
        corners, outward = self._triangles()
        along, across = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        numbers = shares(np.linalg.norm(np.cross(along, across), axis=1), count)
        # one sequence goes through all triangles, so that small ones do not all get the same point
        square = unit_square(count)
        square = np.where(np.sum(square, axis=1, keepdims=True) > 1.0, 1.0 - square, square)
        index = np.repeat(np.arange(len(numbers)), numbers)
        points = corners[index, 0] + square[:, :1] * along[index] + square[:, 1:] * across[index]
        return self.in_object(points, outward[index])

    def _triangles(self) -> tuple[Array, Array]:
        """Corners of the triangles into which the polygons are cut, shape (n, 3, 3), and their normals, (n, 3)."""
        found = [(p[0], p[k], p[k + 1], n) for p, n in zip(self.polygons, self.normals, strict=True)
                 for k in range(1, len(p) - 1)]  # fmt: skip
        return self.vertices[np.array([one[:3] for one in found])], np.array([one[3] for one in found])
