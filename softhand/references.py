"""Desired object pose and internal force against time."""

from __future__ import annotations

from abc import ABC
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

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
        opening: how far the tips shall stand off their contact points [m], below 0 to press; shape (1,).
        carried: share of the object's weight that the fingers shall carry, 0 while a table does; shape (1,).
    """

    coordinates: Array
    coordinates_rate: Array
    coordinates_acceleration: Array
    internal_force: Array
    opening: Array = field(default_factory=lambda: np.zeros(1))
    carried: Array = field(default_factory=lambda: np.ones(1))


@dataclass(frozen=True)
class Waypoint:
    """Where a reference passes at rest, as `Desired` has it, and how it gets there.

    Attributes:
        coordinates: q_Od [m, rad], shape (6,).
        internal_force: f_Nd [N], shape (pairs,).
        opening: of the tips [m].
        carried: share of the weight.
        duration: of the way there [s].
        phase: name of the way there; "" for none.
    """

    coordinates: Sequence[float]
    internal_force: Sequence[float]
    opening: float = 0.0
    carried: float = 1.0
    duration: float = 1.0
    phase: str = ""

    def row(self) -> Array:
        """All that is interpolated, in the order of `Desired`."""
        return np.concatenate([self.coordinates, self.internal_force, [self.opening, self.carried]]).astype(float)


class Reference(ABC):
    """Desired values against time.

    Attributes:
        desired: at the time of the last `update`; live.
        phases: name and time of the begin [s] of each named phase, in the order of time.
    """

    desired: Desired
    phases: tuple[tuple[str, float], ...] = ()
    _move: Callable[[float], None]

    def update(self, time: float) -> Desired:
        """Set `desired` for a time [s]."""
        self._move(time)
        return self.desired

    def _show(self, now: Array) -> None:
        """Make `desired` the view of values, rates and accelerations of a row, shape (3, len(row))."""
        pose, rate, acceleration = now[:, :6]
        self.desired = Desired(pose, rate, acceleration, now[0, 6:-2], now[0, -2:-1], now[0, -1:])


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
def _minimum_jerk(duration, first, change, now, time):
    x = min(max(time / duration, 0.0), 1.0)
    s = x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
    rate = 30.0 * x * x * (1.0 - x) ** 2 / duration
    acceleration = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / duration**2
    _follow(first, change, now, s, rate, acceleration)


@compiled
def _pass_waypoints(times, rows, changes, now, time):
    leg = 0
    while leg < changes.shape[0] - 1 and time >= times[leg + 1]:
        leg += 1
    _minimum_jerk(times[leg + 1] - times[leg], rows[leg], changes[leg], now, time - times[leg])


class Step(Straight):
    """The target at once, as in the paper: s = 1. It asks for more friction than there is on the way."""

    move = staticmethod(_jump)


class MinimumJerk(Straight):
    """s(x) = x^3 (10 - 15 x + 6 x^2), x = t / duration: the smoothest way from rest to rest."""

    move = staticmethod(_minimum_jerk)


class Waypoints(Reference):
    """From one waypoint to the next, each leg by minimum jerk from rest to rest; the last one is kept.

    Args:
        start: where the run starts; its duration and phase are not used.
        waypoints: in the order of time, at least one.
    """

    def __init__(self, start: Waypoint, waypoints: Sequence[Waypoint]) -> None:
        rows = np.array([point.row() for point in (start, *waypoints)])
        times = np.cumsum([0.0, *(point.duration for point in waypoints)])
        now = np.zeros((3, rows.shape[1]))
        self.phases = tuple(
            (point.phase, round(float(begin), 9)) for point, begin in zip(waypoints, times, strict=False) if point.phase
        )
        self._move = prepared(_pass_waypoints, times, rows[:-1].copy(), np.diff(rows, axis=0), now, varying=(0.0,))
        self._show(now)


STRAIGHT: dict[str, type[Straight]] = {"step": Step, "minimum-jerk": MinimumJerk}
"""References with one target."""
