"""From one waypoint to the next."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from softhand.numerics.compiled import compiled
from softhand.references.goal import Goal
from softhand.references.legs import OrientationPath, legs_between
from softhand.references.reference import Motion, Reference, motion_along
from softhand.references.straight import minimum_jerk
from softhand.references.waypoint import Waypoint, passed


@compiled
def _pass_waypoints(legs, now, twist, time):
    leg = 0
    while leg < legs.rows.shape[0] - 1 and time >= legs.times[leg + 1]:
        leg += 1
    minimum_jerk(legs, leg, now, twist, time)


class Waypoints(Reference):
    """From one waypoint to the next, each leg by minimum jerk from rest to rest; the last one is kept."""

    waypoints: Annotated[tuple[Waypoint, ...], Field(min_length=1)]
    """Waypoints, in the order of time."""
    orientation_path: OrientationPath = "geodesic"
    """`geodesic`: about one axis; `euler`: roll, pitch and yaw one by one."""

    def start(self, start: Goal) -> Motion:
        """The motion; its phases are the legs that have a name."""
        durations = [point.duration for point in self.waypoints]
        legs = legs_between(passed(start, self.waypoints), durations, self.orientation_path)
        phases = tuple(
            (point.phase, round(float(begin), 9))
            for point, begin in zip(self.waypoints, legs.times, strict=False)
            if point.phase
        )
        return motion_along(legs, _pass_waypoints, phases, tuple(map(float, legs.times[1:])))
