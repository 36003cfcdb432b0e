"""What is asked for at one time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from softhand.numerics.arrays import Array, as_numbers


@dataclass(frozen=True, eq=False)
class Desired:
    """What the reference asks for at one time; the arrays are live.

    Attributes:
        coordinates: q_Od = (position [m], roll, pitch, yaw [rad]), shape (6,).
        coordinates_rate: its rate, shape (6,).
        coordinates_acceleration: its second derivative, shape (6,).
        internal_force: f_Nd [N], shape (pairs,).
        twist: velocity of the object's origin [m/s] and angular velocity [rad/s], world axes, shape (6,).
        twist_rate: its rate, shape (6,).
        opening: how far the tips shall stand off their contact points [m], below 0 to press; shape (1,).
        carried: share of the object's weight that the fingers shall carry, 0 while a table does; shape (1,).
        standoff: of the palm from its place at the object, base frame [m], shape (3,).
        standoff_rate: its rate [m/s], shape (3,).
        standoff_acceleration: its second derivative [m/s^2], shape (3,).
    """

    coordinates: Array
    coordinates_rate: Array
    coordinates_acceleration: Array
    internal_force: Array
    twist: Array = field(default_factory=lambda: np.zeros(6))
    twist_rate: Array = field(default_factory=lambda: np.zeros(6))
    opening: Array = field(default_factory=lambda: np.zeros(1))
    carried: Array = field(default_factory=lambda: np.ones(1))
    standoff: Array = field(default_factory=lambda: np.zeros(3))
    standoff_rate: Array = field(default_factory=lambda: np.zeros(3))
    standoff_acceleration: Array = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True, eq=False)
class Goal:
    """The same as plain values: where a run starts, where a reference comes to rest, or what it says of one time.

    Attributes:
        coordinates: q_Od [m, rad], shape (6,).
        internal_force: f_Nd [N], shape (pairs,).
        opening: of the tips [m].
        carried: share of the weight.
        standoff: of the palm [m], shape (3,).
        rate: q_Od', shape (6,); None to have it told from what is asked for shortly before and after.
        acceleration: q_Od'', shape (6,); likewise.
    """

    coordinates: ArrayLike
    internal_force: ArrayLike
    opening: float = 0.0
    carried: float = 1.0
    rate: ArrayLike | None = None
    acceleration: ArrayLike | None = None
    standoff: ArrayLike = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("coordinates", "internal_force", "standoff", "rate", "acceleration"):
            value = getattr(self, name)
            if value is not None or name in ("coordinates", "internal_force", "standoff"):
                numbers = as_numbers(value)
                if numbers is None:
                    raise ValueError(f"a goal has {value!r} as {name}, which is no array of real numbers")
                object.__setattr__(self, name, numbers.copy())

    def row(self) -> Array:
        """All that references interpolate, in the order of `Desired`, shape (11 + pairs,)."""
        return np.concatenate([self.coordinates, self.internal_force, [self.opening, self.carried], self.standoff])
