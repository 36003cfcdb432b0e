"""Where a tip touches an object: a plane face, or the tangent plane of a curved surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from softhand.numerics.arrays import Array


@dataclass(frozen=True)
class Face:
    """The plane of the points x of the object frame with normal . x = offset.

    The frame C_O of a plane face has z along the outward normal and x along `tangent`.
    """

    normal: Array
    """Outward unit normal in the object frame, shape (3,)."""
    tangent: Array
    """x axis of C_O in the object frame, shape (3,)."""
    offset: float
    """Distance of the plane from the origin of the object frame [m]."""
    others: tuple[tuple[Array, float], ...] = ()
    """Normals and offsets of the planes that end it: a point of this face lies inside all of them."""
    is_curved: bool = False
    """Whether this is the tangent plane of a curved surface at one point."""

    def __post_init__(self) -> None:
        for name in ("normal", "tangent"):  # they are shown to controllers
            array = np.array(getattr(self, name), dtype=float)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def distance(self, point: ArrayLike) -> float:
        """Signed distance of a point of the object frame from the plane, outside positive [m]."""
        return float(np.dot(self.normal, point) - self.offset)

    def overhang(self, point: ArrayLike) -> float:
        """How far a point lies beyond the edges of the face [m]; negative inside."""
        return max((float(np.dot(normal, point) - offset) for normal, offset in self.others), default=0.0)
