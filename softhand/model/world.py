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
from softhand.model.gravity import list_bodies
from softhand.model.hand import HandModel
from softhand.model.joined import Tip, columns_of, find_frame, join_models
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

    Velocities are (joint velocities, object's linear and angular velocity in the object frame), Pinocchio's order.
    """

    model: pin.Model
    tips: tuple[Tip, ...]
    shape: Shape
    """Of the object."""
    joint_names: tuple[str, ...]
    joints: NDArray[np.int64]
    """Kind, index in q and index in v of each joint: what `configuration.integrate` needs. Shape (joints, 3)."""
    chains: tuple[Chain, ...]
    """The joints that carry each tip, for kernels."""
    hand: Urdf
    """With its mount and the tips that were placed."""
    object: Urdf

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
    joined = join_models(hand.urdf, hand.tips, body.urdf)
    model = pin.Model(joined.model)
    hand.limit_efforts(model)
    body.weigh(model)
    model.gravity.linear = np.asarray(gravity, dtype=float)
    shape = shape or body.shape(joined.flyer)
    return World(model, joined.tips, shape, joined.joint_names, joined.joints, joined.chains, hand.urdf, body.urdf)


def own_columns(world: World, index: int) -> list[int]:
    """Velocity indices of the joints that move only this tip."""
    return columns_of(world.tips, index)


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
