"""Bodies that stand still and that the object may meet: the places of both that touch, as supports."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from softhand.contact.pads import Support
from softhand.contact.supports import WORLD, spring
from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.errors import ModelError
from softhand.model.shapes.edges import Edge
from softhand.model.shapes.foot import Foot
from softhand.model.shapes.shape import CurvedShape, Shape
from softhand.model.shapes.sphere import Sphere
from softhand.model.shapes.standing_out import edges_that_stand_out, feet_that_stand_out
from softhand.model.shapes.union import parts_of
from softhand.model.world import World
from softhand.numerics.arrays import Array

_POINT_LENGTH = 1e-3  # [m] the law of a point has no torsion, so that any length serves
_MOST = 400


@dataclass(frozen=True)
class Obstacle:
    """A convex body that is fixed in the world.

    Attributes:
        name: label in recordings.
        shape: placed in the world.
        friction: mu.
        stiffness: of a place that touches, normal and tangential [N/m].
        damping: likewise [N s/m].
    """

    name: str
    shape: Shape
    friction: float
    stiffness: float
    damping: float


def object_on_obstacle(world: World, obstacle: Obstacle) -> list[Support]:
    """All places at which the object and an obstacle may touch.

    Of two polyhedra these are the corners of each in the other, and the edges of the object where they cross those of
    the obstacle, two pads each with half of the stiffness. Of a polyhedron and a round body: its corners and its edges
    in that body, and the rims of that body in each of its sides. A ball is one place.

    Of an object of several parts: its corners and edges where it is convex, in the obstacle; the corners and balls of
    the obstacle in the whole of it; the edges and rims of the obstacle in each of its parts.

    The force is that on the base: on the obstacle of what is named `NAME corner 3`, on the object of `NAME's corner 3`.

    Raises:
        ModelError: both are round, or there are too many places.
    """
    ours, theirs = world.shape, obstacle.shape
    body, fixed = (world.object_joint, ours), (WORLD, theirs)
    is_round = [isinstance(part, CurvedShape) for part in parts_of(ours)]
    if isinstance(theirs, Sphere):
        found = list(_of_feet(obstacle, f"{obstacle.name}'s", fixed, body))
    elif isinstance(ours, Sphere):
        found = list(_of_feet(obstacle, obstacle.name, body, fixed))
    elif any(is_round) and isinstance(theirs, CurvedShape):
        round_part = parts_of(ours)[is_round.index(True)]
        raise ModelError(
            f"obstacle '{obstacle.name}': a {type(theirs).__name__.lower()} and an object that is round as well, a "
            f"{type(round_part).__name__.lower()}, cannot meet; make the obstacle a box or a polyhedron.",
            file="",
        )
    else:
        found = [
            *_of_feet(obstacle, obstacle.name, body, fixed),
            *_of_feet(obstacle, f"{obstacle.name}'s", fixed, body),
            *_of_edges(obstacle, obstacle.name, body, fixed),
        ]
        for part, is_curved in zip(parts_of(ours), is_round, strict=True):
            if is_curved:
                found += _of_edges(obstacle, f"{obstacle.name}'s", fixed, (world.object_joint, part))
    if len(found) > _MOST:
        raise ModelError(
            f"obstacle '{obstacle.name}': {len(found)} corners and edges may touch, and at most {_MOST} are followed; "
            "take a collision shape with fewer faces, such as a box.",
            file="",
        )
    return found


Body = tuple[int, Shape]
"""The joint that carries a shape, and the shape in its frame."""


def _of_feet(obstacle: Obstacle, name: str, one: Body, other: Body) -> Iterator[Support]:
    """The feet of one body in the other: points and balls in it as it is, ellipsoids in each of its sides."""
    sides = [(part, face) for part in parts_of(other[1]) for face in part.faces()]
    for foot in feet_that_stand_out(one[1]):
        if foot.semi_axes is None:
            yield _support(obstacle, f"{name} {foot.name}", foot, one[0], other)
            continue
        for k, (part, face) in enumerate(sides, 1):
            met = _support(obstacle, f"{name} {foot.name} on side {k}", foot, one[0], (other[0], part))
            yield replace(met, side=face)


def _of_edges(obstacle: Obstacle, name: str, one: Body, other: Body) -> Iterator[Support]:
    """The edges of one body in the other."""
    is_round = isinstance(other[1], CurvedShape)
    for k, edge in enumerate(edges_that_stand_out(one[1]), 1):
        foot = Foot("", edge.middle, rotation=_axes(edge), share=1.0 if is_round else 0.5)
        for end, way in (("", 0),) if is_round else ((" a", -1), (" b", 1)):
            met = _support(obstacle, f"{name} edge {k}{end}", foot, one[0], other)
            yield replace(met, edge=edge.half, way=way)


def _support(obstacle: Obstacle, name: str, foot: Foot, joint: int, other: Body) -> Support:
    base, shape = other
    stiffness, damping = foot.share * obstacle.stiffness, foot.share * obstacle.damping
    return Support(
        name=name,
        law=spring(stiffness),
        friction=obstacle.friction,
        joint=joint,
        position=foot.position,
        rotation=foot.rotation,
        radius=foot.radius,
        semi_axes=foot.semi_axes,
        base=base,
        shape=shape,
        face=shape.face_at(shape.surface_points(1)[0][0]),
        damping=KelvinVoigt(radial=damping, tangential=damping, torsional=0.0),
        torsion_length=_POINT_LENGTH,
        limit="ellipse",
        obstacle=obstacle.shape,
        of=obstacle.name,
    )


def _axes(edge: Edge) -> Array:
    """Axes with x along an edge, shape (3, 3)."""
    x = edge.direction
    y = np.cross(x, np.eye(3)[np.argmin(np.abs(x))])
    y /= np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])
