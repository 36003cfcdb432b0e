"""A ball."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from softhand.model.shapes.ellipsoid import chart_on
from softhand.model.shapes.foot import Foot
from softhand.model.shapes.shape import FACE, OWN, CurvedShape, fibonacci_sphere, point_of, set_vector
from softhand.numerics.arrays import Array


@dataclass(frozen=True, eq=False)
class Sphere(CurvedShape):
    """A ball; alpha_o = (longitude, latitude), the poles on its z axis."""

    radius: float
    """[m]"""

    @property
    def area(self) -> float:
        """Of its surface [m^2]."""
        return 4.0 * math.pi * self.radius**2

    def numbers(self) -> Array:
        """The radius."""
        return np.array([self.radius])

    @staticmethod
    def nearest_entry(data: Any, io: Any) -> None:
        """Along the line to the centre; the pole if the point is the centre."""
        x, y, z = point_of(data, io)
        length = math.sqrt(x * x + y * y + z * z)
        if length > 0.0:
            set_vector(data, x / length, y / length, z / length, io, 3)
        else:
            set_vector(data, 0.0, 0.0, 1.0, io, 3)
        io[6] = length - data[OWN]
        io[7] = FACE

    @staticmethod
    def chart_entry(data: Any, io: Any) -> None:
        """M = diag(r cos v, r), K = I / r, T = (tan v / r, 0)."""
        chart_on(data, data[OWN], data[OWN], data[OWN], io)

    def feet(self) -> tuple[Foot, ...]:
        """As it is."""
        return (Foot("ball", self.centre, self.radius),)

    def surface_points(self, count: int) -> tuple[Array, Array]:
        """Along a spiral."""
        normals = fibonacci_sphere(count)
        return self.in_object(self.radius * normals, normals)
