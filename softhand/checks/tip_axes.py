"""Tips doubted whose x points elsewhere than out of the end of their finger."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from softhand.model.arm import Arm
from softhand.model.urdf.ends import end_of, rpy_to
from softhand.model.urdf.pinocchio_model import build_model
from softhand.model.world import World
from softhand.numerics.arrays import Array

_BESIDE = math.radians(75.0)
"""Angle between x and the way from the last joint to the end of its link from which a tip is doubted."""
_INTO = math.radians(105.0)
_CLOSING = math.radians(60.0)  # of a finger that can go one way only, between x and that way
_ONE_WAY = 0.05  # smallest over largest speed of a tip that can go one way only


def doubts_of_tip_axes(world: World, angles: Array) -> Iterator[str]:
    """A sentence for each tip whose x points into its finger or beside it.

    Where the last link ends is told by its shapes, or by the frames on it; a tip that one joint or motor alone moves,
    as that of a jaw, may also point along the way that it moves.

    Args:
        world: the hand with its tips.
        angles: of the joints, or motors [rad or m], shape (n,).
    """
    model = build_model(world.hand)
    leaders = {name: leader for leader, members in world.hand.tree.bodies().items() for name in members}
    arm = Arm(world)
    arm.move(angles)
    for i, tip in enumerate(world.tips):
        leader = leaders[tip.name]
        if leader == world.hand.tree.root:
            continue
        end = end_of(world.hand, model, leader)
        if not end.is_known:
            continue
        base = model.frames[model.getFrameId(leader, pin.FrameType.BODY)].placement
        place = base.actInv(model.frames[model.getFrameId(tip.name, pin.FrameType.BODY)].placement)
        beside = _angle(place.rotation[:, 0], end.out)
        if beside < _BESIDE or _closes(arm, i, arm.tip(i)[1][:, 0]):
            continue
        where = "into the finger" if beside > _INTO else "sideways"
        position, rpy = (
            ", ".join(f"{value:.4g}" for value in numbers) for numbers in (place.translation, rpy_to(end.out))
        )
        yield (
            f"{tip.name}: x of this tip points {where}, {math.degrees(beside):.0f} deg beside the way from the last "
            f"joint to the end of {leader}, but must point out of the tip; in hand.tips {{ frame = "
            f'"{leader}", position = [{position}], rpy = [{rpy}] }} is the same place with x along that way.'
        )


def _angle(one: Array, other: Array) -> float:
    return math.acos(float(np.clip(one @ other, -1.0, 1.0)))


def _closes(arm: Arm, index: int, x: Array) -> bool:
    """Whether a tip can go one way only, and x is along it."""
    world = arm.world
    J = arm.point_jacobian(index, arm.tip(index)[0])
    if world.coupling is None:  # without the joints of an arm, which carry all tips
        shared = set.intersection(*(set(tip.columns) for tip in world.tips))
        J = np.delete(J, sorted(shared), axis=1)
    U, sizes, _ = np.linalg.svd(J, full_matrices=False)
    if not len(sizes) or sizes[0] < 1e-9:
        return True  # a jaw that stands still presses with whatever side
    if len(sizes) > 1 and sizes[1] > _ONE_WAY * sizes[0]:
        return False
    return abs(float(U[:, 0] @ x)) > math.cos(_CLOSING)
