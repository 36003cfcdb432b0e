"""References with one target."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

import numpy as np

from softhand.numerics.compiled import compiled
from softhand.numerics.prepared import prepared
from softhand.references.reference import Reference, Waypoint


class Straight(Reference):
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
        self,
        start: Sequence[float],
        target: Sequence[float],
        start_force: Sequence[float],
        target_force: Sequence[float],
        duration: float,
    ) -> None:
        first = Waypoint(start, start_force).row()
        now = np.zeros((3, len(first)))
        change = Waypoint(target, target_force).row() - first
        self._move = prepared(self.move, float(duration), first, change, now, varying=(0.0,))
        self._show(now)


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


STRAIGHT: dict[str, type[Straight]] = {"step": Step, "minimum-jerk": MinimumJerk}
"""References with one target."""
