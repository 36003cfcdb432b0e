"""Linear policies: a matrix from what is observed to the next move of the set point."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from softhand.numerics.arrays import Array

ACTIONS, FEATURES = 6, 18
"""Rows and columns of a policy."""

SCALE = np.array([0.01] * 3 + [0.17] * 3 + [0.01] * 3 + [0.17] * 3 + [0.1] * 3 + [1.0] * 3)
"""Of the features [m, rad, m, rad, m/s, rad/s]."""


def features(observation: Mapping[str, Array]) -> Array:
    """What a policy is told: how far the goal is, how far the set point is, how the object moves; divided by `SCALE`.

    Args:
        observation: of `ReorientBox` or `HoldBox` with the action `set-point`, of one world or of many.

    Returns:
        Shape (..., 18): missing position and turn, position and turn of the set point from the object, twist; all in
        axes of the base.
    """
    seen, now, goal = (observation[name] for name in ("observation", "achieved_goal", "desired_goal"))
    turn = Rotation.from_quat(goal[..., 3:]) * Rotation.from_quat(now[..., 3:]).inv()
    joints = (seen.shape[-1] - 12) // 2
    twist, ahead = seen[..., 2 * joints : 2 * joints + 6], seen[..., 2 * joints + 6 :]
    return np.concatenate([goal[..., :3] - now[..., :3], turn.as_rotvec(), ahead, twist], axis=-1) / SCALE


def act(weights: Array, observation: Mapping[str, Array]) -> Array:
    """The actions of linear policies, from -1 to 1.

    Args:
        weights: one policy, shape (6, 18), or one for each world, shape (worlds, 6, 18).
        observation: as `features` takes it.
    """
    return np.clip(np.einsum("...ij,...j->...i", weights, features(observation)), -1.0, 1.0)
