"""A free body of any shape on a table, as a rig."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from softhand.contact.supports import object_on_table
from softhand.model.shapes.face import Face
from softhand.model.shapes.shape import Shape
from softhand.validation.rigs import MU, TOP, Body, Carriage, Rig, Vector, make_rig, make_world, tip

_FAR = 100.0  # [m] a tip that has no part in it


def on_table(
    shape: Shape,
    body: Body,
    rotation: ArrayLike,
    plane: Face,
    gravity: ArrayLike,
    *,
    depth: float = 0.0,
    friction: float = MU,
    stiffness: float = 2e4,
    damping: float = 10.0,
) -> Rig:
    """A free body at rest on a table.

    Args:
        shape: in axes of the body, its centre of mass in the origin.
        body: its mass and inertia.
        rotation: of the body, shape (3, 3).
        plane: of the table.
        gravity: [m/s^2], shape (3,).
        depth: of the place where it is lowest, in the table [m].
        friction: mu.
        stiffness: as `table.stiffness` [N/m].
        damping: as `table.damping` [N s/m].
    """
    world = make_world([Carriage("Z", mass=1.0, inertia=1.0)], body, gravity, shift=_FAR * plane.normal)
    fingertip = tip(world, TOP)
    world, axes = replace(world, shape=shape), np.asarray(rotation, dtype=float)
    height = plane.offset - depth + max(foot.reach(-axes.T @ plane.normal) for foot in shape.feet())
    supports = object_on_table(world, plane, friction, stiffness, damping)
    return make_rig(world, [fingertip], height * plane.normal, axes, supports)


def cylinder_inertia(mass: float, radius: float, height: float, share: float = 0.5) -> Vector:
    """Inertia about its centre, the axis along z [kg m^2]; `share` m r^2 about the axis: 0.5 solid, 1 a thin wall."""
    across = mass * (0.5 * share * radius**2 + height**2 / 12.0)
    return across, across, share * mass * radius**2
