"""What every convex shape of an object can do, and how kernels ask it by address.

A shape is data of the kernels and not part of them, as fingertip laws are: each kind compiles two functions
`void f(double *data, double *io)`. `data` starts with the axes and the centre of the shape in the object frame, `io` is

     0.. 2   in: a point of the object frame [m]
     3.. 5   outward unit normal of the surface at the point nearest to it, in the object frame
     6       signed distance of the point from the surface [m], negative inside
     7       feature: 1 a face or a curved surface, 2 an edge, 3 a vertex; a union says more by it, see `union`
     8.. 9   alpha_o, the surface coordinates of a point on the surface
    10..12   x axis of C_O there, in the object frame
    13..15   M_go [m or 1], an upper triangle: m11, m12, m22
    16..18   K_go [1/m], symmetric: k11, k12, k22
    19..20   T_go [1/m]

`nearest` fills 3 to 7, and may read at 8 the radius of the tip whose centre the point is [m]. `chart`, which curved
shapes have, takes a point of the surface and its normal, 0 to 5, and fills the rest. With the x axis, y = z cross x and
the rate of alpha_o they say how the point moves and the frame C_O turns,

    v = (M_go alpha_o', 0),   w = (E K_go M_go alpha_o', T_go M_go alpha_o')                                    (34)
"""

from __future__ import annotations

import ctypes
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from numba import cfunc, float64, types
from numpy.typing import ArrayLike, NDArray

from softhand.model.shapes.face import Face
from softhand.model.shapes.foot import Foot
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled, kernel_folder

OWN = 12
"""Where the numbers of the kind of shape begin in `data`."""
RESULTS = 21
"""Length of `io`."""
FACE, EDGE, VERTEX = 1, 2, 3
SHARP = 1e12
"""Curvature that stands for that of an edge [1/m]."""

_SIGNATURE = types.void(types.CPointer(float64), types.CPointer(float64))
_POINTER = ctypes.POINTER(ctypes.c_double)


@dataclass(frozen=True, eq=False)
class Shape(ABC):
    """A solid convex shape, fixed in the frame of an object."""

    rotation: Array
    """Axes of the shape in the object frame, shape (3, 3)."""
    centre: Array
    """In the object frame [m], shape (3,)."""

    @abstractmethod
    def feet(self) -> tuple[Foot, ...]:
        """What of it can meet a plane, on which it stands, lies or rolls."""

    @abstractmethod
    def surface_points(self, count: int) -> tuple[Array, Array]:
        """Points spread evenly over the surface, off its edges [m], and outward normals there, shapes (count, 3)."""

    @abstractmethod
    def nearest(self, point: ArrayLike) -> tuple[Array, Array]:
        """The nearest point of the surface [m] and the outward normal there, shape (3,) each, in the object frame.

        For a point outside, the normal points at it, on edges as well; inside it is that of the nearest surface.
        """

    @abstractmethod
    def face_at(self, point: ArrayLike) -> Face:
        """The face, or the tangent plane, nearest to a point of the object frame [m]."""

    def faces(self) -> tuple[Face, ...]:
        """All its plane faces; none of a curved shape."""
        return ()

    def in_object(self, points: Array, normals: Array) -> tuple[Array, Array]:
        """Points and normals from the axes of the shape to those of the object, shape (n, 3) each."""
        return self.centre + points @ self.rotation.T, normals @ self.rotation.T


@dataclass(frozen=True, eq=False)
class CompiledShape(Shape):
    """A shape that the kernels call by address."""

    @abstractmethod
    def numbers(self) -> Array:
        """What `nearest_entry` and `chart_entry` find from `OWN` on, in axes of the shape."""

    @staticmethod
    @abstractmethod
    def nearest_entry(data: Any, io: Any) -> None:
        """Formula of the nearest point, compiled at its first use."""

    @cached_property
    def data(self) -> Array:
        """Axes, centre and numbers; kernels hold its address, so whoever uses that keeps the shape."""
        return np.concatenate([self.rotation.ravel(), self.centre, self.numbers()])

    @property
    def nearest_function(self) -> int:
        """Address of the compiled nearest point."""
        return int(compile_entry(type(self).nearest_entry).address)

    @property
    def chart_function(self) -> int:
        """Address of the compiled surface coordinates; 0 if tips roll on plane faces only."""
        return 0

    def near(self, point: ArrayLike) -> Array:
        """`io` of the nearest point."""
        io = np.zeros(RESULTS)
        io[:3] = point
        return self._call(type(self).nearest_entry, io)

    def _call(self, entry: Callable[..., Any], io: Array) -> Array:
        compile_entry(entry).ctypes(self.data.ctypes.data_as(_POINTER), io.ctypes.data_as(_POINTER))
        return io

    def nearest(self, point: ArrayLike) -> tuple[Array, Array]:
        """As `Shape.nearest`."""
        io = self.near(point)
        return io[:3] - io[6] * io[3:6], io[3:6]


@dataclass(frozen=True, eq=False)
class CurvedShape(CompiledShape):
    """A shape with curved surfaces, on which tips roll as they are."""

    @staticmethod
    @abstractmethod
    def chart_entry(data: Any, io: Any) -> None:
        """Formula of the surface coordinates."""

    @property
    def chart_function(self) -> int:
        """Address of the compiled surface coordinates."""
        return int(compile_entry(type(self).chart_entry).address)

    def chart(self, point: ArrayLike) -> Array:
        """`io` of the surface coordinates at the point of the surface that is nearest to a point."""
        io = self.near(point)
        io[:3] -= io[6] * io[3:6]
        return self._call(type(self).chart_entry, io)

    def face_at(self, point: ArrayLike) -> Face:
        """The tangent plane."""
        io = self.chart(point)
        return Face(io[3:6].copy(), io[10:13].copy(), float(io[3:6] @ io[:3]), is_curved=True)


@cache
def compile_entry(entry: Callable[..., Any]) -> Any:
    """The machine code of one of the two functions of a shape."""
    with kernel_folder(entry.__module__):
        return cfunc(_SIGNATURE, cache=True, error_model="numpy")(entry)


@compiled
def point_of(data, io):
    """The point of `io` in axes of the shape."""
    x, y, z = io[0] - data[9], io[1] - data[10], io[2] - data[11]
    return (
        data[0] * x + data[3] * y + data[6] * z,
        data[1] * x + data[4] * y + data[7] * z,
        data[2] * x + data[5] * y + data[8] * z,
    )


@compiled
def normal_of(data, io):
    """The normal of `io` in axes of the shape."""
    x, y, z = io[3], io[4], io[5]
    return (
        data[0] * x + data[3] * y + data[6] * z,
        data[1] * x + data[4] * y + data[7] * z,
        data[2] * x + data[5] * y + data[8] * z,
    )


@compiled
def set_vector(data, x, y, z, io, start):
    """Write a vector of the shape to `io`, in axes of the object."""
    io[start] = data[0] * x + data[1] * y + data[2] * z
    io[start + 1] = data[3] * x + data[4] * y + data[5] * z
    io[start + 2] = data[6] * x + data[7] * y + data[8] * z


def fibonacci_sphere(count: int) -> Array:
    """Points spread evenly over the unit sphere along a spiral, shape (count, 3)."""
    k = np.arange(count) + 0.5
    height = 1.0 - 2.0 * k / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * k
    across = np.sqrt(1.0 - height**2)
    return np.column_stack([across * np.cos(angle), across * np.sin(angle), height])


def unit_square(count: int) -> Array:
    """Points spread evenly over the unit square: the R2 sequence of Roberts, shape (count, 2)."""
    k = np.arange(1, count + 1)[:, None]
    spread: Array = np.mod(0.5 + k * [0.7548776662466927, 0.5698402909980532], 1.0)
    return spread


def shares(areas: ArrayLike, count: int) -> NDArray[np.int64]:
    """How many of `count` points each of some areas gets."""
    steps = np.round(np.cumsum(areas) / np.sum(areas) * count).astype(np.int64)
    return np.diff(steps, prepend=0)
