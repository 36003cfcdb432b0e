"""The ways from one goal to the next: straight for position and force, a geodesic for the orientation."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.rotations import rates_to_turning, rotation_vector, set_rpy, turn_rotation, turning_to_rates
from softhand.numerics.spatial import rotation_of
from softhand.references.goal import Goal

OrientationPath: TypeAlias = Literal["geodesic", "euler"]
"""`geodesic` turns about one axis, the shortest way; `euler` moves roll, pitch and yaw one by one, as in the paper."""


class Legs(NamedTuple):
    """Legs, one after the other."""

    times: Array
    """When each begins, and the last one ends [s], shape (legs + 1,)."""
    rows: Array
    """`Goal.row` at the begin, shape (legs, 11 + pairs)."""
    changes: Array
    """What it changes until the end, likewise."""
    rotations: Array
    """Orientation at the begin, shape (legs, 3, 3)."""
    turns: Array
    """Rotation vector from there to the end, world axes [rad], shape (legs, 3)."""
    is_geodesic: int
    """1, or 0 for `euler`."""
    scratch: Array
    """Shape (3, 3)."""


def legs_between(goals: Sequence[Goal], durations: Sequence[float], path: OrientationPath) -> Legs:
    """The legs that pass the goals."""
    rows = np.array([goal.row() for goal in goals])
    rotations = np.array([rotation_of(np.asarray(goal.coordinates)[3:]) for goal in goals])
    turns = [rotation_vector(*pair) for pair in pairwise(rotations)]
    times = np.cumsum([0.0, *durations])
    is_geodesic = int(path == "geodesic")
    return Legs(times, rows[:-1].copy(), np.diff(rows, axis=0), rotations[:-1].copy(), np.array(turns), is_geodesic,
                np.empty((3, 3)))  # fmt: skip


@compiled
def follow(legs, leg, s, rate, acceleration, now, twist):
    """Where a leg is after the share s of its way.

    Args:
        legs: a `Legs`.
        leg: which.
        s: share of the way.
        rate: s' [1/s].
        acceleration: s'' [1/s^2].
        now: values, rates, accelerations in the order of `Goal.row`, set, shape (3, 11 + pairs).
        twist: velocity and angular velocity of the object, world axes, and their rates, set, shape (2, 6).
    """
    first, change, turn = legs.rows[leg], legs.changes[leg], legs.turns[leg]
    for k in range(first.shape[0]):
        now[0, k], now[1, k], now[2, k] = first[k] + s * change[k], rate * change[k], acceleration * change[k]
    if not legs.is_geodesic:
        complete(now, twist)
        return
    for k in range(3):
        twist[0, k], twist[1, k] = now[1, k], now[2, k]
        twist[0, 3 + k], twist[1, 3 + k] = rate * turn[k], acceleration * turn[k]
    if turn[0] == 0.0 and turn[1] == 0.0 and turn[2] == 0.0:  # the angles stay as they were given
        for k in range(3, 6):
            now[0, k], now[1, k], now[2, k] = first[k], 0.0, 0.0
        return
    # R = exp([s turn]x) R_start, and what it is in roll, pitch, yaw
    turn_rotation(s * turn[0], s * turn[1], s * turn[2], legs.rotations[leg], legs.scratch)
    set_rpy(legs.scratch, now[0, 3:6])
    turning_to_rates(now[0, 3:6], twist[0, 3:6], twist[1, 3:6], now[1, 3:6], now[2, 3:6])


@compiled
def complete(now, twist):
    """The twist and its rate from the coordinates and theirs."""
    for k in range(3):
        twist[0, k], twist[1, k] = now[1, k], now[2, k]
    rates_to_turning(now[0, 3:6], now[1, 3:6], now[2, 3:6], twist[0, 3:6], twist[1, 3:6])
