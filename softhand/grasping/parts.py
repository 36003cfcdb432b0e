"""What grasps are judged by and searched with: the object as a solid, its size, squeeze, torsion, fingers as lines."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from softhand.assembly.parts import read_law
from softhand.contact.friction import face_of, spin_length
from softhand.contact.pairs import contact_pairs
from softhand.contact.records import PAD
from softhand.errors import GraspError
from softhand.grasping.wrenches import least_squeeze
from softhand.laws.law import Law
from softhand.model.arm import Arm
from softhand.model.shapes.shape import Shape
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.scenario.scenario import Scenario
from softhand.start.press import plain_depth
from softhand.start.statics import contact_forces

_USUAL_PHI = math.radians(60.0)  # where a tip is taken to press whose angle is not known
_LEAST_FORCE = 1.0  # [N] with which a tip is taken to press whose force is not known


def size_of(world: World) -> float:
    """L = sqrt(tr I / 2 m): root of the mean squared distance of the mass from its centre [m]."""
    inertia = world.model.inertias[world.object_joint]
    return math.sqrt(float(np.trace(inertia.inertia)) / (2.0 * inertia.mass))


def squeeze(
    world: World, points: Array, normals: Array, friction: Array, position: Array, rotation: Array, use: float = 1.0,
    least_normal: float = 0.0,
) -> Array | None:  # fmt: skip
    """`least_squeeze` of contacts in the world, shape (nc, 3) each; None too where they cannot carry the weight."""
    nc = len(points)
    pairs = len(contact_pairs(nc))
    try:
        carried = contact_forces(world, list(points), position, rotation, np.zeros(pairs))
    except GraspError:
        return None
    each = [contact_forces(world, list(points), position, rotation, unit) - carried for unit in np.eye(pairs)]
    return least_squeeze(carried, np.stack(each, axis=2), normals, friction, use, least_normal)


def pressed_depth(law: Law, pressing: float) -> float:
    """dr [m] under a normal force without shear; that of 1 N if the force is not known or pulls."""
    return plain_depth(law, _USUAL_PHI, 0.0, pressing if pressing > _LEAST_FORCE else _LEAST_FORCE)


class Material(NamedTuple):
    """What counts of a fingertip before it touches."""

    law: Law
    friction: float
    """mu where the face has none of its own."""
    torsion_length: float
    """tau_max / (mu f_z) [m] as given, or 0."""


def read_materials(scenario: Scenario) -> list[Material]:
    """That of each fingertip."""
    tips = [(name, scenario.fingertip.at(name)) for name in scenario.hand.names]
    return [Material(read_law(scenario, name), tip.friction, tip.torsion_length or 0.0) for name, tip in tips]


def friction_on(shape: Shape, faces: tuple[float, ...], normal: Array, material: Material) -> float:
    """mu of a tip where the outward normal of the object is so, in its axes; `faces` as `Fingertip` has them."""
    return (faces[face_of(shape.rotation, normal)] if faces else 0.0) or material.friction


def torsion_length(material: Material, depth: float) -> float:
    """tau_max / (mu f_z) at a depth [m]."""
    law = material.law
    pad = np.zeros(1, PAD)[0]
    pad["radius"], pad["torsion_share"] = law.radius, law.torsion_share or 0.0
    pad["torsion_length"] = material.torsion_length
    return float(spin_length(pad, law.radius - depth))


def skeleton(world: World, arm: Arm, index: int) -> Array:
    """Origins of the joints of a finger and the centre of its tip at the last `move` [m], shape (joints + 1, 3)."""
    data = world.model.createData()
    pin.forwardKinematics(world.model, data, arm.q)
    chain = list(world.model.supports[world.tips[index].joint])[1:]
    return np.array([*(data.oMi[joint].translation for joint in chain), arm.tip(index)[0]])
