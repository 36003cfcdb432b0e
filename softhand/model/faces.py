"""The plane faces of an object, from the collision shape of its URDF."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from softhand.errors import ModelError


@dataclass(frozen=True)
class Face:
    """A plane face: the points x of the object frame with normal . x = offset.

    Its frame C_O has z along the outward normal and x along `tangent`.
    """

    normal: NDArray[np.float64]
    """Outward unit normal in the object frame, shape (3,)."""
    tangent: NDArray[np.float64]
    """x axis of C_O in the object frame, shape (3,)."""
    offset: float
    """Distance of the face from the origin of the object frame [m]."""
    others: tuple[tuple[NDArray[np.float64], float], ...] = ()
    """Normals and offsets of the other faces: a point of this face lies inside all of them."""

    def distance(self, point: ArrayLike) -> float:
        """Signed distance of a point of the object frame from the face's plane, outside positive [m]."""
        return float(np.dot(self.normal, point) - self.offset)

    def overhang(self, point: ArrayLike) -> float:
        """How far a point lies beyond the edges of the face [m]; negative inside."""
        return max(float(np.dot(normal, point) - offset) for normal, offset in self.others)


@dataclass(frozen=True)
class Box:
    """The shape of an object: a solid box."""

    rotation: NDArray[np.float64]
    """Axes of the box in the object frame, shape (3, 3)."""
    centre: NDArray[np.float64]
    """In the object frame [m], shape (3,)."""
    half: NDArray[np.float64]
    """Half the length of each side [m], shape (3,)."""

    def corners(self) -> NDArray[np.float64]:
        """Its eight corners in the object frame [m], shape (8, 3)."""
        signs = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
        return np.asarray(self.centre + (signs * self.half) @ self.rotation.T)

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


def read_box(file: Path, body: pin.Model) -> Box:
    """The collision box of an object's URDF.

    Args:
        file: the URDF.
        body: its Pinocchio model, one free-flyer joint.

    Raises:
        ModelError: there is not exactly one collision shape, or it is no box.
    """
    geometry = pin.buildGeomFromUrdf(body, str(file), pin.GeometryType.COLLISION)
    shapes = list(geometry.geometryObjects)
    if len(shapes) != 1 or not isinstance(shapes[0].geometry, coal.Box):
        found = ", ".join(type(shape.geometry).__name__.lower() for shape in shapes) or "none"
        raise ModelError(
            f"{file}: an object needs exactly one collision shape, a <box>, for its faces; found: {found}.",
            file=str(file),
        )
    placement = shapes[0].placement
    half = np.array(shapes[0].geometry.halfSide)
    return Box(placement.rotation.copy(), placement.translation.copy(), half)
