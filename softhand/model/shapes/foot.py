"""What a shape stands on: each place of it that may meet a plane, as a ball, a point or an ellipsoid."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softhand.numerics.arrays import Array


@dataclass(frozen=True, eq=False)
class Foot:
    """An ellipsoid, or a ball, of an object. It meets a plane with the point of it that is farthest out towards it.

    That point moves over the foot as the object turns. With the semi-axes A along axes R and the direction u to the
    plane, it lies at A^2 R^T u / |A R^T u| from the middle, at the distance |A R^T u| along u.
    """

    name: str
    """What it is called, with a number where there are several: `corner 3`."""
    position: Array
    """Of its middle in the object frame [m], shape (3,)."""
    radius: float = 0.0
    """Of a ball [m]; 0 for a point."""
    semi_axes: tuple[float, float, float] | None = None
    """Of an ellipsoid, in place of the ball [m]."""
    rotation: Array = field(default_factory=lambda: np.eye(3))
    """Axes of the ellipsoid in the object frame, shape (3, 3)."""
    share: float = 1.0
    """Of its stiffness, that of a corner being 1."""

    def reach(self, direction: ArrayLike) -> float:
        """How far it reaches along a unit vector of the object frame, from the origin of that frame [m]."""
        u = np.asarray(direction, dtype=float)
        out = self.radius if self.semi_axes is None else np.linalg.norm(self.semi_axes * (self.rotation.T @ u))
        return float(self.position @ u + out)


def points_of(places: NDArray[np.float64], name: str = "corner") -> tuple[Foot, ...]:
    """A foot at each of some points of the object frame [m], shape (n, 3), numbered from 1."""
    return tuple(Foot(f"{name} {k + 1}", place) for k, place in enumerate(places))
