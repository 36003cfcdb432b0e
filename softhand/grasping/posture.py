"""Joints and tips of a grasp at rest, or as near to it as they get."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from softhand.assembly.plant import read_grasp
from softhand.errors import GraspError
from softhand.grasping.chains import finger_chain
from softhand.grasping.inverse import approach
from softhand.grasping.materials import Material
from softhand.grasping.palm import standing_joints
from softhand.model.arm import REACHED
from softhand.model.world import World, joints_of
from softhand.numerics.arrays import Array
from softhand.scenario.scenario import Scenario
from softhand.start.leaning import Leant

_STARTS = 8  # of a finger that does not reach its point, after the guess


@dataclass(frozen=True, eq=False)
class Posture:
    """Joints and tips; NaN is what is not known without a grasp at rest.

    Attributes:
        angles: of the joints [rad or m], shape (n,).
        missing: how far each tip stays from where it should be [m], shape (nc,).
        depth: dr [m], shape (nc,).
        Phi: [rad], shape (nc,).
        torsion: moment on the object [N m], shape (nc,).
        refusal: why there is no grasp at rest; None if there is one.
        leant: forces and torques of the start where tips have moments; None where they have none.
    """

    angles: Array
    missing: Array
    depth: Array
    Phi: Array
    torsion: Array
    refusal: GraspError | None
    leant: Leant | None = None


def find_posture(
    world: World, scenario: Scenario, materials: Sequence[Material], points: Array, normals: Array, forces: Array
) -> Posture:
    """The start of a scenario, and where there is none, each finger as near to its point as it gets.

    Args:
        world: hand and object of the scenario.
        scenario: with the grasp.
        materials: of the tips.
        points: of the contacts in the world [m], shape (nc, 3).
        normals: into the object, in the world, shape (nc, 3).
        forces: on the object [N], NaN if not known, shape (nc, 3).
    """
    nothing, unknown = np.zeros(len(points)), np.full(len(points), np.nan)
    try:
        _, grasp = read_grasp(scenario, world)
    except GraspError as error:
        angles = standing_joints(world, scenario)
        inward = [
            tip.law.radius - tip.depth(float(normal @ force))
            for tip, normal, force in zip(materials, normals, forces, strict=True)
        ]
        centres = points - np.array(inward)[:, None] * normals
        if world.coupling is not None:
            return Posture(angles, unknown, unknown, unknown, unknown, error)
        missing = np.array([_approach(world, i, centre, angles) for i, centre in enumerate(centres)])
        return Posture(angles, missing, unknown, unknown, unknown, error)
    joints = joints_of(world, grasp.state.q)
    if scenario.grasp.opening:
        return Posture(joints, nothing, unknown, unknown, unknown, None)
    return Posture(joints, nothing, grasp.deformation[:, 0], grasp.angles[:, 1], grasp.force[:, 3], None, grasp.leant)


def _approach(world: World, index: int, target: Array, angles: Array) -> float:
    """Joint angles of a finger that reaches a target or stops as near to it as it gets; the distance left [m]."""
    links, columns = finger_chain(world, index, angles)
    lower, upper = (limit[columns] for limit in world.position_limits)
    within = np.maximum(lower, -math.pi), np.minimum(upper, math.pi)
    others = np.random.default_rng(0).uniform(*within, (_STARTS, len(columns)))
    least = math.inf
    for start in (angles[columns], *others):
        own = start.copy()
        left = approach(links, target, own, lower, upper, np.empty((3, 3)))
        if left < least - REACHED:
            least, angles[columns] = left, own
    return 0.0 if least <= REACHED else least
