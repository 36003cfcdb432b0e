"""From one waypoint to the next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from softhand.numerics.compiled import compiled
from softhand.numerics.prepared import prepared
from softhand.references.reference import Reference, Waypoint
from softhand.references.straight import minimum_jerk


@compiled
def _pass_waypoints(times, rows, changes, now, time):
    leg = 0
    while leg < changes.shape[0] - 1 and time >= times[leg + 1]:
        leg += 1
    minimum_jerk(times[leg + 1] - times[leg], rows[leg], changes[leg], now, time - times[leg])


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
