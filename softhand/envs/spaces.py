"""Spaces of Gymnasium for episodes."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from softhand.envs.episodes import Episodes
from softhand.numerics.arrays import AnyArray, Array

_GOAL = np.array([10.0, 10.0, 10.0, 1.0, 1.0, 1.0, 1.0])


def action_space(episodes: Episodes) -> spaces.Box:
    """Numbers from -1 to 1."""
    return spaces.Box(-1.0, 1.0, (episodes.acting.size,), np.float32)


def observation_space(episodes: Episodes) -> spaces.Dict:
    """As in Gymnasium-Robotics: what is observed, the pose of the object, and the pose that it shall have."""
    limits, goal = episodes.limits, spaces.Box(-_GOAL, _GOAL, dtype=np.float64)
    return spaces.Dict(
        observation=spaces.Box(-limits, limits, dtype=np.float64),
        achieved_goal=goal,
        desired_goal=spaces.Box(-_GOAL, _GOAL, dtype=np.float64),
    )


def observed(episodes: Episodes) -> dict[str, Array]:
    """All worlds, copied, shape (worlds, ...) each."""
    return {
        "observation": episodes.observation(),
        "achieved_goal": np.clip(episodes.achieved(), -_GOAL, _GOAL),
        "desired_goal": episodes.goals.copy(),
    }


def of_world(observations: dict[str, Any], index: int) -> dict[str, AnyArray]:
    """That of one world."""
    return {name: array[index].copy() for name, array in observations.items()}
