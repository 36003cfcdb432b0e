"""A hand and an object read from URDF and appended into one Pinocchio model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from softhand.model.body import ObjectModel
from softhand.model.chain import Chain
from softhand.model.configuration import ADDITIVE, CONTINUOUS
from softhand.model.coupled import Coupled, expand_configuration, room
from softhand.model.coupling import Coupling
from softhand.model.gravity import list_bodies
from softhand.model.hand import HandModel
from softhand.model.joined import Tip, columns_of, find_frame, join_models
from softhand.model.joint_mechanics import JointMechanics, read_joint_mechanics
from softhand.model.motors import view_of
from softhand.model.shapes.face import Face
from softhand.model.shapes.shape import Shape
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.arrays import Array

FREE_FLYER_SIZE = 6
"""Velocities of the object."""
POSE_SIZE, QUATERNION_SIZE = 7, 4
"""Of the object at the end of a configuration."""


@dataclass(frozen=True)
class World:
    """Hand and object as one rigid-body model; the object is the last joint, a free-flyer.

    Velocities are (joint velocities, object's linear and angular velocity in the object frame), Pinocchio's order. With
    coupled joints the motors stand for the joints in q, v, torques and all that is counted by joints; `model`, poses
    and the joints of tips are of all joints as before.
    """

    model: pin.Model
    """Of all joints, coupled or not."""
    tips: tuple[Tip, ...]
    shape: Shape
    """Of the object."""
    coordinates: pin.Model
    """What q and v belong to: `model` itself, or with coupled joints one whose joints are the motors."""
    joint_names: tuple[str, ...]
    """Of the joints, or with coupled joints of the motors, one a velocity of the hand."""
    joints: NDArray[np.int64]
    """Kind, index in q and index in v of each of these: what `configuration.integrate` needs. Shape (joints, 3)."""
    chains: tuple[Chain, ...]
    """The joints that carry each tip, for kernels; none with coupled joints."""
    coupling: Coupling | None
    """Of the joints to motors, which then are the coordinates; None for a hand without coupled joints."""
    coupled: Coupled
    """The same for kernels."""
    hand: Urdf
    """With its mount and the tips that were placed."""
    object: Urdf
    mechanics: JointMechanics
    """What the joints or motors have of their own."""

    @property
    def hand_text(self) -> str:
        """URDF of the hand, with its mount and the tips that were placed."""
        return self.hand.text

    @property
    def object_text(self) -> str:
        """URDF of the object."""
        return self.object.text

    @property
    def hand_urdf(self) -> Path:
        """File of the hand."""
        return self.hand.file

    @property
    def object_urdf(self) -> Path:
        """File of the object."""
        return self.object.file

    @property
    def faces(self) -> tuple[Face, ...]:
        """The plane faces of the object."""
        return self.shape.faces()

    def hand_frame(self, name: str) -> tuple[int, pin.SE3]:
        """Joint, 0 for the world, that carries a link or frame of the hand, and its place in the frame of that joint.

        Raises:
            ModelError: the hand has no such link or frame.
        """
        frame = find_frame(self.model, name, self.hand_urdf, self.object_joint)
        return frame.parentJoint, pin.SE3(frame.placement)

    def configuration(self, q: Array) -> Array:
        """That of all joints and the object, shape (model.nq,), at q, shape (nq,)."""
        if self.coupling is None:
            return q
        coupled = room(self.coupled)
        expand_configuration(coupled, np.ascontiguousarray(q))
        return coupled.q

    def velocity(self, v: Array) -> Array:
        """That of all joints and the object, shape (model.nv,), at v, shape (nv,)."""
        return v if self.coupling is None else self.coupled.S @ v

    def joint_positions(self, angles: Array) -> Array:
        """Of all joints from those of the motors [rad or m], shapes (..., joints) and (..., n)."""
        return angles if self.coupling is None else self.coupling.joint_positions(angles)

    def view(self, joint: int, base: int = 0) -> int:
        """First column in `Snapshot.J` of what moves the body of a joint, 0 without coupled joints; see `view_of`."""
        if self.coupling is None:
            return 0
        return view_of(self.coupling, self.model, [tip.joint for tip in self.tips], joint, base)

    def columns_of(self, joint: int) -> list[int]:
        """Velocities that move the body of a joint, from the base outward; of motors, in their order."""
        chain = [self.model.joints[index] for index in list(self.model.supports[joint]) if index > 0]
        columns = [column for part in chain for column in range(part.idx_v, part.idx_v + part.nv)]
        if self.coupling is None:
            return columns
        return np.flatnonzero(np.any(self.coupled.S[columns] != 0.0, axis=0)).tolist()

    @property
    def palm_joint(self) -> int:
        """Index of the last joint that carries all tips, that of a wrist or an arm; 0 if the palm is fixed."""
        chains = [list(self.model.supports[tip.joint]) for tip in self.tips]
        return int(max(joint for joint in chains[0] if all(joint in chain for chain in chains)))

    @property
    def nq(self) -> int:
        """Numbers of a configuration."""
        return int(self.coordinates.nq)

    @property
    def nv(self) -> int:
        """Velocities."""
        return int(self.coordinates.nv)

    @property
    def n_joints(self) -> int:
        """Velocities of the hand: joints, or the motors of coupled ones."""
        return self.nv - FREE_FLYER_SIZE

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
        """Largest torque of each joint or motor [N m], shape (n,)."""
        if self.coupling is not None:
            return self.coupling.effort.copy()
        return np.array(self.model.upperEffortLimit[: self.n_joints])

    @property
    def position_limits(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lower and upper limit of each joint or motor [rad or m], infinite for continuous ones, of shape (n,) each."""
        if self.coupling is not None:
            return self.coupling.limits[0].copy(), self.coupling.limits[1].copy()
        lower, upper = np.full(self.n_joints, -np.inf), np.full(self.n_joints, np.inf)
        _, i, j = self.joints[:-1][self.joints[:-1, 0] == ADDITIVE].T
        lower[j], upper[j] = self.model.lowerPositionLimit[i], self.model.upperPositionLimit[i]
        return lower, upper

    def set_joint_position(self, angles: NDArray[np.float64], q: NDArray[np.float64]) -> None:
        """Write joint angles [rad or m], shape (n,), into a configuration of the model, shape (nq,)."""
        for kind, i, j in self._rows:
            if kind == CONTINUOUS:
                q[i : i + 2] = np.cos(angles[j]), np.sin(angles[j])
            else:
                q[i] = angles[j]

    def object_position(self, q: Array) -> Array:
        """Origin of the object frame in a configuration [m], a view, shape (3,)."""
        return q[-POSE_SIZE:-QUATERNION_SIZE]

    def object_rotation(self, q: Array) -> Array:
        """Axes of the object frame in a configuration, shape (3, 3)."""
        return np.asarray(pin.Quaternion(q[-QUATERNION_SIZE:]).toRotationMatrix())

    def set_object_pose(self, position: ArrayLike, rotation: Array, q: Array) -> None:
        """Write position [m], shape (3,), and axes, shape (3, 3), of the object frame into a configuration."""
        q[-POSE_SIZE:-QUATERNION_SIZE] = position
        q[-QUATERNION_SIZE:] = pin.Quaternion(rotation).coeffs()

    @cached_property
    def _rows(self) -> list[list[int]]:
        rows: list[list[int]] = self.joints[:-1].tolist()
        return rows

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
        if self.coupling is not None:
            return _envelope_of(self)
        first = np.zeros(self.model.nv, dtype=np.int64)
        for index in range(1, self.model.njoints - 1):
            joint = self.model.joints[index]
            root = self.model.supports[index][1]
            first[joint.idx_v : joint.idx_v + joint.nv] = self.model.joints[root].idx_v
        return first


def load_world(
    hand: HandModel, body: ObjectModel, gravity: Sequence[float] = (0.0, 0.0, -9.81), shape: Shape | None = None
) -> World:
    """Hand and object appended into one model.

    Args:
        hand: where it stands, with its tips.
        body: the object.
        gravity: in the world frame [m/s^2].
        shape: of the object, if it is known from another world of the same object.

    Raises:
        ModelError: a tip is no frame of the hand, or the object has no usable shape.
    """
    coupling = () if hand.coupling is None and not hand.has_mimics else (hand.coupling, hand.effort_limit)
    joined = join_models(hand.urdf, hand.tips, body.urdf, *coupling)
    model = pin.Model(joined.model)
    hand.limit_efforts(model)
    body.weigh(model)
    mechanics = read_joint_mechanics(hand.mechanics, hand.urdf, joined.joint_names, joined.coupling)
    coupled = joined.coupled
    if joined.coupling is None:
        model.armature = np.concatenate([mechanics.armature, np.zeros(FREE_FLYER_SIZE)])
    else:
        coupled = coupled._replace(armature=np.concatenate([mechanics.armature, np.zeros(FREE_FLYER_SIZE)]))
    model.gravity.linear = np.asarray(gravity, dtype=float)
    shape = shape or body.shape(joined.flyer)
    return World(
        model,
        joined.tips,
        shape,
        model if joined.coupling is None else joined.coordinates,
        joined.joint_names,
        joined.joints,
        joined.chains,
        joined.coupling,
        coupled,
        hand.urdf,
        body.urdf,
        mechanics,
    )


def _envelope_of(world: World) -> NDArray[np.int64]:
    """`World.envelope` of motors: which of them move bodies that hang on one another."""
    model, moves = world.model, world.coupled.S != 0.0
    roots = np.zeros(model.nv, np.int64)
    for index in range(1, model.njoints):
        joint = model.joints[index]
        roots[joint.idx_v : joint.idx_v + joint.nv] = model.supports[index][1]
    meet = moves.T @ (roots[:, None] == roots) @ moves
    first = np.argmax(meet, axis=1)
    return first


def own_columns(world: World, index: int) -> list[int]:
    """Velocity indices of the joints that move only this tip."""
    return columns_of(world.tips, index)


def slides_of(world: World) -> NDArray[np.bool_]:
    """Which joints or motors slide, shape (n,)."""
    if world.coupling is not None:
        return world.coupling.slides.copy()
    data = world.model.createData()
    pin.forwardKinematics(world.model, data, pin.neutral(world.model))
    axes = [np.asarray(data.joints[joint].S).ravel() for joint in range(1, world.object_joint)]  # linear, angular
    return np.array([bool(np.linalg.norm(axis[3:]) < 0.5) for axis in axes])


def joints_of(world: World, q: Array) -> Array:
    """Joint angles [rad or m], shape (n,), of a configuration of the model."""
    angles = np.zeros(world.n_joints)
    for kind, i, j in world.joints[:-1].tolist():
        angles[j] = math.atan2(q[i + 1], q[i]) if kind == CONTINUOUS else q[i]
    return angles
