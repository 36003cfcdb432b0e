"""Whether the fingers can get to where a reference asks for the object."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from softhand.assembly.parts import read_start
from softhand.assembly.resolve import Setup
from softhand.errors import GraspError, LawError, SimulationStopped
from softhand.numerics.spatial import rotation_of
from softhand.start.grasp import solve_grasp


def doubts_of_target(setup: Setup) -> Iterator[str]:
    """Whether a tip can get to its contact point where the reference asks for the object.

    By then the contacts have rolled on, a radius or so; so only a point that is further away counts.
    """
    world, tips, grasp = setup.world, setup.fingertips, setup.scenario.grasp
    radius, told = max(tip.law.radius for tip in tips), set()
    motion = setup.reference.start(read_start(setup.scenario))
    for time in motion.stops or (setup.scenario.duration,):
        try:
            desired = motion.update(time)
        except SimulationStopped as stop:  # of a reference of somebody
            yield str(stop)
            return
        position, rpy = np.split(desired.coordinates, 2)
        force = desired.internal_force
        if not force.any():
            continue
        try:
            solve_grasp(
                world, tips, grasp.contact_points, force, position, rotation_of(rpy), grasp.joint_guess,
                reach=grasp.reach,
            )  # fmt: skip
        except LawError as error:
            yield f"reference: at the target, {error}"
        except GraspError as error:
            if error.quantity == "reach" and error.value > radius and str(error) not in told:
                told.add(str(error))
                yield f"reference: at the target, {error}"
