"""Whether a contact point of an object of several parts is on its outer surface, and alone there with its tip."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from softhand.errors import GraspError
from softhand.model.shapes.shape import Shape
from softhand.model.shapes.union import Union
from softhand.numerics.arrays import Array
from softhand.start.reach import millimetres

ON_SURFACE = 1e-6
"""A contact point may lie so far from the surface [m]."""


def check_is_outer(name: str, shape: Shape, point: ArrayLike) -> None:
    """GraspError for a point on the surface of one part of an object that lies inside another one."""
    hidden = shape.covered(point, ON_SURFACE) if isinstance(shape, Union) else None
    if hidden is not None:
        foot, _ = shape.nearest(point)
        raise GraspError(
            f"{name}: the contact point {millimetres(point)} mm of the object frame lies on {hidden.on} of the object, "
            f"{1e3 * hidden.depth:.3g} mm inside {hidden.inside}: no surface is there. The outer surface is at "
            f"{millimetres(foot)} mm; give a point of it in grasp.contact_points.",
            finger=name, quantity="contact point", value=hidden.depth,
        )  # fmt: skip


def check_touches_alone(name: str, shape: Shape, point: Array, normal: Array, reach: float) -> None:
    """GraspError for a tip that would be nearer to another part of the object than to its contact point.

    Args:
        name: of the tip.
        shape: of the object.
        point: of its surface [m].
        normal: outward there.
        reach: distance of the centre of the tip from the point [m].
    """
    if not isinstance(shape, Union):
        return
    centre = point + reach * normal
    foot, _ = shape.nearest(centre)
    nearer = reach - float(np.linalg.norm(foot - centre))
    if nearer > ON_SURFACE:
        raise GraspError(
            f"{name}: at the contact point {millimetres(point)} mm of the object frame the tip would reach "
            f"{1e3 * nearer:.3g} mm deeper into {shape.names[shape.part_at(centre)]} of the object; move the point "
            "away from there in grasp.contact_points.",
            finger=name, quantity="contact point", value=nearer,
        )  # fmt: skip
