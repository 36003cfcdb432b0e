"""A cylinder with flat ends."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from softhand.model.shapes.foot import Foot, points_of
from softhand.model.shapes.shape import (
    EDGE,
    FACE,
    OWN,
    SHARP,
    CurvedShape,
    normal_of,
    point_of,
    set_vector,
    shares,
    unit_square,
)
from softhand.numerics.arrays import Array

_CROWN = 3e-4  # height of the crown of a flat end over the radius, see `Cylinder.feet`
_POINTS = 6  # on each flat end that it stands on


@dataclass(frozen=True, eq=False)
class Cylinder(CurvedShape):
    """A cylinder along its z axis.

    Its coordinates alpha_o are the angle about the axis and the length along the outline, 0 at half the height,
    positive towards +z, which goes on over the rim to the middle of the flat end. The x axis of C_O goes round.
    """

    radius: float
    """[m]"""
    half: float
    """Half the height [m]."""

    @property
    def area(self) -> float:
        """Of its surface [m^2]."""
        return 2.0 * math.pi * self.radius * (self.radius + 2.0 * self.half)

    def numbers(self) -> Array:
        """Radius and half the height."""
        return np.array([self.radius, self.half])

    @staticmethod
    def nearest_entry(data: Any, io: Any) -> None:
        """On the side, a flat end or the rim."""
        x, y, z = point_of(data, io)
        across = math.hypot(x, y)
        out, above = across - data[OWN], abs(z) - data[OWN + 1]
        ux, uy = (x / across, y / across) if across > 0.0 else (1.0, 0.0)
        up = math.copysign(1.0, z)
        io[7] = FACE
        if out > 0.0 and above > 0.0:
            io[6] = math.hypot(out, above)
            io[7] = EDGE
            set_vector(data, ux * out / io[6], uy * out / io[6], up * above / io[6], io, 3)
        elif out >= above:
            io[6] = out
            set_vector(data, ux, uy, 0.0, io, 3)
        else:
            io[6] = above
            set_vector(data, 0.0, 0.0, up, io, 3)

    @staticmethod
    def chart_entry(data: Any, io: Any) -> None:
        """M = diag(rho, 1) with the distance rho from the axis, K = diag(n_rho / rho, 0), T = (n_z / rho, 0).

        n_rho and n_z are the parts of the normal across and along the axis: 1 and 0 on the side, 0 and 1 on the upper
        end. A rim counts as a rounding of no radius, K_22 without bound.
        """
        x, y, z = point_of(data, io)
        nx, ny, nz = normal_of(data, io)
        radius, half = data[OWN], data[OWN + 1]
        rho = max(math.hypot(x, y), 1e-9 * radius)
        ux, uy = (x / rho, y / rho) if math.hypot(x, y) > 0.0 else (1.0, 0.0)
        out = ux * nx + uy * ny
        is_end = abs(nz) > 1.0 - 1e-12
        is_rim = not is_end and abs(nz) > 1e-12
        io[8] = math.atan2(y, x)
        io[9] = z
        if is_end or is_rim:
            io[9] = math.copysign(half + (radius - rho if is_end else 0.0), nz)
        set_vector(data, -uy, ux, 0.0, io, 10)
        io[13], io[14], io[15] = rho, 0.0, 1.0
        io[16], io[17], io[18] = out / rho, 0.0, SHARP if is_rim else 0.0
        io[19], io[20] = nz / rho, 0.0

    def feet(self) -> tuple[Foot, ...]:
        """Its rims and its side to roll on, and points of its flat ends to stand on.

        Each rim is the equator of a thin ellipsoid, whose pole is the middle of the flat end: like a flat end that is
        crowned by a thousandth of the radius, so that the place where it is lowest runs along the rim as the cylinder
        turns, and goes over the end without a jump as it is set upright. A third one is at half the height. It bears
        half of the load of a cylinder that lies, and the rims a quarter each, so that their friction holds a spin about
        the vertical as a line of even pressure does, mu N h / 4 with the height h.

        On a flat end points in a circle carry the load, and keep it from tilting. They are so far from the axis that,
        with what the crown carries, friction holds a spin as an even pressure does, (2/3) mu N a with the radius a, and
        so far inside the rim that none of them touches once the cylinder has tilted by a degree or so.
        """
        crown = _CROWN * min(self.radius, self.half)
        places = (("rim 1", crown - self.half, 1.0), ("side", 0.0, 2.0), ("rim 2", self.half - crown, 1.0))
        round_ = tuple(
            Foot(name, self.centre + z * self.rotation[:, 2], 0.0, (self.radius, self.radius, crown), self.rotation, k)
            for name, z, k in places
        )
        angle = 2.0 * np.pi * np.arange(_POINTS) / _POINTS
        out = 2.0 / 3.0 * (_POINTS + 1) / _POINTS * self.radius
        points = out * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_POINTS)])
        ends = np.concatenate([points + np.array([0.0, 0.0, side * self.half]) for side in (-1.0, 1.0)])
        return (*points_of(self.in_object(ends, ends)[0], "end point"), *round_)

    def surface_points(self, count: int) -> tuple[Array, Array]:
        """On the side on an even lattice, on the ends along spirals."""
        a, h = self.radius, self.half
        lower, side, upper = shares([a * a, 4.0 * a * h, a * a], count)
        angle, level = (unit_square(side) * [2.0 * np.pi, 2.0 * h] - [0.0, h]).T
        round_ = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(side)])
        points, normals = [a * round_ + level[:, None] * [0.0, 0.0, 1.0]], [round_]
        for up, number in ((-1.0, lower), (1.0, upper)):
            k = np.arange(number) + 0.5
            rho, turn = a * np.sqrt(k / max(number, 1)), np.pi * (3.0 - np.sqrt(5.0)) * k
            points.append(np.column_stack([rho * np.cos(turn), rho * np.sin(turn), np.full(number, up * h)]))
            normals.append(np.tile([0.0, 0.0, up], (number, 1)))
        return self.in_object(np.concatenate(points), np.concatenate(normals))
