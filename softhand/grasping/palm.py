"""Where a search of grasps has the palm: at the guess, or where the contact points of the scenario want it."""

from __future__ import annotations

import numpy as np

from softhand.assembly.parts import read_laws
from softhand.model.arm import REACHED, Arm
from softhand.model.joined import shared_columns
from softhand.model.posture import reach_together
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.scenario.scenario import Scenario
from softhand.start.reach import initial_joints


def standing_joints(world: World, scenario: Scenario) -> Array:
    """Joint angles [rad or m] from which fingers are searched with, shape (n,).

    Those of the guess; with `grasp.reach = "all"` those at which rigid tips touch the contact points of the scenario,
    as its start finds them: an arm has brought the palm there. If no posture does that, the guess.
    """
    guess = initial_joints(world, scenario.grasp.joint_guess)
    if scenario.grasp.reach == "fingers" or world.coupling is not None or not shared_columns(world.tips):
        return guess
    position, rotation = np.array(scenario.object.position), rotation_of(scenario.object.rpy)
    targets = []
    for point, law in zip(scenario.grasp.contact_points, read_laws(scenario), strict=True):
        foot, normal = world.shape.nearest(point)
        targets.append(position + rotation @ (foot + law.radius * normal))
    angles, left = reach_together(Arm(world), np.array(targets), guess)
    return angles if left <= REACHED else guess
