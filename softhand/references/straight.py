"""References with one target."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from softhand.numerics.compiled import compiled
from softhand.references.goal import Goal
from softhand.references.legs import OrientationPath, follow, legs_between
from softhand.references.reference import Motion, Reference, motion_along
from softhand.settings.settings import Positive, Vector, Vector3


class Straight(Reference):
    """From where the run starts to one target: position and force straight, the orientation about one axis."""

    object_position: Vector3
    """Target position, in the base frame [m]."""
    object_rpy: Vector3
    """Target roll, pitch, yaw [rad]."""
    internal_force: Vector
    """Target of the internal force, in the order of grasp.internal_force [N]."""
    duration: Positive = 1.0
    """Time to the target [s]; of `minimum-jerk` only."""
    orientation_path: OrientationPath = "geodesic"
    """`geodesic`: about one axis; `euler`: roll, pitch and yaw one by one, as in the paper."""

    move: ClassVar[Callable[..., None]]
    """Compiled static method (legs, now, twist, time) that calls `legs.follow` with s, s' [1/s] and s'' [1/s^2]."""

    def start(self, start: Goal) -> Motion:
        """The motion; fingers that start open are asked to touch, and to carry all the weight."""
        first = Goal(start.coordinates, start.internal_force)
        target = Goal((*self.object_position, *self.object_rpy), self.internal_force)
        legs = legs_between([first, target], [self.duration], self.orientation_path)
        return motion_along(legs, self.move, stops=(self.duration,))


@compiled
def _jump(legs, now, twist, time):
    follow(legs, 0, 1.0, 0.0, 0.0, now, twist)


@compiled
def minimum_jerk(legs, leg, now, twist, time):
    """One leg by s(x) = x^3 (10 - 15 x + 6 x^2), x its share of the time [s]."""
    duration = legs.times[leg + 1] - legs.times[leg]
    x = min(max((time - legs.times[leg]) / duration, 0.0), 1.0)
    s = x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
    rate = 30.0 * x * x * (1.0 - x) ** 2 / duration
    acceleration = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / duration**2
    follow(legs, leg, s, rate, acceleration, now, twist)


@compiled
def _minimum_jerk(legs, now, twist, time):
    minimum_jerk(legs, 0, now, twist, time)


class Step(Straight):
    """The target at once, as in the paper: s = 1. It asks for more friction than there is on the way."""

    move = staticmethod(_jump)


class MinimumJerk(Straight):
    """s(x) = x^3 (10 - 15 x + 6 x^2), x = t / duration: the smoothest way from rest to rest."""

    move = staticmethod(_minimum_jerk)
