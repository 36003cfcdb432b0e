"""From one waypoint to the next."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from softhand.numerics.compiled import compiled
from softhand.numerics.prepared import prepared
from softhand.references.goal import Goal
from softhand.references.reference import Motion, Reference
from softhand.references.straight import minimum_jerk
from softhand.references.waypoint import Waypoint, passed


@compiled
def _pass_waypoints(times, rows, changes, now, time):
    leg = 0
    while leg < changes.shape[0] - 1 and time >= times[leg + 1]:
        leg += 1
    minimum_jerk(times[leg + 1] - times[leg], rows[leg], changes[leg], now, time - times[leg])


class Waypoints(Reference):
    """From one waypoint to the next, each leg by minimum jerk from rest to rest; the last one is kept."""

    waypoints: Annotated[tuple[Waypoint, ...], Field(min_length=1)]
    """Waypoints, in the order of time."""

    def start(self, start: Goal) -> Motion:
        """The motion; its phases are the legs that have a name."""
        rows = np.array([goal.row() for goal in passed(start, self.waypoints)])
        times = np.cumsum([0.0, *(point.duration for point in self.waypoints)])
        now = np.zeros((3, rows.shape[1]))
        phases = tuple(
            (point.phase, round(float(begin), 9))
            for point, begin in zip(self.waypoints, times, strict=False)
            if point.phase
        )
        move = prepared(_pass_waypoints, times, rows[:-1].copy(), np.diff(rows, axis=0), now, varying=(0.0,))
        return Motion(now, move, phases, tuple(map(float, times[1:])))
