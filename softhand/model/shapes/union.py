"""Several convex shapes as one solid: their union, met at its nearest outer surface."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from softhand.model.shapes.box import nearest_face
from softhand.model.shapes.cylinder import Cylinder
from softhand.model.shapes.face import Face
from softhand.model.shapes.foot import Foot
from softhand.model.shapes.part_call import call_part
from softhand.model.shapes.polyhedron import Polyhedron
from softhand.model.shapes.protruding import feet_of_hull
from softhand.model.shapes.shape import FACE, OWN, CompiledShape, compile_entry
from softhand.model.shapes.sphere import Sphere
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled

Part = Polyhedron | Cylinder | Sphere
"""What a union may be made of."""
MOST_PARTS = 99
PART = 10
"""The number of the part, from 1, times this is added to `FACE`, `EDGE` or `VERTEX`."""
TWO_PARTS = 1000
"""Is added where a tip reaches another part as well."""

_ROW = 7  # numbers of a part before its own: two functions, where its own begin, centre and radius of a ball around it
_SEAM = 1e-6  # [m] a surface closer than this to another part is none
_STEPS = 16  # doublings of the way across a seam
_PARALLEL = 1.0 - 1e-9  # cosine of two normals that are one
_STANDS_OUT = 0.02  # of the radius of a tip: a part that reaches less above the tangent plane is the same surface


class Covered(NamedTuple):
    """A place on the surface of one part that lies inside another one."""

    on: str
    inside: str
    depth: float
    """[m]"""


class Off(NamedTuple):
    """How far the surface of a mesh is from that of the parts it was cut into, at places all over it."""

    inside: float
    """How deep it lies in them at most: what is filled that should be hollow [m]."""
    outside: float
    """How far it lies outside of them at most [m]."""


@dataclass(frozen=True, eq=False)
class Union(CompiledShape):
    """The points that lie in at least one of some convex parts.

    Outside, the signed distance is the least of those of the parts, and so it is exact. Inside, the depth is the
    greatest of those of the parts that the point lies in, which is exact where the nearest point of that part is on the
    outer surface. Where it lies in another part, at a seam, `_beside_seam` looks for the surface: exactly near a face
    that goes on over the seam, else one that is not nearer than the true one.

    Tips never follow a face without an end here, whatever contact is asked for.
    """

    parts: tuple[Part, ...]
    """Each placed in the object frame."""
    names: tuple[str, ...]
    """What each is called."""
    off: Off | None = None
    """How far they are from the meshes that they were cut from; None if they are as the URDF has them."""

    @classmethod
    def of(cls, parts: tuple[Part, ...], names: tuple[str, ...] | None = None, off: Off | None = None) -> Union:
        """Of parts that are placed in the object frame."""
        called = tuple(f"part {k}" for k in range(1, len(parts) + 1)) if names is None else names
        return cls(np.eye(3), np.zeros(3), parts, called, off)

    def numbers(self) -> Array:
        """Count of parts; a row of each; the data of all."""
        rows: list[list[float]] = []
        first = OWN + 1 + _ROW * len(self.parts)
        for part in self.parts:
            rows.append([part.nearest_function, part.chart_function, first, *_ball_around(part)])
            first += len(part.data)
        return np.concatenate([[len(rows)], np.ravel(rows), *(part.data for part in self.parts)])

    @staticmethod
    def nearest_entry(data: Any, io: Any) -> None:
        """The nearest of all parts; io[8] is read as the radius of the tip that is there, 0 for none."""
        x, y, z = io[0], io[1], io[2]
        radius = io[8]
        best, feature = _least(data, io)
        distance, nx, ny, nz = io[6], io[3], io[4], io[5]
        if distance < _SEAM:
            fx, fy, fz = x - distance * nx, y - distance * ny, z - distance * nz
            if not _is_outside(data, best, fx + _SEAM * nx, fy + _SEAM * ny, fz + _SEAM * nz, io):
                best, feature, distance, nx, ny, nz = _beside_seam(
                    data, (x, y, z), (best, feature, distance, nx, ny, nz), io
                )
        io[0], io[1], io[2] = x, y, z
        if 0.0 < distance < radius and _meets_another(data, best, distance, nx, ny, nz, radius, io):
            feature += TWO_PARTS
        io[3], io[4], io[5], io[6] = nx, ny, nz, distance
        io[7], io[8] = feature + PART * (best + 1), radius

    @staticmethod
    def chart_entry(data: Any, io: Any) -> None:
        """That of the part whose surface is there; on a plane face the place along two axes that n alone determines."""
        nx, ny, nz = io[3], io[4], io[5]
        best, closest = 0, math.inf
        for k in range(int(data[OWN])):
            row = OWN + 1 + _ROW * k
            call_part(int(data[row]), data, int(data[row + 2]), io)  # type: ignore[call-arg]
            if abs(io[6]) < closest:
                best, closest = k, abs(io[6])
        io[3], io[4], io[5] = nx, ny, nz
        row = OWN + 1 + _ROW * best
        if data[row + 1] != 0.0:
            call_part(int(data[row + 1]), data, int(data[row + 2]), io)  # type: ignore[call-arg]
            return
        tx, ty, tz = -nz * nx, -nz * ny, 1.0 - nz * nz  # z of the object, or x where n is along z, across n
        if nz * nz > 0.5:
            tx, ty, tz = 1.0 - nx * nx, -nx * ny, -nx * nz
        length = math.sqrt(tx * tx + ty * ty + tz * tz)
        tx, ty, tz = tx / length, ty / length, tz / length
        sx, sy, sz = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
        io[8] = tx * io[0] + ty * io[1] + tz * io[2]
        io[9] = sx * io[0] + sy * io[1] + sz * io[2]
        io[10], io[11], io[12] = tx, ty, tz
        io[13], io[14], io[15] = 1.0, 0.0, 1.0
        for k in range(16, 21):
            io[k] = 0.0

    @property
    def chart_function(self) -> int:
        """Address of the compiled surface coordinates; 0 if all parts have plane faces only."""
        return int(compile_entry(Union.chart_entry).address) if any(part.chart_function for part in self.parts) else 0

    def chart(self, point: ArrayLike) -> Array:
        """`io` of the surface coordinates at the point of the surface that is nearest to a point."""
        io = self.near(point)
        io[:3] -= io[6] * io[3:6]
        return self._call(type(self).chart_entry, io)

    def part_at(self, point: ArrayLike) -> int:
        """Which part the outer surface nearest to a point belongs to, from 0."""
        return int(self.near(point)[7]) // PART % (TWO_PARTS // PART) - 1

    def face_at(self, point: ArrayLike) -> Face:
        """That of the part that is touched there; at a seam the one that is no side of the seam."""
        io = self.near(point)
        part = self.parts[self.part_at(point)]
        if not isinstance(part, Polyhedron):
            return part.face_at(point)
        beside = [face for face in part.faces() if face.normal @ io[3:6] > _PARALLEL]
        return nearest_face(tuple(beside) or part.faces(), point)

    def feet(self) -> tuple[Foot, ...]:
        """Of all parts, as far as a plane can come to them."""
        return feet_of_hull(self.parts)

    def surface_points(self, count: int) -> tuple[Array, Array]:
        """About so many points spread over the outer surface, off its edges, and the normals there."""
        wanted, share = max(count, 8), 1.0
        areas = np.array([part.area for part in self.parts])
        for _ in range(2):
            numbers = np.maximum(np.round(wanted / share * areas / areas.sum()), 1.0).astype(int)
            found = [part.surface_points(int(number)) for part, number in zip(self.parts, numbers, strict=True)]
            points, normals = (np.concatenate([each[k] for each in found]) for k in range(2))
            owners = np.repeat(np.arange(len(self.parts)), [len(each[0]) for each in found])
            is_outer = np.array([
                self.cover(point + _SEAM * normal, int(owner)) is None
                for point, normal, owner in zip(points, normals, owners, strict=True)
            ])  # fmt: skip
            share = max(float(np.mean(is_outer)), 0.05)
        return points[is_outer], normals[is_outer]

    def cover(self, point: ArrayLike, but: int) -> tuple[int, float] | None:
        """A part that a point lies inside, other than one, and how deep [m]."""
        for k, part in enumerate(self.parts):
            if k != but and (depth := -float(part.near(point)[6])) > 0.0:
                return k, depth
        return None

    def covered(self, point: ArrayLike, close: float) -> Covered | None:
        """What hides a point that lies on the surface of a part, to within `close` [m]; None if nothing does."""
        for k, part in enumerate(self.parts):
            if abs(part.near(point)[6]) <= close and (hidden := self.cover(point, k)) and hidden[1] > close:
                return Covered(self.names[k], self.names[hidden[0]], hidden[1])
        return None

    @cached_property
    def round_parts(self) -> tuple[Part, ...]:
        """Those with a curved surface."""
        return tuple(part for part in self.parts if not isinstance(part, Polyhedron))


def parts_of(shape: Any) -> tuple[Any, ...]:
    """The convex shapes that a shape is made of."""
    return shape.parts if isinstance(shape, Union) else (shape,)


def _ball_around(part: Part) -> tuple[float, ...]:
    """Centre and radius of a ball that holds a part [m]."""
    if isinstance(part, Polyhedron):
        corners = part.corners()
        centre = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        return *centre, float(np.max(np.linalg.norm(corners - centre, axis=1)))
    return *part.centre, part.radius if isinstance(part, Sphere) else math.hypot(part.radius, part.half)


@compiled
def _least(data, io):
    """The part to which io[0:3] has the least signed distance, and the feature there; io[3:7] are of it."""
    best, feature, least = 0, FACE, math.inf
    nx, ny, nz = 0.0, 0.0, 1.0
    for k in range(int(data[OWN])):
        row = OWN + 1 + _ROW * k
        if _far(data, row, io) >= least:
            continue
        call_part(int(data[row]), data, int(data[row + 2]), io)  # type: ignore[call-arg]
        if io[6] < least or (io[6] == least and io[7] < feature):  # over a seam a face, and not the edge of the other
            best, feature, least = k, int(io[7]), io[6]
            nx, ny, nz = io[3], io[4], io[5]
    io[3], io[4], io[5], io[6] = nx, ny, nz, least
    return best, feature


@compiled
def _beside_seam(data, point, at_seam, io):
    """The outer surface nearest to a point whose deepest part ends at a seam, sought to both sides along its normal.

    Part, feature, signed distance and normal, as they are given of the seam and as they are returned. On a face that
    goes on over the seam the foot is found from a place that is farther from the seam than from that face.
    """
    x, y, z = point
    _, _, depth, nx, ny, nz = at_seam
    found, least = at_seam, -math.inf
    for side in range(2):
        way = max(-depth, _SEAM)
        for _ in range(_STEPS):
            along = way - depth if side == 0 else -way
            px, py, pz = x + along * nx, y + along * ny, z + along * nz
            io[0], io[1], io[2] = px, py, pz
            part, feature = _least(data, io)
            below, mx, my, mz = io[6], io[3], io[4], io[5]
            if below >= _SEAM:
                break
            gx, gy, gz = px - below * mx, py - below * my, pz - below * mz
            level = mx * (x - gx) + my * (y - gy) + mz * (z - gz)
            if level < _SEAM and _is_outside(data, part, gx + _SEAM * mx, gy + _SEAM * my, gz + _SEAM * mz, io):
                if level > least:
                    found, least = (part, feature, level, mx, my, mz), level
                break
            way *= 2.0
    return found


@compiled
def _far(data, row, io):
    """How far io[0:3] is from the ball around a part."""
    x, y, z = io[0] - data[row + 3], io[1] - data[row + 4], io[2] - data[row + 5]
    return math.sqrt(x * x + y * y + z * z) - data[row + 6]


@compiled
def _is_outside(data, but, x, y, z, io):
    """Whether a point above the surface of one part lies in no other part, nor on one; sets io."""
    io[0], io[1], io[2] = x, y, z
    for k in range(int(data[OWN])):
        row = OWN + 1 + _ROW * k
        if k == but or _far(data, row, io) >= _SEAM:
            continue
        call_part(int(data[row]), data, int(data[row + 2]), io)  # type: ignore[call-arg]
        if io[6] < 0.5 * _SEAM:
            return False
    return True


@compiled
def _meets_another(data, best, distance, nx, ny, nz, radius, io):
    """Whether a ball about io[0:3] reaches another part that stands out of the tangent plane; sets io[3:8]."""
    for k in range(int(data[OWN])):
        row = OWN + 1 + _ROW * k
        if k == best or _far(data, row, io) >= radius:
            continue
        call_part(int(data[row]), data, int(data[row + 2]), io)  # type: ignore[call-arg]
        if io[6] < radius and distance - io[6] * (nx * io[3] + ny * io[4] + nz * io[5]) > _STANDS_OUT * radius:
            return True
    return False
