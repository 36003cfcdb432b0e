"""Joint angles that bring a tip to a place."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from softhand.errors import GraspError
from softhand.model.arm import REACHED, Arm
from softhand.model.world import World
from softhand.numerics.arrays import Array


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
        name, joints = arm.world.tips[index].name, len(arm.own_columns(index))
        few = f" with {joints} joint{'' if joints == 1 else 's'}, where any point needs 3" if joints < 3 else ""
        raise GraspError(
            f"{name}: {place} is out of reach by {1e3 * gap:.3g} mm within the joint limits{few}. "
            "Move the object or the contact point closer, or give another grasp.joint_guess.",
            finger=name, quantity="reach", value=gap,
        )  # fmt: skip


def millimetres(point: ArrayLike) -> str:
    """A point [m] as text in mm."""
    return "(" + ", ".join(f"{1e3 * float(value):.4g}" for value in np.asarray(point)) + ")"
