"""Joints and bodies of a Pinocchio model as one table of plain numbers, for kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.errors import ModelError
from softhand.model.coupled import Coupled, room, uncoupled
from softhand.numerics.arrays import Array, overwrite

TURNS, WINDS, SLIDES, FLOATS = 0, 1, 2, 3
"""Kinds of joints: revolute, continuous (cos, sin in q), prismatic, free-flyer."""

JOINT = np.dtype(
    [
        ("kind", np.int64),
        ("parent", np.int64),  # index of the joint before; 0 is the world
        ("position", np.int64),  # index of its first number in q
        ("column", np.int64),  # and in v
        ("axis", np.float64, 3),  # in the frame of the joint before; zero for a free-flyer
        ("place", np.float64, 3),  # origin of the joint frame in that of the joint before, at zero [m]
        ("still", np.float64, 9),  # axes of the joint frame in that of the joint before, row by row, as
        ("cosine", np.float64, 9),  #     still + cos q cosine + sin q sine
        ("sine", np.float64, 9),
        ("mass", np.float64),  # of the body [kg]
        ("first", np.float64, 3),  # mass times centre of mass, joint frame [kg m]
        ("inertia", np.float64, 6),  # about the origin of the joint frame, xx, xy, yy, xz, yz, zz [kg m^2]
        ("armature", np.float64, 6),  # what the drive adds to the diagonal of M, by velocity of the joint
    ]
)
"""What is fixed at each joint and the body that it moves, one row a joint, the world included."""

WORK = np.dtype(
    [
        ("spin", np.float64, 3),  # angular velocity [rad/s]
        ("turning", np.float64, 3),  # angular acceleration if no velocity changes [rad/s^2]
        ("lifting", np.float64, 3),  # acceleration of the origin, likewise, less that of gravity [m/s^2]
        ("step", np.float64, 3),  # from the joint before to this one [m]
        ("axis", np.float64, 3),
        ("force", np.float64, 3),  # that all bodies from here on need [N]
        ("moment", np.float64, 3),  # about the origin of this joint [N m]
        ("mass", np.float64),  # of all bodies from here on
        ("first", np.float64, 3),  # their first moment and
        ("inertia", np.float64, 6),  # their inertia about the origin of this joint
    ]
)
"""Scratch of `rigid.rigid_terms`, one row a joint, all in world axes."""


class Tree(NamedTuple):
    """A model for `rigid.rigid_terms`. `work` and `coupled` are written; what runs side by side needs its own."""

    joints: NDArray[np.void]
    """Table `JOINT`, shape (joints,)."""
    gravity: Array
    """Acceleration of gravity, world axes [m/s^2], shape (3,)."""
    work: NDArray[np.void]
    """Table `WORK`, shape (joints,)."""
    coupled: Coupled
    """Of its joints; empty where none are coupled. Its room is written too."""


def read_tree(model: pin.Model, coupled: Coupled | None = None) -> Tree:
    """The numbers of a model as they are now; later changes of the model do not count.

    Raises:
        ModelError: a joint is of another kind than `TURNS` and the others, or a free-flyer is not at the root of its
            tree and alone on it.
    """
    data = model.createData()
    pin.forwardKinematics(model, data, pin.neutral(model))
    joints = np.zeros(model.njoints, JOINT)
    for index in range(1, model.njoints):
        joint, placement, inertia = model.joints[index], model.jointPlacements[index], model.inertias[index]
        columns = slice(joint.idx_v, joint.idx_v + joint.nv)
        row = joints[index]
        row["kind"], axis = _kind(model, data, index)
        row["parent"], row["position"], row["column"] = model.parents[index], joint.idx_q, joint.idx_v
        row["axis"], row["place"] = placement.rotation @ axis, placement.translation
        along = np.outer(axis, axis)
        parts = (along, np.eye(3) - along, pin.skew(axis))
        if row["kind"] in (SLIDES, FLOATS):
            parts = (np.eye(3), np.zeros((3, 3)), np.zeros((3, 3)))
        for name, part in zip(("still", "cosine", "sine"), parts, strict=True):
            row[name] = (placement.rotation @ part).ravel()
        _weigh(row, inertia)
        row["armature"][: joint.nv] = model.armature[columns]
    gravity = np.array(model.gravity.linear)
    joints.flags.writeable = gravity.flags.writeable = False
    return Tree(joints, gravity, np.zeros(model.njoints, WORK), room(coupled or uncoupled()))


def _weigh(row: np.void, inertia: pin.Inertia) -> None:
    """The body of a row."""
    lever = pin.skew(inertia.lever)
    about_origin = inertia.inertia - inertia.mass * lever @ lever
    row["mass"], row["first"] = inertia.mass, inertia.mass * inertia.lever
    row["inertia"] = about_origin[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]


def reread_tree(tree: Tree, model: pin.Model, coupled: Coupled) -> None:
    """Bring a tree up to date with a model that differs from its own in gravity, armature and the last body alone."""
    joints = tree.joints.copy()
    for index in range(1, model.njoints):
        joint = model.joints[index]
        joints[index]["armature"][: joint.nv] = model.armature[joint.idx_v : joint.idx_v + joint.nv]
    _weigh(joints[-1], model.inertias[model.njoints - 1])
    overwrite(tree.joints, joints)
    overwrite(tree.gravity, model.gravity.linear)
    overwrite(tree.coupled.armature, coupled.armature)


def branches_of(tree: Tree) -> NDArray[np.int64]:
    """First and last joint of each branch: a joint on the world, and all behind it, shape (branches, 2).

    None where joints are coupled, across branches too.
    """
    if tree.coupled.S.size:
        return np.zeros((0, 2), np.int64)
    firsts = np.flatnonzero(tree.joints["parent"][1:] == 0) + 1
    return np.stack([firsts, np.append(firsts[1:], len(tree.joints)) - 1], axis=1)


def _kind(model: pin.Model, data: pin.Data, index: int) -> tuple[int, Array]:
    """Kind of a joint and its axis in its own frame, zero for a free-flyer."""
    joint = model.joints[index]
    if (joint.nq, joint.nv) == (7, 6) and model.parents[index] == 0 and index not in list(model.parents):
        return FLOATS, np.zeros(3)
    if joint.nv == 1:
        subspace = np.asarray(data.joints[index].S).ravel()
        slide, turn = subspace[:3], subspace[3:]
        if not turn.any() and joint.nq == 1:
            return SLIDES, slide
        if not slide.any():
            return (TURNS if joint.nq == 1 else WINDS), turn
    raise ModelError(
        f"The compiled terms know no joint such as '{model.names[index]}', {joint.shortname()}: only revolute, "
        'continuous and prismatic ones, and a free-flyer at the root that carries nothing; take terms = "pinocchio".',
        file="",
    )
