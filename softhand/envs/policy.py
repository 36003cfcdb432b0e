"""Learned policies: a matrix from what is observed to the set point, for learning and as a controller."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from pydantic import field_validator
from scipy.spatial.transform import Rotation

from softhand.controllers.blocks import (
    add_internal_forces,
    add_pose_spring,
    add_torsion,
    feed_back_internal_forces,
    hold_joints,
    pose_error,
    push_contacts,
    share_wrench,
    take_off_torsion,
    turn_error,
)
from softhand.controllers.controller import Controller
from softhand.controllers.gains import diagonal, pose_diagonal
from softhand.envs.acting.set_point import FARTHEST, MOVE
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.rotations import set_rotation, set_rpy, turn_rotation
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain, Vector

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
