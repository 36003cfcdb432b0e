"""What is kept of each grasp: one list of names, dimensions and units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from softhand.grasping.quality import GraspQuality
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.scenario.scenario import Scenario


class Kept(NamedTuple):
    """One array of a cache."""

    dims: tuple[str, ...]
    """Behind `grasp`."""
    units: str
    long_name: str


KEPT: Mapping[str, Kept] = {
    "pose": Kept((), "1", "number of the pose of the object that the grasp is from"),
    "object_position": Kept(("xyz",), "m", "origin of the object frame, in the world"),
    "object_rpy": Kept(("rpy",), "rad", "orientation of the object, R = Rz(yaw) Ry(pitch) Rx(roll)"),
    "contact_points": Kept(("finger", "xyz"), "m", "contact points, in the object frame"),
    "contact_normals": Kept(("finger", "xyz"), "1", "unit normals into the object, in the world"),
    "internal_force": Kept(("pair",), "N", "internal force between two contacts"),
    "least_internal_force": Kept(("pair",), "N", "the smallest with which the same contacts hold; NaN if none do"),
    "joint_position": Kept(("joint",), "rad or m", "joint angle at rest, or travel of a slide"),
    "joint_torque": Kept(("joint",), "N m or N", "torque that holds the grasp, or force of a slide"),
    "torque_use": Kept(("joint",), "1", "the same over the effort limit"),
    "joint_reserve": Kept(("joint",), "rad or m", "way to the nearer limit; infinite for a joint without limits"),
    "contact_force": Kept(("finger", "force_component"), "N, N, N, N m", "force and torsion on the object"),
    "depth": Kept(("finger",), "m", "compression of the tip"),
    "Phi": Kept(("finger",), "rad", "angle of the contact on the hemisphere, 0 at the rim"),
    "friction_use": Kept(("finger",), "1", "tangential force over the friction limit, |f_t|/(mu f_z)"),
    "limit_surface_use": Kept(("finger",), "1", "load over the coupled limit of force and torsion"),
    "manipulability": Kept(("finger",), "m^3/rad^3", "sqrt(det J J^T) of the tip's centre by the finger's own joints"),
    "singular_values": Kept(("wrench",), "1", "of the grasp map with torsion, moments over L, largest first"),
    "margin": Kept((), "N/N", "force-closure margin for one newton of normal force in all"),
    "squeeze": Kept((), "N", "sum of the normal forces"),
}
"""Arrays of a cache, all of shape (grasps, ...)."""

LABELS: Mapping[str, tuple[str, ...]] = {
    "xyz": ("x", "y", "z"),
    "rpy": ("roll", "pitch", "yaw"),
    "force_component": ("f_x", "f_y", "f_z", "tau"),
    "wrench": ("1", "2", "3", "4", "5", "6"),
}
"""Names along the dimensions that are the same for all hands."""


def arrays_of(quality: GraspQuality, least: Array | None, scenario: Scenario, world: World) -> dict[str, Array]:
    """The arrays of one grasp, without its pose's number.

    Args:
        quality: its figures.
        least: internal forces that hold it [N], shape (pairs,).
        scenario: with it.
        world: hand and object.
    """
    fingers, n = quality.fingers, world.n_joints
    joints = {name: np.full(n, np.nan) for name in ("joint_position", "joint_torque", "torque_use", "joint_reserve")}
    for tip, finger in zip(world.tips, fingers, strict=True):
        columns = list(tip.columns)
        for name, values in zip(
            joints, (finger.angles, finger.torque, finger.torque_use, finger.reserve), strict=True
        ):  # fmt: skip
            joints[name][columns] = values
    contact_force = np.array([finger.force for finger in fingers])
    each = {name: np.array([getattr(finger, name) for finger in fingers])
            for name in ("depth", "Phi", "friction_use", "limit_surface_use", "manipulability")}  # fmt: skip
    return {
        "object_position": np.array(scenario.object.position),
        "object_rpy": np.array(scenario.object.rpy),
        "contact_points": np.array(scenario.grasp.contact_points),
        "contact_normals": quality.contacts.normals,
        "internal_force": quality.internal_force,
        "least_internal_force": np.full(len(quality.internal_force), np.nan) if least is None else least,
        **joints,
        "contact_force": contact_force,
        **each,
        "singular_values": quality.singular_values,
        "margin": np.array(quality.margin),
        "squeeze": np.array(np.sum(contact_force[:, 2])),
    }
