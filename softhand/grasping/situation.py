"""The hand and the object where it lies: all that a grasp is judged by and searched with before it is chosen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from softhand.assembly.parts import read_face_friction
from softhand.contact.friction import face_of
from softhand.contact.pairs import contact_pairs
from softhand.errors import GraspError
from softhand.grasping.materials import Material, Torsion, read_materials
from softhand.grasping.wrenches import Contacts, least_squeeze
from softhand.model.arm import Arm
from softhand.model.shapes.shape import Shape
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.scenario.scenario import Scenario
from softhand.start.statics import contact_forces


@dataclass(frozen=True, eq=False)
class Situation:
    """Hand, fingertips and object of a scenario.

    Attributes:
        world: hand and object.
        scenario: that they are from.
        materials: one a fingertip.
        face_friction: by face as `Fingertip` has it.
        position: of the object frame in the world [m], shape (3,).
        rotation: its axes in the world, shape (3, 3).
    """

    world: World
    scenario: Scenario
    materials: tuple[Material, ...]
    face_friction: tuple[float, ...]
    position: Array
    rotation: Array

    @property
    def shape(self) -> Shape:
        """Of the object."""
        return self.world.shape

    @property
    def centre(self) -> Array:
        """Centre of mass in the object frame [m], shape (3,)."""
        return np.array(self.world.model.inertias[self.world.object_joint].lever)

    @property
    def length(self) -> float:
        """L = sqrt(tr I / 2 m): root of the mean squared distance of the object's mass from its centre [m]."""
        inertia = self.world.model.inertias[self.world.object_joint]
        return math.sqrt(float(np.trace(inertia.inertia)) / (2.0 * inertia.mass))

    def to_world(self, points: Array) -> Array:
        """Points of the object frame [m] in the world, shape (..., 3)."""
        return self.position + points @ self.rotation.T

    def to_object(self, points: Array) -> Array:
        """Points of the world [m] in the object frame, shape (..., 3)."""
        return (points - self.position) @ self.rotation

    def friction(self, finger: int, normal: Array) -> float:
        """mu of a finger where the outward normal of the object is so, in its axes."""
        faces, material = self.face_friction, self.materials[finger]
        return (faces[face_of(self.shape.rotation, normal)] if faces else 0.0) or material.friction

    def contacts(
        self, points: Array, normals: Array, torsions: Sequence[Torsion], fingers: Sequence[int] | None = None
    ) -> Contacts:
        """Contacts about the centre of mass, in axes of the object.

        Args:
            points: in the object frame [m], shape (nc, 3).
            normals: outward, shape (nc, 3).
            torsions: of each pressed tip.
            fingers: which finger touches at each; in their order if not said.
        """
        who = range(len(points)) if fingers is None else fingers
        friction = np.array([self.friction(finger, normal) for finger, normal in zip(who, normals, strict=True)])
        lengths, curves = np.array([one.length for one in torsions]), np.array([one.curve for one in torsions])
        return Contacts(points - self.centre, -normals, friction, lengths, self.length, curves)

    def squeeze(
        self, points: Array, normals: Array, friction: Array, use: float = 1.0, least_normal: float = 0.0
    ) -> Array | None:
        """`least_squeeze` of contacts; None too where they cannot carry the weight.

        Args:
            points: in the world [m], shape (nc, 3).
            normals: into the object, in the world, shape (nc, 3).
            friction: mu, shape (nc,).
            use: share of the friction that may be used.
            least_normal: [N].
        """
        pairs = len(contact_pairs(len(points)))
        try:
            carried = self.forces(points, np.zeros(pairs))
        except GraspError:
            return None
        each = [self.forces(points, unit) - carried for unit in np.eye(pairs)]
        return least_squeeze(carried, np.stack(each, axis=2), normals, friction, use, least_normal)

    def forces(self, points: Array, internal_force: Sequence[float] | Array) -> Array:
        """Forces on the object at contacts in the world [N], shape (nc, 3); GraspError if they cannot carry it."""
        return contact_forces(self.world, list(points), self.position, self.rotation, internal_force)


def situation_of(scenario: Scenario, world: World) -> Situation:
    """That of a scenario whose hand and object are read already."""
    return Situation(
        world=world,
        scenario=scenario,
        materials=read_materials(scenario),
        face_friction=read_face_friction(scenario, world.shape),
        position=np.array(scenario.object.position),
        rotation=rotation_of(scenario.object.rpy),
    )


def skeleton(world: World, arm: Arm, index: int) -> Array:
    """Origins of the joints of a finger and the centre of its tip at the last `move` [m], shape (joints + 1, 3)."""
    data = world.model.createData()
    pin.forwardKinematics(world.model, data, world.configuration(arm.q))
    chain = list(world.model.supports[world.tips[index].joint])[1:]
    return np.array([*(data.oMi[joint].translation for joint in chain), arm.tip(index)[0]])
