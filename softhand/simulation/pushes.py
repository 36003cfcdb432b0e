"""Pushes from outside: a wrench on the object or on a link, by schedule or by call."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from softhand.errors import ScenarioError
from softhand.numerics.arrays import Array, as_numbers
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
        self._schedule = [(push, _Place(plant, push)) for push in schedule]
        self._now: list[tuple[Push, _Place]] = []
        self.are_any = bool(schedule)

    def add(self, push: Push) -> None:
        """Another push, which `clear` ends."""
        self._now.append((push, _Place(self._plant, push)))
        self.are_any = True

    def clear(self) -> None:
        """End the pushes that were added."""
        self._now = []
        self.are_any = bool(self._schedule)

    def apply(self, time: float, q: Array) -> None:
        """Set the generalized force of the step that begins at a time [s], at a configuration, shape (nq,)."""
        external = self._plant.external
        external[:] = 0.0
        now = time + _ROUNDING
        active = [pair for pair in self._schedule if pair[0].start <= now < pair[0].start + pair[0].duration]
        if active or self._now:
            self._plant.snapshot.sense(q)
            for push, place in (*active, *self._now):
                place.add(push, external)


_ROUNDING = 1e-9  # [s]


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


class _Place:
    """The body that a push is on."""

    def __init__(self, plant: Plant, push: Push) -> None:
        _check(push)
        world = plant.world
        if push.on == OBJECT:
            self._joint, self._point = world.object_joint, np.asarray(push.point, dtype=float)
        else:
            self._joint, place = world.hand_frame(push.on)
            self._point = place.act(np.asarray(push.point, dtype=float))
        chain = list(world.model.supports[self._joint])[1:]
        joints = [world.model.joints[index] for index in chain]
        self._columns = [k for joint in joints for k in range(joint.idx_v, joint.idx_v + joint.nv)]
        self._snapshot = plant.snapshot

    def add(self, push: Push, external: Array) -> None:
        """external += J^T (force, moment) at the place of the body now."""
        pose, J = self._snapshot.poses[self._joint], self._snapshot.J[:, self._columns]
        arm = pose[9:] + pose[:9].reshape(3, 3).T @ self._point
        force, moment = np.asarray(push.force, dtype=float), np.asarray(push.moment, dtype=float)
        external[self._columns] += J[:3].T @ force + J[3:].T @ (moment + np.cross(arm, force))
