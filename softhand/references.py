"""Desired object pose and internal force against time."""

from __future__ import annotations

from abc import ABC
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softhand.compiled import compiled, prepared

Array = NDArray[np.float64]


@dataclass
class Desired:
    """What the reference asks for at one time; the arrays are live.

    Attributes:
        coordinates: q_Od = (position [m], roll, pitch, yaw [rad]), shape (6,).
        coordinates_rate: its rate, shape (6,).
        coordinates_acceleration: its second derivative, shape (6,).
        internal_force: f_Nd [N], shape (pairs,).
    """

    coordinates: Array
    coordinates_rate: Array
    coordinates_acceleration: Array
    internal_force: Array


class Reference(ABC):
    """From where the grasp starts to where it shall go: start + s(t) (target - start), component by component.

    Args:
        start: q_O at t = 0, shape (6,).
        target: q_Od in the end, shape (6,).
        start_force: f_N at t = 0 [N], shape (pairs,).
        target_force: f_Nd in the end [N], shape (pairs,).
        duration: of the motion [s].
    """

    move: ClassVar[Callable[..., None]]
    """Compiled static method (duration, first, change, now, time): calls `_follow` with s, s' [1/s] and s'' [1/s^2]."""

    def __init__(
        self, start: ArrayLike, target: ArrayLike, start_force: ArrayLike, target_force: ArrayLike, duration: float
    ) -> None:
        first = np.concatenate([start, start_force]).astype(float)
        now = np.zeros((3, len(first)))  # values, rates, accelerations of pose and force
        change = np.concatenate([target, target_force]) - first
        self._move = prepared(self.move, float(duration), first, change, now, varying=(0.0,))
        pose, rate, acceleration = now[:, :6]
        self.desired = Desired(pose, rate, acceleration, now[0, 6:])

    def update(self, time: float) -> Desired:
        """Set `desired` for a time [s]."""
        self._move(time)
        return self.desired


@compiled
def _follow(first, change, now, s, rate, acceleration):
    for k in range(first.shape[0]):
        now[0, k] = first[k] + s * change[k]
        now[1, k] = rate * change[k]
        now[2, k] = acceleration * change[k]


@compiled
def _jump(duration, first, change, now, time):
    _follow(first, change, now, 1.0, 0.0, 0.0)


@compiled
def _minimum_jerk(duration, first, change, now, time):
    x = min(max(time / duration, 0.0), 1.0)
    s = x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
    rate = 30.0 * x * x * (1.0 - x) ** 2 / duration
    acceleration = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / duration**2
    _follow(first, change, now, s, rate, acceleration)


class Step(Reference):
    """The target at once, as in the paper: s = 1. It asks for more friction than there is on the way."""

    move = staticmethod(_jump)


class MinimumJerk(Reference):
    """s(x) = x^3 (10 - 15 x + 6 x^2), x = t / duration: the smoothest way from rest to rest."""

    move = staticmethod(_minimum_jerk)


REFERENCES: dict[str, type[Reference]] = {"step": Step, "minimum-jerk": MinimumJerk}
