"""A hand and an object read from URDF and appended into one Pinocchio model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.errors import ModelError
from softhand.model.configuration import ADDITIVE, CONTINUOUS, FREE_FLYER
from softhand.model.gravity import list_bodies
from softhand.model.shapes.face import Face
from softhand.model.shapes.reading import read_shape
from softhand.model.shapes.shape import Shape
from softhand.model.urdf.mounting import AT_ORIGIN, TipPlace, Vector3, mounted, with_tips
from softhand.model.urdf.reading import parse_urdf, read_text
from softhand.numerics.arrays import Array


def own_columns(world: World, index: int) -> list[int]:
    """Velocity indices of the joints that move only this tip."""
    shared = {column for k, tip in enumerate(world.tips) if k != index for column in tip.columns}
    return [column for column in world.tips[index].columns if column not in shared]


def slides_of(world: World) -> NDArray[np.bool_]:
    """Which joints slide, shape (n,)."""
    data = world.model.createData()
    pin.forwardKinematics(world.model, data, pin.neutral(world.model))
    axes = [np.asarray(data.joints[joint].S).ravel() for joint in range(1, world.object_joint)]  # linear, angular
    return np.array([bool(np.linalg.norm(axis[3:]) < 0.5) for axis in axes])


def joints_of(world: World, q: Array) -> Array:
    """Joint angles [rad or m], shape (n,), of a configuration of the model."""
    angles = np.zeros(world.n_joints)
    for joint in list(world.model.joints)[1:-1]:
        own = q[joint.idx_q : joint.idx_q + joint.nq]
        angles[joint.idx_v] = own[0] if joint.nq == 1 else math.atan2(own[1], own[0])
    return angles


FREE_FLYER_SIZE = 6


@dataclass(frozen=True)
class Tip:
    """Where a soft fingertip sits: its frame F in the frame of the joint that carries it."""

    name: str
    joint: int
    """Index of the Pinocchio joint."""
    rotation: NDArray[np.float64]
    """Axes of F in the joint frame, shape (3, 3)."""
    position: NDArray[np.float64]
    """Origin of F in the joint frame [m], shape (3,)."""
    columns: tuple[int, ...]
    """Velocity indices of the joints that move this tip, from the base outward."""


@dataclass(frozen=True)
class World:
    """Hand and object as one rigid-body model; the object is the last joint, a free-flyer.

    Velocities are (joint velocities, object's linear and angular velocity in the object frame), Pinocchio's order.
    """

    model: pin.Model
    tips: tuple[Tip, ...]
    shape: Shape
    """Of the object."""
    joint_names: tuple[str, ...]
    hand_urdf: Path
    object_urdf: Path
    hand_text: str
    """The URDF of the hand as it was read, with its mount and the tips that were placed."""
    object_text: str

    @property
    def faces(self) -> tuple[Face, ...]:
        """The plane faces of the object."""
        return self.shape.faces()

    def hand_frame(self, name: str) -> tuple[int, pin.SE3]:
        """Joint, 0 for the world, that carries a link or frame of the hand, and its place in the frame of that joint.

        Raises:
            ModelError: the hand has no such link or frame.
        """
        frame = _find_frame(self.model, name, self.hand_urdf, self.object_joint)
        return frame.parentJoint, pin.SE3(frame.placement)

    @property
    def n_joints(self) -> int:
        """Velocities of the hand."""
        return self.model.nv - FREE_FLYER_SIZE

    @property
    def n_tips(self) -> int:
        """Number of fingertips."""
        return len(self.tips)

    @property
    def object_joint(self) -> int:
        """Index of the free-flyer."""
        return self.model.njoints - 1

    @property
    def object_mass(self) -> float:
        """Mass of the object [kg]."""
        return float(self.model.inertias[self.object_joint].mass)

    @property
    def effort_limit(self) -> NDArray[np.float64]:
        """Largest torque of each joint [N m], shape (n,)."""
        return np.array(self.model.upperEffortLimit[: self.n_joints])

    @property
    def position_limits(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lower and upper limit of each joint [rad or m], infinite for continuous ones, each of shape (n,)."""
        lower, upper = np.full(self.n_joints, -np.inf), np.full(self.n_joints, np.inf)
        for kind, i, j in self.joints[:-1]:
            if kind == ADDITIVE:
                lower[j], upper[j] = self.model.lowerPositionLimit[i], self.model.upperPositionLimit[i]
        return lower, upper

    def set_joint_position(self, angles: NDArray[np.float64], q: NDArray[np.float64]) -> None:
        """Write joint angles [rad or m], shape (n,), into a configuration of the model, shape (nq,)."""
        for kind, i, j in self.joints[:-1]:
            if kind == CONTINUOUS:
                q[i : i + 2] = np.cos(angles[j]), np.sin(angles[j])
            else:
                q[i] = angles[j]

    @property
    def joints(self) -> NDArray[np.int64]:
        """Kind, index in q and index in v of each joint: what `configuration.integrate` needs. Shape (joints, 3)."""
        kinds = {1: ADDITIVE, 2: CONTINUOUS, 7: FREE_FLYER}
        rows = [(kinds[joint.nq], joint.idx_q, joint.idx_v) for joint in list(self.model.joints)[1:]]
        return np.array(rows, dtype=np.int64)

    @property
    def bodies(self) -> NDArray[np.void]:
        """What each joint carries, table `gravity.BODY`."""
        return list_bodies(self.model)

    @property
    def gravity(self) -> NDArray[np.float64]:
        """Acceleration of gravity [m/s^2], shape (3,)."""
        return np.array(self.model.gravity.linear)

    @property
    def envelope(self) -> NDArray[np.int64]:
        """First nonzero column of each row of M and of M + J^T K J (lower triangle), shape (nv,)."""
        first = np.zeros(self.model.nv, dtype=np.int64)
        for index in range(1, self.model.njoints - 1):
            joint = self.model.joints[index]
            root = self.model.supports[index][1]
            first[joint.idx_v : joint.idx_v + joint.nv] = self.model.joints[root].idx_v
        return first


def load_world(
    hand_urdf: Path,
    tips: Sequence[str | TipPlace],
    object_urdf: Path,
    object_mass: float | None = None,
    gravity: Sequence[float] = (0.0, 0.0, -9.81),
    ellipsoid: Sequence[float] | None = None,
    hull: bool = False,
    mount: tuple[Vector3, Vector3] = AT_ORIGIN,
    effort_limit: float | None = None,
) -> World:
    """Read hand and object and append them.

    Args:
        hand_urdf: file with the joints and links of the hand, fixed at its root.
        tips: a frame of each fingertip: centre of the hemisphere's flat face, x out of the tip; or its place on a link.
        object_urdf: file with one rigid body, whose collision shape can be touched.
        object_mass: replaces the mass of the file and scales its inertia alike [kg].
        gravity: in the world frame [m/s^2].
        ellipsoid: semi-axes of an ellipsoid in the place of the object's collision shape [m].
        hull: take the convex hull of a mesh.
        mount: position [m] and roll, pitch, yaw [rad] of the hand's root link in the world.
        effort_limit: of every joint, in place of those of the file [N m or N].

    Raises:
        ModelError: a file cannot be read, a tip is no frame of the hand, or the object has no usable shape.
    """
    hand_text, object_text = read_text(hand_urdf), read_text(object_urdf)
    hand = parse_urdf(hand_text, hand_urdf, folder=Path(hand_urdf).parent)
    places = [tip for tip in tips if isinstance(tip, TipPlace)]
    placed = with_tips(mounted(hand_text, hand_urdf, *mount), hand_urdf, places)
    if placed != hand_text:
        hand, hand_text = parse_urdf(placed, hand_urdf), placed
    if effort_limit is not None:
        hand.upperEffortLimit, hand.lowerEffortLimit = np.full(hand.nv, effort_limit), np.full(hand.nv, -effort_limit)
    body = parse_urdf(object_text, object_urdf, floating=True, folder=Path(object_urdf).parent)
    shape = read_shape(object_text, Path(object_urdf), body, ellipsoid, hull)
    names = tuple(hand.names)[1:]
    found = tuple(_find_tip(hand, tip if isinstance(tip, str) else tip.name, hand_urdf) for tip in tips)
    _make_names_distinct(hand, body)
    model = pin.appendModel(hand, body, 0, pin.SE3.Identity())
    model.gravity.linear = np.asarray(gravity, dtype=float)
    if object_mass is not None:
        inertia = model.inertias[model.njoints - 1]
        scale = object_mass / inertia.mass
        model.inertias[model.njoints - 1] = pin.Inertia(object_mass, inertia.lever, scale * inertia.inertia)
    return World(model, found, shape, names, Path(hand_urdf), Path(object_urdf), hand_text, object_text)


def _make_names_distinct(hand: pin.Model, body: pin.Model) -> None:
    """Rename frames that Pinocchio could not tell apart in one model; it finds joints by names of their own."""
    links = {frame.name for frame in hand.frames if frame.type == pin.FrameType.BODY}
    for frame in hand.frames:
        if frame.type != pin.FrameType.BODY and frame.name in links:
            frame.name = f"joint {frame.name}"
    taken = {frame.name for frame in hand.frames}
    for frame in body.frames:
        if frame.type == pin.FrameType.BODY and frame.name in taken:
            frame.name = f"object {frame.name}"


def _find_tip(hand: pin.Model, name: str, file: Path) -> Tip:
    frame = _find_frame(hand, name, file, hand.njoints)
    if frame.parentJoint == 0:
        raise ModelError(f"{file}: the tip '{name}' is fixed to the base; no joint moves it.", file=str(file))
    chain = list(hand.supports[frame.parentJoint])[1:]
    columns = tuple(hand.joints[index].idx_v for index in chain)
    return Tip(name, frame.parentJoint, frame.placement.rotation.copy(), frame.placement.translation.copy(), columns)


def _find_frame(model: pin.Model, name: str, file: Path, n_joints: int) -> pin.Frame:
    """The frame of that name at one of the first joints; Pinocchio gives no error for an unknown one."""
    frames = [frame for frame in model.frames if frame.parentJoint < n_joints]
    links = [frame.name for frame in frames if frame.type == pin.FrameType.BODY]
    found = [frame for frame in frames if frame.name == name]
    if not found:
        raise ModelError(
            f"{file}: no link or frame is called '{name}'. The hand has the links {', '.join(links)}.", file=str(file)
        )
    # a joint may have the name of a link, and then not that of the link that it carries
    return next((frame for frame in found if frame.type == pin.FrameType.BODY), found[0])
