"""Fingers as chains of joints, and where their tips are, compiled."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.errors import GraspError
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled

LINK = np.dtype(
    [
        ("rotation", np.float64, (3, 3)),  # of the joint frame at zero, in the frame before it
        ("position", np.float64, 3),  # of the joint frame in the frame before it [m]
        ("axis", np.float64, 3),  # of the joint, in its frame
        ("slides", np.bool_),  # whether it is prismatic
    ]
)
"""One joint of a chain."""


def finger_chain(world: World, index: int, angles: Array) -> tuple[NDArray[np.void], list[int]]:
    """The joints that only one finger has, and where they are in v; shared joints are frozen at `angles`.

    Args:
        world: hand and object.
        index: of the tip.
        angles: of all joints [rad or m], shape (n,).

    Returns:
        One row of `LINK` a joint, the last one for the finger frame F (axis 0), and the velocity indices.

    Raises:
        GraspError: joints of the hand are coupled, so that no finger moves by itself.
    """
    require_uncoupled(world)
    tip, model = world.tips[index], world.model
    shared = {column for k, other in enumerate(world.tips) if k != index for column in other.columns}
    q = pin.neutral(model)
    world.set_joint_position(angles, q)
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    columns, rows = [], []
    placement = pin.SE3.Identity()
    for joint in list(model.supports[tip.joint])[1:]:
        column = model.joints[joint].idx_v
        if column in shared:
            placement = data.oMi[joint]
            continue
        placement = placement * model.jointPlacements[joint]
        axis = np.asarray(data.joints[joint].S).ravel()  # linear, angular
        slides = bool(np.linalg.norm(axis[3:]) < 0.5)
        rows.append((placement.rotation, placement.translation, axis[:3] if slides else axis[3:], slides))
        columns.append(column)
        placement = pin.SE3.Identity()
    end = placement * pin.SE3(tip.rotation, tip.position)
    rows.append((end.rotation, end.translation, np.zeros(3), False))
    return np.array(rows, dtype=LINK), columns


def require_uncoupled(world: World) -> None:
    """GraspError if joints of the hand are coupled, so that no finger moves by itself."""
    if world.coupling is not None:
        coupled = ", ".join(world.coupling.joint_names[k] for k in world.coupling.coupled_joints)
        raise GraspError(
            f"the joints {coupled} are coupled to motors, and this search moves one joint at a time; give "
            "grasp.contact_points that the hand reaches, whose start is solved with the coupling.",
            finger="", quantity="joints", value=coupled,
        )  # fmt: skip


def tip_position(links: NDArray[np.void], angles: Array) -> Array:
    """Origin of a finger frame F in the world [m], shape (3,); see `place_tip`."""
    position = np.empty(3)
    place_tip(links, angles, np.empty((3, 3)), position, np.empty((3, len(angles))), np.empty((2 * len(angles) + 6, 3)))
    return position


@compiled
def work_rows(joints):
    """Rows of the scratch of `place_tip`."""
    return 2 * joints + 6


@compiled
def place_tip(links, angles, rotation, position, jacobian, work):
    """Pose of a finger frame F and the Jacobian of its origin.

    Args:
        links: rows of `LINK`, the last for F itself.
        angles: [rad or m], shape (joints,).
        rotation: axes of F in the world, set, shape (3, 3).
        position: origin of F in the world [m], set, shape (3,).
        jacobian: velocity of the origin of F from the rates of the joints, set, shape (3, joints).
        work: scratch, shape (work_rows(joints), 3).
    """
    joints = angles.shape[0]
    axes, origins = work[:joints], work[joints : 2 * joints]
    turned, before = work[2 * joints : 2 * joints + 3], work[2 * joints + 3 :]
    for i in range(3):
        position[i] = 0.0
        for j in range(3):
            rotation[i, j] = 1.0 if i == j else 0.0
    # out along the chain: each frame in the world by way of the one before it
    for k in range(joints + 1):
        link = links[k]
        for i in range(3):
            for j in range(3):
                position[i] += rotation[i, j] * link.position[j]
        _multiply(rotation, link.rotation, before)
        for i in range(3):
            for j in range(3):
                rotation[i, j] = before[i, j]
        if k == joints:
            break
        for i in range(3):
            axes[k, i] = before[i, 0] * link.axis[0] + before[i, 1] * link.axis[1] + before[i, 2] * link.axis[2]
            origins[k, i] = position[i]
        if link.slides:
            for i in range(3):
                position[i] += axes[k, i] * angles[k]
        else:
            _turn(link.axis, angles[k], turned)
            _multiply(before, turned, rotation)
    # a slide moves the tip along its axis a, a hinge by a x (position - origin)
    for k in range(joints):
        if links[k].slides:
            for i in range(3):
                jacobian[i, k] = axes[k, i]
        else:
            ax, ay, az = position[0] - origins[k, 0], position[1] - origins[k, 1], position[2] - origins[k, 2]
            jacobian[0, k] = axes[k, 1] * az - axes[k, 2] * ay
            jacobian[1, k] = axes[k, 2] * ax - axes[k, 0] * az
            jacobian[2, k] = axes[k, 0] * ay - axes[k, 1] * ax


@compiled
def _multiply(A, B, out):
    """out = A B, shape (3, 3) each."""
    for i in range(3):
        for j in range(3):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]


@compiled
def _turn(axis, angle, out):
    """Rotation by an angle [rad] about a unit axis, by Rodrigues, shape (3, 3)."""
    x, y, z = axis[0], axis[1], axis[2]
    c, s = math.cos(angle), math.sin(angle)
    d = 1.0 - c
    out[0, 0], out[0, 1], out[0, 2] = c + d * x * x, d * x * y - s * z, d * x * z + s * y
    out[1, 0], out[1, 1], out[1, 2] = d * x * y + s * z, c + d * y * y, d * y * z - s * x
    out[2, 0], out[2, 1], out[2, 2] = d * x * z - s * y, d * y * z + s * x, c + d * z * z
