"""The tasks: which world, which goal, what counts as reached and as lost."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from softhand.numerics.arrays import Array
from softhand.simulation.pushes import Push

_DAMPED = {
    "fingertip.contact": "coulomb",
    "fingertip.friction": 0.8,
    "fingertip.damping": {"name": "kelvin-voigt", "radial": 1.0, "tangential": 1.0, "torsional": 1e-4},
}
"""Tips that slip, and whose ringing dies out."""


@dataclass(frozen=True)
class Task:
    """What an environment asks for.

    Attributes:
        scenario: name of the world about which worlds are drawn.
        overrides: its values that differ, by dotted key.
        steps: actions in an episode.
        reach: largest change from the start to the goal along x, y, z [m], and about them [rad], shape (6,).
        raised: how far the goal is above the start, lowest and highest [m].
        near: errors within which a goal is reached [m, rad].
        scale: errors each of which halves the dense reward [m, rad].
        lost: distance from the start at which the object is given up [m].
        begins_open: whether the fingers start off the object; otherwise a tip that lets go ends the episode.
        pushes: how many pushes there are in an episode, each of 0.1 s.
        push: largest force of one [N].
    """

    scenario: str
    overrides: Mapping[str, Any] = field(default_factory=dict)
    steps: int = 200
    reach: tuple[float, ...] = (0.0,) * 6
    raised: tuple[float, float] = (0.0, 0.0)
    near: tuple[float, float] = (0.002, 0.035)
    scale: tuple[float, float] = (0.005, 0.087)
    lost: float = 0.03
    begins_open: bool = False
    pushes: int = 0
    push: float = 0.0

    def draw_goal(self, rng: np.random.Generator, start: Array, up: Array) -> Array:
        """A goal.

        Args:
            rng: draws.
            start: pose of the object, position and quaternion, shape (7,).
            up: against gravity, shape (3,).
        """
        reach = np.array(self.reach)
        change = reach * rng.uniform(-1.0, 1.0, 6)
        goal = start.copy()
        goal[:3] += change[:3] + rng.uniform(*self.raised) * up
        goal[3:] = (Rotation.from_rotvec(change[3:]) * Rotation.from_quat(start[3:])).as_quat()
        return goal

    def draw_pushes(self, rng: np.random.Generator, duration: float) -> list[Push]:
        """The pushes of an episode of a duration [s], one after the other, in any direction."""
        found, pause = [], duration / (self.pushes + 1)
        for k in range(self.pushes):
            direction = rng.normal(size=3)
            force = self.push * rng.uniform(0.5, 1.0) * direction / np.linalg.norm(direction)
            start = round((k + rng.uniform(0.2, 0.8)) * pause, 3)
            found.append(Push(tuple(force.tolist()), start=start, duration=0.1))
        return found


TASKS = {
    "HoldBox": Task("hold", _DAMPED, pushes=3, push=1.0),
    "ReorientBox": Task("hold", _DAMPED, reach=(0.01, 0.01, 0.01, 0.17, 0.17, 0.17)),
    "GraspAndLift": Task(
        "grasp-and-lift", {"controller.patience": 10.0, "controller.lost": 0.1}, steps=400,
        reach=(0.0, 0.0, 0.0, 0.0, 0.0, 0.17), raised=(0.02, 0.04), near=(0.005, 0.087), scale=(0.01, 0.17),
        lost=0.08, begins_open=True,
    ),
}  # fmt: skip
"""By the name of the environment, `softhand/NAME-v0`."""
