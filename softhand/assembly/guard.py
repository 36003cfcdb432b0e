"""What ends a run of a scenario at its first collision."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.assembly.collisions import situation_of
from softhand.assembly.resolve import Setup
from softhand.collision.lookout import Lookout
from softhand.model.world import World, joints_of
from softhand.numerics.arrays import Array
from softhand.simulation.guard import Guard


def read_guard(setup: Setup) -> Guard | None:
    """The guard that `collision.ends_run` asks for, if it does.

    Raises:
        ModelError: the hand has no shapes that tell collisions, or the object has none.
    """
    section = setup.asked.collision
    if section is None or not section.ends_run:
        return None
    lookout, world = Lookout(situation_of(setup, section.shapes), section.depth), setup.world
    stride = max(int(section.every / setup.asked.control_period + 1e-6), 1)
    return Guard(lambda q: _collision(lookout, world, q), stride, "collision")


def guard_after(setup: Setup, before: Setup, guard: Guard | None) -> Guard | None:
    """The guard of a setup from that of another one: the same where all that it knows is the same, else a new one."""
    return guard if _known(setup) == _known(before) else read_guard(setup)


def _known(setup: Setup) -> Any:
    asked, world = setup.asked, setup.world
    radii = [tip.law.radius for tip in setup.fingertips]
    return (
        (asked.collision, asked.control_period, asked.hand, asked.table, asked.palm, asked.obstacle),
        (
            asked.fingertip.tips_touch,
            asked.object.ellipsoid,
            asked.object.cut,
            radii,
            world.hand.text,
            world.object.text,
        ),
    )


def _collision(lookout: Lookout, world: World, q: Array) -> str:
    seen = lookout.deepest(joints_of(world, q), np.array(world.object_position(q)), np.array(world.object_rotation(q)))
    if seen is None:
        return ""
    return (
        f"{seen.one} is {1e3 * seen.depth:.3g} mm deep in {seen.other}, and collision.ends_run ends the run there; "
        "raise collision.depth, or leave collision.ends_run out to be told after the run"
    )
