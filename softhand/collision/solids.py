"""The solids of a hand, its object and what stands around, each on the joint that moves it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import coal
import numpy as np
import pinocchio as pin

from softhand.collision.shapes import SoftBall, as_coal, outside, solid_shape
from softhand.errors import ModelError
from softhand.model.coupling import CouplingTable, read_map
from softhand.model.joined import find_frame
from softhand.model.shapes.face import Face
from softhand.model.shapes.shape import Shape
from softhand.model.urdf.geometry import Geometry, Purpose
from softhand.model.urdf.pinocchio_model import build_model
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.arrays import Array

OBJECT, TABLE = "object", "table"
BASE = 0


@dataclass(frozen=True)
class Situation:
    """Whose collisions are asked for.

    Attributes:
        hand: with its mount and the tips that were placed.
        held: the object.
        tips: name and radius [m] of each soft tip.
        palms: name, frame, centre in that frame [m] and radius [m] of each.
        plane: of the table; None without one.
        obstacles: name and shape in the world of each.
        ellipsoid: semi-axes in the place of the object's shape [m].
        coupling: of the joints, beside the URDF.
        tips_touch: whether the contact model lets tips meet each other.
        shapes: of the hand that count.
        parts: of the object, where they are others than its URDF has; a mesh that was cut, say.
    """

    hand: Urdf
    held: Urdf
    tips: Sequence[tuple[str, float]]
    palms: Sequence[tuple[str, str, Sequence[float], float]] = ()
    plane: Face | None = None
    obstacles: Sequence[tuple[str, Shape]] = ()
    ellipsoid: Sequence[float] | None = None
    coupling: CouplingTable | None = None
    tips_touch: bool = False
    shapes: Purpose = "collision"
    parts: Sequence[Shape] = ()


@dataclass(frozen=True, eq=False)
class Solid:
    """A shape that one body carries.

    Attributes:
        name: of its link, or `object`, `table`, `palm 1`.
        body: index of the joint that carries it, 0 for the base; that of the object is the last one.
        shape: for coal.
        rotation: its axes in the frame of the joint, shape (3, 3).
        position: its origin there [m], shape (3,).
        is_palm: whether it is the ball of a palm, and no link.
    """

    name: str
    body: int
    shape: coal.ShapeBase
    rotation: Array = field(default_factory=lambda: np.eye(3))
    position: Array = field(default_factory=lambda: np.zeros(3))
    is_palm: bool = False

    @property
    def is_endless(self) -> bool:
        """Whether it is the half space of a table."""
        return isinstance(self.shape, coal.Halfspace)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Centre and half edges of a box about it, along its own axes [m], shape (3,) each."""
        self.shape.computeLocalAABB()
        low, high = np.array(self.shape.aabb_local.min_), np.array(self.shape.aabb_local.max_)
        return 0.5 * (low + high), 0.5 * (high - low)


class Kinematics:
    """Where the bodies are.

    Attributes:
        model: Pinocchio model of the hand alone.
        n_bodies: joints of the hand with the base, and the object.
        rest: angles of the motors at zero, or at the limit nearest to it [rad or m], shape (n,).
    """

    def __init__(self, hand: Urdf, table: CouplingTable | None) -> None:
        self.model = build_model(hand)
        self.n_bodies = self.model.njoints + 1
        self._map, self._data = read_map(hand, self.model, table), self.model.createData()
        self._joints = [(joint.idx_q, joint.nq, joint.idx_v) for joint in list(self.model.joints)[1:]]
        if self._map is not None:
            self.rest = np.zeros(len(self._map.motors))
        else:
            self.rest = np.zeros(self.model.nv)
            for q, nq, v in self._joints:
                if nq == 1:
                    limits = self.model.lowerPositionLimit[q], self.model.upperPositionLimit[q]
                    self.rest[v] = min(max(0.0, limits[0]), limits[1])

    def poses(self, angles: Array, position: Array, rotation: Array) -> tuple[Array, Array]:
        """Axes, shape (k, bodies, 3, 3), and origins [m], shape (k, bodies, 3), of all bodies.

        Args:
            angles: of joints or motors [rad or m], shape (k, n).
            position: of the object [m], shape (k, 3).
            rotation: its axes, shape (k, 3, 3).
        """
        if self._map is not None:
            angles = self._map.joint_positions(angles)
        R, p = np.empty((len(angles), self.n_bodies, 3, 3)), np.empty((len(angles), self.n_bodies, 3))
        q = pin.neutral(self.model)
        for k, row in enumerate(angles):
            for at, nq, v in self._joints:
                q[at : at + nq] = (np.cos(row[v]), np.sin(row[v])) if nq == 2 else row[v]
            pin.forwardKinematics(self.model, self._data, q)
            for body, place in enumerate(self._data.oMi):
                R[k, body], p[k, body] = place.rotation, place.translation
        R[:, -1], p[:, -1] = rotation, position
        return R, p


@dataclass(frozen=True)
class Cast:
    """All solids.

    Attributes:
        kinematics: where they are.
        links: of the hand, with palms.
        clipped: by link solid, what is left of it outside the soft balls of its body; itself without any.
        held: of the object.
        table: if there is one.
        obstacles: that stand still.
        unseen: links of the hand without a shape that can be used, but for bare frames.
        hulls: links whose meshes are taken as their convex hulls.
        tipped: bodies that carry a soft tip.
        tips_touch: whether the contact model lets these meet each other.
    """

    kinematics: Kinematics
    links: list[Solid]
    clipped: dict[Solid, Solid | None]
    held: list[Solid]
    table: Solid | None
    obstacles: list[Solid]
    unseen: list[str]
    hulls: list[str]
    tipped: set[int]
    tips_touch: bool


def read_cast(situation: Situation) -> Cast:
    """The solids of a situation.

    Raises:
        ModelError: no link of the hand has a shape that can be used, or the object has none.
    """
    hand, purpose = situation.hand, situation.shapes
    kinematics = Kinematics(hand, situation.coupling)
    placed, unread = _placed(hand, kinematics.model, purpose)
    if not placed:
        what = "can be read" if unread else f"has a <{purpose}> shape"
        raise ModelError(
            f"{hand.file.name}: no link of the hand {what}, so that its collisions are not seen; "
            f"give its links <{purpose}> shapes.",
            file=str(hand.file),
        )
    balls = _balls(situation, kinematics.model)
    links, clipped = [], dict[Solid, Solid | None]()
    for body, geometry, shape in placed:
        solid = Solid(geometry.link, body, shape, geometry.rotation, geometry.position)
        links.append(solid)
        clipped[solid] = solid
        soft = [ball for ball in balls.get(body, []) if _meets(solid, ball)]
        if soft:
            left = outside(geometry, soft)
            clipped[solid] = None if left is None else Solid(geometry.link, body, left)
    for name, frame, centre, radius in situation.palms:
        body, place = _frame(kinematics.model, frame, hand)
        palm = Solid(name, body, coal.Sphere(radius), position=place.act(np.asarray(centre, dtype=float)), is_palm=True)
        links.append(palm)
        clipped[palm] = None
    seen = {solid.name for solid in links}
    bare = {
        name for name, link in hand.tree.links.items() if link.find("visual") is None and link.find("inertial") is None
    }
    return Cast(
        kinematics,
        links,
        clipped,
        _object_solids(situation, kinematics.n_bodies - 1),
        _table(situation.plane),
        [standing(name, shape) for name, shape in situation.obstacles],
        [name for name in hand.tree.links if name not in seen and name not in bare],
        sorted({geometry.link for _, geometry, _ in placed if geometry.kind == "mesh"}),
        {_frame(kinematics.model, tip, hand)[0] for tip, _ in situation.tips},
        situation.tips_touch,
    )


def _placed(urdf: Urdf, model: pin.Model, purpose: Purpose) -> tuple[list[tuple[int, Geometry, coal.ShapeBase]], bool]:
    """Joint and shape of all that can be read, each in the frame of the joint; whether one cannot be read."""
    found, unread = [], False
    for geometry in urdf.geometries(purpose):
        try:
            shape = as_coal(geometry)
        except ModelError:
            unread = True
            continue
        frame = model.frames[model.getFrameId(geometry.link, pin.FrameType.BODY)]
        place = frame.placement * pin.SE3(geometry.rotation, geometry.position)
        moved = geometry._replace(rotation=place.rotation.copy(), position=place.translation.copy())
        found.append((int(frame.parentJoint), moved, shape))
    return found, unread


def _balls(situation: Situation, model: pin.Model) -> dict[int, list[SoftBall]]:
    """The balls of the contact model, by the joint that carries them."""
    balls: dict[int, list[SoftBall]] = {}
    for tip, radius in situation.tips:
        body, place = _frame(model, tip, situation.hand)
        balls.setdefault(body, []).append(SoftBall(tip, place.translation, radius))
    for name, frame, centre, radius in situation.palms:
        body, place = _frame(model, frame, situation.hand)
        balls.setdefault(body, []).append(SoftBall(name, place.act(np.asarray(centre, dtype=float)), radius))
    return balls


def _frame(model: pin.Model, name: str, hand: Urdf) -> tuple[int, pin.SE3]:
    """Joint that carries a link or frame, and its place there."""
    frame = find_frame(model, name, hand.file, model.njoints)
    return int(frame.parentJoint), pin.SE3(frame.placement)


def _meets(solid: Solid, ball: SoftBall) -> bool:
    """Whether the box about a solid reaches into a ball."""
    centre, half = solid.bounds
    reach = np.abs(solid.rotation.T @ (ball.centre - solid.position) - centre) - half
    return float(np.linalg.norm(np.maximum(reach, 0.0))) < ball.radius


def _object_solids(situation: Situation, body: int) -> list[Solid]:
    if situation.parts:
        return [standing(OBJECT, part, body) for part in situation.parts]
    held = situation.held
    placed, _ = _placed(held, build_model(held), "collision")
    if not placed:
        raise ModelError(
            f"{held.file.name}: the object has no <collision> shape that can be read; give it one.",
            file=str(held.file),
        )
    solids = []
    for _, geometry, own in placed:
        shape = own if situation.ellipsoid is None else coal.Ellipsoid(*situation.ellipsoid)
        solids.append(Solid(OBJECT, body, shape, geometry.rotation, geometry.position))
    return solids


def standing(name: str, shape: Shape, body: int = BASE) -> Solid:
    """A shape of the contact model as a solid that a body carries, the base if none is given."""
    return Solid(name, body, solid_shape(shape), shape.rotation, shape.centre)


def _table(plane: Face | None) -> Solid | None:
    return None if plane is None else Solid(TABLE, BASE, coal.Halfspace(plane.normal, plane.offset))
