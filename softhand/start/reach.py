"""Joint angles that bring a tip to a place."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from softhand.contact.pads import Fingertip
from softhand.errors import GraspError
from softhand.model.arm import REACHED, Arm
from softhand.model.joined import shared_columns
from softhand.model.posture import reach_together
from softhand.model.world import World
from softhand.numerics.arrays import Array

Reach: TypeAlias = Literal["fingers", "all"]
"""Which joints a start moves: those of one finger each, or those of wrist and arm too."""


def initial_joints(world: World, guess: ArrayLike | None) -> Array:
    """Where the inverse kinematics starts [rad], shape (n,); GraspError for a guess of another length."""
    lower, upper = world.position_limits
    if guess is None:
        return np.where(np.isfinite(lower + upper), 0.5 * (lower + upper), 0.0)
    angles = np.array(guess, dtype=float)
    if angles.shape != lower.shape:
        raise GraspError(
            f"grasp.joint_guess has {angles.size} angles; the hand has {lower.size} joints.",
            finger="", quantity="joints", value=angles.size,
        )  # fmt: skip
    return np.clip(angles, lower, upper)


def reach_point(
    arm: Arm, index: int, target: Array, angles: Array, wish: Array | None, place: str = "the contact point"
) -> None:
    """Set the joints of one finger so that its tip frame is at a point; see `Arm.reach` for the wish.

    Raises:
        GraspError: that is out of reach, or no joint moves this tip alone.
    """
    if not arm.own_columns(index):
        name = arm.world.tips[index].name
        raise GraspError(
            f"{name}: no joint moves this tip without another one. Give each tip a finger of its own in hand.tips.",
            finger=name, quantity="joints", value=0,
        )  # fmt: skip
    gap = arm.reach(index, target, angles, wish)
    if gap > REACHED:
        world = arm.world
        name, joints = world.tips[index].name, len(arm.own_columns(index))
        few = f" with {joints} joint{'' if joints == 1 else 's'}, where any point needs 3" if joints < 3 else ""
        shared = [world.joint_names[column] for column in shared_columns(world.tips)]
        wrist = f'; with grasp.reach = "all" {_listed(shared)} would move too' if shared else ""
        raise GraspError(
            f"{name}: {place} is out of reach by {1e3 * gap:.3g} mm within the joint limits{few}. "
            f"Move the object or the contact point closer, or give another grasp.joint_guess{wrist}.",
            finger=name, quantity="reach", value=gap,
        )  # fmt: skip


def place_palm(
    arm: Arm,
    fingertips: Sequence[Fingertip],
    points: Sequence[Array],
    rotation: Array,
    angles: Array,
    gap: float = 0.0,
    place: str = "the contact point",
) -> None:
    """Set all joints so that every tip stands before its contact point, the fingers as in the guess as well as can be.

        x_i = p_i + (r + gap) n_i

    Args:
        arm: of the hand.
        fingertips: law and face of each tip.
        points: of contact, in the world [m], one a tip.
        rotation: axes of the object in the world, shape (3, 3).
        angles: the guess; set, see `reach_together` [rad or m], shape (n,).
        gap: between tip and face [m].
        place: what the points are, for the message.

    Raises:
        GraspError: not all points are in reach at once.
    """
    outward = [rotation @ tip.face.normal for tip in fingertips]
    targets = np.array([
        np.asarray(point) + (tip.law.radius + gap) * normal
        for point, tip, normal in zip(points, fingertips, outward, strict=True)
    ])  # fmt: skip
    found, left = reach_together(arm, targets, angles)
    if left > REACHED:
        world = arm.world
        ways = [float(np.linalg.norm(arm.tip(i)[0] - target)) for i, target in enumerate(targets)]
        name = world.tips[int(np.argmax(ways))].name
        shared = _listed([world.joint_names[column] for column in shared_columns(world.tips)])
        raise GraspError(
            f"{name}: {place} is out of reach by {1e3 * left:.3g} mm within the joint limits, with {shared} moving "
            "too. Move the object closer, or give another grasp.joint_guess.",
            finger=name, quantity="reach", value=left,
        )  # fmt: skip
    angles[:] = found


def _listed(names: Sequence[str]) -> str:
    """Some names, of many the first and the last."""
    return ", ".join(names) if len(names) <= 3 else f"{names[0]} to {names[-1]}"


def millimetres(point: ArrayLike) -> str:
    """A point [m] as text in mm."""
    return "(" + ", ".join(f"{1e3 * float(value):.4g}" for value in np.asarray(point)) + ")"
