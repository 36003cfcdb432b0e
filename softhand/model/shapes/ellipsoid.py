"""An ellipsoid of three semi-axes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from softhand.model.shapes.foot import Foot
from softhand.model.shapes.shape import FACE, OWN, CurvedShape, fibonacci_sphere, normal_of, point_of, set_vector
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled

_MOST_ROUNDS = 100
_CANDIDATES = 20  # a point on the surface, from which the spread ones are chosen


@dataclass(frozen=True, eq=False)
class Ellipsoid(CurvedShape):
    """The points with (x/a)^2 + (y/b)^2 + (z/c)^2 <= 1.

    Its coordinates alpha_o = (u, v) give the point (a cos u cos v, b sin u cos v, c sin v).
    """

    semi_axes: tuple[float, float, float]
    """a, b, c [m]."""

    def numbers(self) -> Array:
        """The semi-axes."""
        return np.array(self.semi_axes)

    @staticmethod
    def nearest_entry(data: Any, io: Any) -> None:
        """From the root of one equation."""
        x, y, z = point_of(data, io)
        nx, ny, nz, io[6] = _nearest(data[OWN], data[OWN + 1], data[OWN + 2], x, y, z)
        set_vector(data, nx, ny, nz, io, 3)
        io[7] = FACE

    @staticmethod
    def chart_entry(data: Any, io: Any) -> None:
        """See `chart_on`."""
        chart_on(data, data[OWN], data[OWN + 1], data[OWN + 2], io)

    def feet(self) -> tuple[Foot, ...]:
        """As it is."""
        return (Foot("ellipsoid", self.centre, semi_axes=self.semi_axes, rotation=self.rotation),)

    def surface_points(self, count: int) -> tuple[Array, Array]:
        """Of many points each time the one farthest from those chosen before."""
        axes = np.array(self.semi_axes)
        many = fibonacci_sphere(_CANDIDATES * count) * axes
        chosen, gap = np.zeros(count, dtype=np.int64), np.full(len(many), np.inf)
        for k in range(1, count):
            gap = np.minimum(gap, np.sum((many - many[chosen[k - 1]]) ** 2, axis=1))
            chosen[k] = np.argmax(gap)
        points = many[chosen]
        slope = points / axes**2
        return self.in_object(points, slope / np.linalg.norm(slope, axis=1, keepdims=True))


@compiled
def _nearest(a, b, c, x, y, z):
    """Outward normal at the nearest point, and signed distance.

    The nearest point p of y obeys y - p = t (p_i / a_i^2), so p_i = a_i^2 y_i / (t + a_i^2), and t is the largest root
    of

        g(t) = sum {a_i y_i / (t + a_i^2)}^2 - 1

    g falls and is convex above minus the square of the shortest semi-axis m, so Newton's method from a place with g >=
    0 goes to the root without passing it. It is done in s = t + m^2, where nothing cancels. Where no such root is left,
    the point lies inside on a plane of symmetry, and two points at the end of the axis m are nearest; the positive one
    is taken.
    """
    m2 = min(a * a, b * b, c * c)
    e0, e1, e2 = a * a - m2, b * b - m2, c * c - m2
    f0, f1, f2 = a * abs(x), b * abs(y), c * abs(z)
    s = max(f0 - e0, f1 - e1, f2 - e2, 0.0)
    for _ in range(_MOST_ROUNDS):
        q0 = f0 / (s + e0) if f0 > 0.0 else 0.0
        q1 = f1 / (s + e1) if f1 > 0.0 else 0.0
        q2 = f2 / (s + e2) if f2 > 0.0 else 0.0
        g = q0 * q0 + q1 * q1 + q2 * q2 - 1.0
        if g <= 0.0:
            break
        slope = 0.0
        slope += q0 * q0 / (s + e0) if f0 > 0.0 else 0.0
        slope += q1 * q1 / (s + e1) if f1 > 0.0 else 0.0
        slope += q2 * q2 / (s + e2) if f2 > 0.0 else 0.0
        moved = s + 0.5 * g / slope
        if moved == s:
            break
        s = moved
    # the normal is p_i / a_i^2 = y_i / (t + a_i^2), made a unit vector
    n0 = abs(x) / (s + e0) if f0 > 0.0 else 0.0
    n1 = abs(y) / (s + e1) if f1 > 0.0 else 0.0
    n2 = abs(z) / (s + e2) if f2 > 0.0 else 0.0
    if s == 0.0:
        left = math.sqrt(max(0.0, 1.0 - (a * n0) ** 2 - (b * n1) ** 2 - (c * n2) ** 2)) / math.sqrt(m2)
        if e2 == 0.0:
            n2 = left
        elif e1 == 0.0:
            n1 = left
        else:
            n0 = left
    length = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    return (
        math.copysign(n0, x) / length,
        math.copysign(n1, y) / length,
        math.copysign(n2, z) / length,
        (s - m2) * length,
    )


@compiled
def chart_on(data, a, b, c, io):
    """Coordinates of an ellipsoid at a point f of its surface with the normal n, and the x axis along f_u.

        M = [x . f_u, x . f_v; 0, y . f_v],   T M = (y . f_uu, y . f_uv) / |f_u|

    and K is the slope of the normal, (I - n n^T) diag(1 / a_i^2) / |grad|, in x and y. At the poles, where f_u is zero,
    x is the limit along the meridian u, and T has no limit: the latitude is then taken a little short of 90 deg.
    """
    px, py, pz = point_of(data, io)
    nx, ny, nz = normal_of(data, io)
    sin_v = min(max(pz / c, -1.0), 1.0)
    cos_v = max(math.hypot(px / a, py / b), 1e-9)
    u = math.atan2(py / b, px / a)
    cos_u, sin_u = math.cos(u), math.sin(u)
    fu = math.hypot(a * sin_u, b * cos_u)
    xx, xy = -a * sin_u / fu, b * cos_u / fu
    yx, yy, yz = -nz * xy, nz * xx, nx * xy - ny * xx
    vx, vy, vz = -a * cos_u * sin_v, -b * sin_u * sin_v, c * cos_v
    m11, m12, m22 = fu * cos_v, xx * vx + xy * vy, yx * vx + yy * vy + yz * vz
    gx, gy, gz = px / (a * a), py / (b * b), pz / (c * c)
    slope = math.sqrt(gx * gx + gy * gy + gz * gz)
    turn_u = (-a * cos_u * yx - b * sin_u * yy) / fu
    turn_v = (a * sin_u * yx - b * cos_u * yy) * sin_v / (fu * cos_v)
    io[8], io[9] = u, math.atan2(sin_v, cos_v)
    set_vector(data, xx, xy, 0.0, io, 10)
    io[13], io[14], io[15] = m11, m12, m22
    io[16] = (xx * xx / (a * a) + xy * xy / (b * b)) / slope
    io[17] = (xx * yx / (a * a) + xy * yy / (b * b)) / slope
    io[18] = (yx * yx / (a * a) + yy * yy / (b * b) + yz * yz / (c * c)) / slope
    io[19] = turn_u / m11
    io[20] = (turn_v - io[19] * m12) / m22
