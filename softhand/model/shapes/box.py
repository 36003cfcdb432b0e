"""A solid box, which the contact kernel meets by formulas of its own."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from softhand.model.shapes.face import Face
from softhand.model.shapes.foot import Foot, points_of
from softhand.model.shapes.shape import Shape, shares, unit_square
from softhand.numerics.arrays import Array


@dataclass(frozen=True, eq=False)
class Box(Shape):
    """A solid box."""

    half: Array
    """Half the length of each side [m], shape (3,)."""

    def faces(self) -> tuple[Face, ...]:
        """Its six faces."""
        planes = []
        for axis in range(3):
            for sign in (1.0, -1.0):
                normal = sign * self.rotation[:, axis]
                planes.append((normal, float(self.half[axis] + normal @ self.centre), axis))
        faces = []
        for index, (normal, offset, axis) in enumerate(planes):
            others = tuple((n, d) for k, (n, d, _) in enumerate(planes) if k != index)
            faces.append(Face(normal, self.rotation[:, (axis + 1) % 3].copy(), offset, others))
        return tuple(faces)

    def face_at(self, point: ArrayLike) -> Face:
        """The nearest face."""
        return nearest_face(self.faces(), point)

    def nearest(self, point: ArrayLike) -> tuple[Array, Array]:
        """As `Shape.nearest`."""
        local = self.rotation.T @ (np.asarray(point, dtype=float) - self.centre)
        foot = np.clip(local, -self.half, self.half)
        away = local - foot
        if not away.any():
            axis = int(np.argmax(np.abs(local) - self.half))
            away[axis] = np.copysign(1.0, local[axis])
            foot[axis] = away[axis] * self.half[axis]
        return self.centre + self.rotation @ foot, self.rotation @ (away / np.linalg.norm(away))

    def feet(self) -> tuple[Foot, ...]:
        """Its corners."""
        return points_of(self.corners())

    def corners(self) -> Array:
        """Its eight corners."""
        signs = np.array(list(product((-1.0, 1.0), repeat=3)))
        return self.centre + (signs * self.half) @ self.rotation.T

    def surface_points(self, count: int) -> tuple[Array, Array]:
        """On an even lattice on each face."""
        points, normals = [], []
        numbers = shares(np.repeat(np.prod(self.half) / self.half, 2), count)
        for (axis, sign), number in zip(product(range(3), (1.0, -1.0)), numbers, strict=True):
            side = np.full((number, 3), sign)
            side[:, [(axis + 1) % 3, (axis + 2) % 3]] = 2.0 * unit_square(number) - 1.0
            points.append(side * self.half)
            normals.append(np.tile(sign * np.eye(3)[axis], (number, 1)))
        return self.in_object(np.concatenate(points), np.concatenate(normals))


def nearest_face(faces: tuple[Face, ...], point: ArrayLike) -> Face:
    """The face from whose plane and edges a point is least far."""
    return min(faces, key=lambda face: abs(face.distance(point)) + max(face.overhang(point), 0.0))
