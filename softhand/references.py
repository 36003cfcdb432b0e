"""Desired object pose and internal force against time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

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
    """From where the grasp starts to where it shall go.

    Args:
        start: q_O at t = 0, shape (6,).
        target: q_Od in the end, shape (6,).
        start_force: f_N at t = 0 [N], shape (pairs,).
        target_force: f_Nd in the end [N], shape (pairs,).
        duration: of the motion [s].
    """

    def __init__(
        self, start: ArrayLike, target: ArrayLike, start_force: ArrayLike, target_force: ArrayLike, duration: float
    ) -> None:
        first = np.concatenate([start, start_force]).astype(float)
        self._first, self._change = first, np.concatenate([target, target_force]) - first
        self._duration = duration
        self._now = np.zeros((3, len(first)))  # values, rates, accelerations of pose and force
        self._move = prepared(_move, first, self._change, self._now, varying=(0.0, 0.0, 0.0))
        pose, rate, acceleration = self._now[:, :6]
        self.desired = Desired(pose, rate, acceleration, self._now[0, 6:])

    @abstractmethod
    def progress(self, time: float) -> tuple[float, float, float]:
        """s, s' [1/s], s'' [1/s^2] at a time [s]: 0 at the start, 1 at the target."""

    def update(self, time: float) -> Desired:
        """Set `desired` for a time [s]: start + s (target - start), component by component."""
        self._move(*self.progress(time))
        return self.desired


@compiled
def _move(first, change, now, s, rate, acceleration):
    for k in range(first.shape[0]):
        now[0, k] = first[k] + s * change[k]
        now[1, k] = rate * change[k]
        now[2, k] = acceleration * change[k]


class Step(Reference):
    """The target at once, as in the paper. It asks for more friction than there is on the way."""

    def progress(self, time: float) -> tuple[float, float, float]:
        """Always (1, 0, 0)."""
        return 1.0, 0.0, 0.0


class MinimumJerk(Reference):
    """s(x) = x^3 (10 - 15 x + 6 x^2), x = t / duration: the smoothest way from rest to rest."""

    def progress(self, time: float) -> tuple[float, float, float]:
        """s and its two derivatives."""
        T = self._duration
        x = min(max(time / T, 0.0), 1.0)
        return (
            x**3 * (10.0 - 15.0 * x + 6.0 * x * x),
            30.0 * x * x * (1.0 - x) ** 2 / T,
            60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / T**2,
        )


REFERENCES: dict[str, type[Reference]] = {"step": Step, "minimum-jerk": MinimumJerk}
