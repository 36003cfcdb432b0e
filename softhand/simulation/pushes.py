"""Pushes from outside: a wrench on the object or on a link, by schedule or by call."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.errors import ScenarioError
from softhand.numerics.arrays import Array, as_numbers
from softhand.numerics.compiled import compiled
from softhand.plant.plant import Plant

OBJECT = "object"
Vector3 = Sequence[float]


@dataclass(frozen=True)
class Push:
    """A force and a moment on one body while a time lasts, world axes.

    A step holds the generalized force J^T (force, moment) of its begin.

    Attributes:
        force: [N], shape (3,).
        moment: [N m], shape (3,).
        on: "object", or a link or frame of the hand.
        point: where the force acts, in the frame of that body [m], shape (3,).
        start: [s].
        duration: [s].
    """

    force: Vector3 = (0.0, 0.0, 0.0)
    moment: Vector3 = (0.0, 0.0, 0.0)
    on: str = OBJECT
    point: Vector3 = (0.0, 0.0, 0.0)
    start: float = 0.0
    duration: float = np.inf


class Pushes:
    """All pushes on a plant; sets `Plant.external`.

    Attributes:
        are_any: whether there is anything to apply, now or later.

    Args:
        plant: what is pushed.
        schedule: pushes at times that are known.

    Raises:
        ModelError: a push is on a link that the hand does not have.
        ScenarioError: its numbers make no push.
    """

    def __init__(self, plant: Plant, schedule: Sequence[Push] = ()) -> None:
        self._plant = plant
        self._schedule = push_table(plant, schedule)
        self._now = push_table(plant, ())
        self.are_any = bool(len(schedule))

    def add(self, push: Push) -> None:
        """Another push, which `clear` ends."""
        now, more = self._now, push_table(self._plant, [push])
        self._now = PushTable(np.concatenate([now.rows, more.rows]), np.concatenate([now.moves, more.moves]))
        self.are_any = True

    def clear(self) -> None:
        """End the pushes that were added."""
        self._now = push_table(self._plant, ())
        self.are_any = bool(len(self._schedule.rows))

    def apply(self, time: float, q: Array) -> None:
        """Set the generalized force of the step that begins at a time [s], at a configuration, shape (nq,)."""
        external, snapshot = self._plant.external, self._plant.snapshot
        external[:] = 0.0
        begins, ends = self._schedule.rows["start"], self._schedule.rows["end"]
        if len(self._now.rows) or np.any((begins <= time + ROUNDING) & (time + ROUNDING < ends)):
            snapshot.sense(q)
            for pushes in (self._schedule, self._now):
                add_pushes(pushes, time, snapshot.poses, snapshot.J, external)


ROUNDING = 1e-9
"""Of times [s]."""


PUSH = np.dtype(
    [
        ("joint", np.int64),  # that carries the body
        ("first_twist", np.int64),  # first column of J for that body, see `World.view`
        ("force", np.float64, 3),  # world axes [N]
        ("moment", np.float64, 3),  # world axes [N m]
        ("point", np.float64, 3),  # where the force acts, in the frame of the joint [m]
        ("start", np.float64),  # [s]
        ("end", np.float64),  # [s]
    ]
)
"""One push."""


class PushTable(NamedTuple):
    """Pushes as kernels take them."""

    rows: NDArray[np.void]
    """Table `PUSH`, shape (pushes,)."""
    moves: NDArray[np.int64]
    """1 at the velocities that move the body, shape (pushes, nv)."""


def push_table(plant: Plant, pushes: Sequence[Push]) -> PushTable:
    """Pushes as a table for `add_pushes`.

    Raises:
        ModelError: a push is on a link that the hand does not have.
        ScenarioError: its numbers make no push.
    """
    world = plant.world
    table = PushTable(np.zeros(len(pushes), PUSH), np.zeros((len(pushes), world.nv), np.int64))
    for row, moves, push in zip(*table, pushes, strict=True):
        _check(push)
        row["joint"], row["point"] = world.object_joint, push.point
        if push.on != OBJECT:
            row["joint"], place = world.hand_frame(push.on)
            row["point"] = place.act(np.asarray(push.point, dtype=float))
        row["force"], row["moment"] = push.force, push.moment
        row["start"], row["end"] = push.start, push.start + push.duration
        row["first_twist"] = world.view(int(row["joint"]))
        moves[world.columns_of(int(row["joint"]))] = 1
    return table


@compiled
def add_pushes(pushes, time, poses, J, external):
    """external += J^T (force, moment) of each push that is on at a time [s], at the places of the bodies now.

    Args:
        pushes: of `push_table`.
        time: [s].
        poses: `Snapshot.poses`, shape (joints, 12).
        J: `Snapshot.J`.
        external: shape (nv,).
    """
    for i in range(pushes.rows.shape[0]):
        push = pushes.rows[i]
        if not push.start <= time + ROUNDING < push.end:
            continue
        pose, p, f, m = poses[push.joint], push.point, push.force, push.moment
        x = pose[9] + pose[0] * p[0] + pose[3] * p[1] + pose[6] * p[2]
        y = pose[10] + pose[1] * p[0] + pose[4] * p[1] + pose[7] * p[2]
        z = pose[11] + pose[2] * p[0] + pose[5] * p[1] + pose[8] * p[2]
        mx, my, mz = m[0] + y * f[2] - z * f[1], m[1] + z * f[0] - x * f[2], m[2] + x * f[1] - y * f[0]
        for k in range(external.shape[0]):
            if pushes.moves[i, k]:
                c = push.first_twist + k
                external[k] += J[0, c] * f[0] + J[1, c] * f[1] + J[2, c] * f[2]
                external[k] += J[3, c] * mx + J[4, c] * my + J[5, c] * mz


def _check(push: Push) -> None:
    for name in ("force", "moment", "point"):
        value = getattr(push, name)
        numbers = as_numbers(value)
        if numbers is None or numbers.shape != (3,) or not np.all(np.isfinite(numbers)):
            raise ScenarioError(f"a push: {name} is {value!r}; give three finite numbers.", key=name, value=value)
    times = as_numbers([push.start, push.duration])
    if times is None or not (np.isfinite(times[0]) and times[1] > 0.0):
        span = f"start is {push.start!r} and duration {push.duration!r}"
        raise ScenarioError(f"a push: {span}; give times [s], and a duration above 0.", key="duration", value=span)
