"""References with one target."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import numpy as np

from softhand.numerics.compiled import compiled
from softhand.numerics.prepared import prepared
from softhand.references.goal import Goal
from softhand.references.reference import Motion, Reference
from softhand.settings.settings import Positive, Vector, Vector3


class Straight(Reference):
    """From where the run starts to one target: start + s(t) (target - start), component by component."""

    object_position: Vector3
    """Target position, in the base frame [m]."""
    object_rpy: Vector3
    """Target roll, pitch, yaw [rad]."""
    internal_force: Vector
    """Target of the internal force, in the order of grasp.internal_force [N]."""
    duration: Positive = 1.0
    """Time to the target [s]; of `minimum-jerk` only."""

    move: ClassVar[Callable[..., None]]
    """Compiled static method (duration, first, change, now, time): calls `_follow` with s, s' [1/s] and s'' [1/s^2]."""

    def start(self, start: Goal) -> Motion:
        """The motion; fingers that start open are asked to touch, and to carry all the weight."""
        first = Goal(start.coordinates, start.internal_force).row()
        change = Goal((*self.object_position, *self.object_rpy), self.internal_force).row() - first
        now = np.zeros((3, len(first)))
        move = prepared(self.move, float(self.duration), first, change, now, varying=(0.0,))
        return Motion(now, move, stops=(self.duration,))


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
def minimum_jerk(duration, first, change, now, time):
    """now = first + s(t) change with s(x) = x^3 (10 - 15 x + 6 x^2), and its rates; see `_follow`."""
    x = min(max(time / duration, 0.0), 1.0)
    s = x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
    rate = 30.0 * x * x * (1.0 - x) ** 2 / duration
    acceleration = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / duration**2
    _follow(first, change, now, s, rate, acceleration)


class Step(Straight):
    """The target at once, as in the paper: s = 1. It asks for more friction than there is on the way."""

    move = staticmethod(_jump)


class MinimumJerk(Straight):
    """s(x) = x^3 (10 - 15 x + 6 x^2), x = t / duration: the smoothest way from rest to rest."""

    move = staticmethod(minimum_jerk)
