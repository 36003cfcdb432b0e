"""Kernels: how deep points lie in the object, in a loop over all of them at once where its formula is short."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.contact.address import call
from softhand.model.shapes.box import Box
from softhand.model.shapes.cylinder import Cylinder
from softhand.model.shapes.shape import RESULTS, Shape
from softhand.model.shapes.sphere import Sphere
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled

CALLED, BOX, BALL, CAN = range(4)
"""Kinds of objects; `CALLED` is asked point by point by its address, in the frame of its body."""


class Solid(NamedTuple):
    """The object that all tips touch, for kernels."""

    kind: NDArray[np.int64]
    """One of the kinds, shape (1,)."""
    frame: Array
    """Its axes in the frame of its body, row by row, and its centre there [m], shape (12,)."""
    size: Array
    """Half edges of a box; radius of a ball; radius and half the height of a can [m], shape (3,)."""
    to_solid: Array
    """Scratch: from the contact frame, over r, to its axes, in the last row the origin of that there, shape (4, 3)."""
    near: Array
    """Scratch for the function of a shape."""


def solid_of(shape: Shape | None) -> Solid:
    """For kernels, with scratch of its own; None where nothing but plane faces is touched."""
    kind, size, rotation, centre = CALLED, np.zeros(3), np.eye(3), np.zeros(3)
    if isinstance(shape, Box):
        kind, size = BOX, np.array(shape.half, dtype=float)
    elif isinstance(shape, Sphere):
        kind, size = BALL, np.array([shape.radius, 0.0, 0.0])
    elif isinstance(shape, Cylinder):
        kind, size = CAN, np.array([shape.radius, shape.half, 0.0])
    if shape is not None and kind != CALLED:
        rotation, centre = shape.rotation, shape.centre
    frame = np.concatenate([np.ravel(rotation), centre])
    return Solid(np.array([kind]), frame, size, np.zeros((4, 3)), np.zeros(RESULTS))


@compiled
def set_depths(solid, pad, contact, base_pose, moved, taking, count, below):
    """How deep taxels lie below the surface of a solid, negative outside.

    Args:
        solid: `Solid`.
        pad: row of `records.PAD`.
        contact: row of `records.CONTACT`.
        base_pose: of the object, shape (12,).
        moved: taxels in the contact frame, over r, shape (3, taxels).
        taking: numbers of those that are asked for.
        count: how many of them.
        below: set [m], shape (taxels,).
    """
    _carry(solid, pad, contact, base_pose)
    a, b, c = solid.size[0], solid.size[1], solid.size[2]
    if solid.kind[0] == BALL:
        for k in range(count):
            t = taking[k]
            x, y, z = _at(solid.to_solid, moved, t)
            below[t] = a - math.sqrt(x * x + y * y + z * z)
    elif solid.kind[0] == CAN:
        for k in range(count):
            t = taking[k]
            x, y, z = _at(solid.to_solid, moved, t)
            out, above = math.sqrt(x * x + y * y) - a, abs(z) - b
            below[t] = _below(out, above, max(out, 0.0), max(above, 0.0), 0.0)
    elif solid.kind[0] == BOX:
        for k in range(count):
            t = taking[k]
            x, y, z = _at(solid.to_solid, moved, t)
            x, y, z = abs(x) - a, abs(y) - b, abs(z) - c
            below[t] = _below(max(x, y), z, max(x, 0.0), max(y, 0.0), max(z, 0.0))
    else:
        near = solid.near
        for k in range(count):
            t = taking[k]
            near[0], near[1], near[2] = _at(solid.to_solid, moved, t)
            call(pad.nearest_function, pad.shape_data, near)  # type: ignore[call-arg]
            below[t] = -near[6]


@compiled
def _below(first, second, x, y, z):
    """Inside the least depth below a side, else minus the distance (x, y, z) from all sides that lie in between."""
    square = x * x + y * y + z * z
    return -math.sqrt(square) if square > 0.0 else -max(first, second)


@compiled
def _at(A, v, t):
    """A taxel in axes of the solid."""
    x, y, z = v[0, t], v[1, t], v[2, t]
    return (
        A[3, 0] + A[0, 0] * x + A[0, 1] * y + A[0, 2] * z,
        A[3, 1] + A[1, 0] * x + A[1, 1] * y + A[1, 2] * z,
        A[3, 2] + A[2, 0] * x + A[2, 1] * y + A[2, 2] * z,
    )


@compiled
def _carry(solid, pad, contact, base_pose):
    """Sets `to_solid`."""
    A, S, C = solid.to_solid, solid.frame, contact.rotation
    for k in range(3):
        A[3, k] = 0.0
        for j in range(3):
            A[k, j] = 0.0
    for j in range(3):  # axes of the body in the world, by those of the solid
        along = -S[9 + j]
        for row in range(3):
            along += base_pose[3 * j + row] * (contact.tip[row] - base_pose[9 + row])
        for k in range(3):
            share = S[3 * j + k]
            A[3, k] += share * along
            for row in range(3):
                axis = share * pad.radius * base_pose[3 * j + row]
                for column in range(3):
                    A[k, column] += axis * C[row, column]
