"""Desired object pose and internal force against time."""

from __future__ import annotations

from abc import ABC
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from softhand.numerics.arrays import Array


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
