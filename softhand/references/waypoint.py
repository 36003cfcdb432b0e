"""Places that a reference passes at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import Field

from softhand.references.goal import Goal
from softhand.settings.settings import Positive, Settings, Vector, Vector3


class Waypoint(Settings):
    """One waypoint. What is not given stays as it was at the waypoint before, or at the start."""

    phase: str = ""
    """Name of the way there, for figures and events."""
    duration: Positive
    """Duration of the way there [s]."""
    object_position: Vector3 | None = None
    """Position of the object in the base frame [m]."""
    object_rpy: Vector3 | None = None
    """Roll, pitch, yaw of the object [rad]."""
    internal_force: Vector | None = None
    """Internal force, in the order of grasp.internal_force [N]."""
    opening: float | None = None
    """How far the tips stand off their contact points [m]; below 0 they press."""
    carried: Annotated[float, Field(ge=0, le=1)] | None = None
    """Share of the object's weight that the fingers carry [1]; the table has the rest."""
    standoff: Vector3 | None = None
    """Where the palm is, from its place at the object, in the base frame [m]; of a hand on an arm."""


def passed(start: Goal, waypoints: Sequence[Waypoint]) -> list[Goal]:
    """The start and what is asked for at each waypoint."""
    goals = [start]
    for point in waypoints:
        before = goals[-1]
        position, rpy = np.split(before.coordinates, 2)
        coordinates = (*(point.object_position or position), *(point.object_rpy or rpy))
        others = {key: getattr(point, key) for key in ("internal_force", "opening", "carried", "standoff")}
        given = {key: value for key, value in others.items() if value is not None}
        goals.append(replace(before, coordinates=coordinates, **given))
    return goals
