"""What residuals and defects are weighed by: the noise of each channel, and the slack between pieces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from softhand.calibration.bench import Linear, Run
from softhand.calibration.problem import Problem
from softhand.model.world import slides_of
from softhand.numerics.arrays import Array

_STEP = 2e-3  # [s] at which the slack is as follows
_TURN, _SHIFT, _SPIN, _SPEED, _STORED = 5e-7, 1e-8, 1e-4, 2e-6, 5e-6  # [rad], [m], [rad/s], [m/s], [rad]
_LEAST_NOISE = {
    "joint_position": 1e-6, "joint_velocity": 1e-4, "object_position": 1e-7, "object_orientation": 1e-6,
    "contact_force": 1e-4, "contact_torsion": 1e-6,
}  # fmt: skip
"""Below which no noise is taken for real."""


class Weights(NamedTuple):
    """What a sum of squares is made with.

    Attributes:
        sigma: standard deviation of the noise of each channel.
        slack: of each state at the begin of each piece but the first, shape (pieces - 1, states).
    """

    sigma: Array
    slack: Array

    def of_residuals(self, problem: Problem, k: int) -> Array:
        """Of each row of the residuals of a piece."""
        return np.asarray(1.0 / self.sigma[problem.channel[k]])


def noise_of(problem: Problem) -> Array:
    """A first guess of the noise of each channel: from second differences of what was measured."""
    found = []
    for name, k in problem.channels:
        values = problem.log.measured[name]
        values = values[np.isfinite(values).all(axis=1)]
        scale = 2.0 if name == "object_orientation" else 1.0  # a quaternion has half the angle
        values = values[:, :3] if name == "object_orientation" else values[:, k : k + 1]
        second = np.diff(values, n=2, axis=0)
        found.append(max(scale * float(np.sqrt(np.mean(second**2) / 6.0)), _LEAST_NOISE[name]))
    return np.array(found)


def noise_left(problem: Problem, runs: Sequence[Run | Linear], which: Sequence[int]) -> Array:
    """Standard deviation of the residuals of each channel."""
    squares, count = np.zeros(len(problem.channels)), np.zeros(len(problem.channels))
    for one, k in zip(runs, which, strict=True):
        squares += np.bincount(problem.channel[k], one.r**2, len(squares))
        count += np.bincount(problem.channel[k], minlength=len(squares))
    floors = np.array([_LEAST_NOISE[name] for name, _ in problem.channels])
    return np.maximum(np.sqrt(squares / np.maximum(count, 1)), floors)


def slack_of(problem: Problem) -> Array:
    """Of each state: what a piece may begin beside the end of the one before it.

    The pieces of a run of the model begin where those before them end. A little is allowed all the same: the steps of a
    fit would be short where all pieces are one run of seconds, in which a deviation grows a thousandfold in 0.2 s.
    """
    world, nz = problem.world, len(problem.remembered)
    turns = np.concatenate([~slides_of(world), [False] * 3, [True] * 3])
    share = (problem.step / _STEP) ** 2
    displacement, rate = np.where(turns, _TURN, _SHIFT), np.where(turns, _SPIN, _SPEED)
    return share * np.concatenate([displacement, rate, np.full(nz, _STORED)])
