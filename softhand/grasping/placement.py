"""Where to put the object: the position at which the fingers of a grasp have most room."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from softhand.assembly.parts import read_laws
from softhand.assembly.plant import read_world
from softhand.errors import GraspError
from softhand.grasping.chains import require_uncoupled
from softhand.grasping.quality import GraspQuality, quality_in
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.scenario.scenario import Scenario

_FIRST, _LAST = 8e-3, 0.5e-3  # [m] steps of the search
_MOST = 120  # positions tried


@dataclass(frozen=True, eq=False)
class Placement(Record):
    """A position that was found.

    Attributes:
        scenario: the one asked for, with the object there.
        quality: figures of its grasp.
        room: see `room`.
        room_before: that of the position asked for.
    """

    units: ClassVar = {"object_position": "m", "room": "1", "room_before": "1"}
    unreported: ClassVar = frozenset({"scenario"})

    scenario: Scenario
    quality: GraspQuality
    room: float
    room_before: float

    @property
    def object_position(self) -> Array:
        """Where the object is [m], shape (3,)."""
        return np.array(self.scenario.object.position)

    def rows(self) -> list[tuple[str, str]]:
        """Key and value of the place, with what was gained."""
        x, y, z = self.object_position
        return [
            ("object.position", f"[{x:g}, {y:g}, {z:g}]  # [m], room {self.room:.2f}, before {self.room_before:.2f}")
        ]


def place_object(scenario: Scenario, span: float = 0.04, progress: Callable[[float], None] | None = None) -> Placement:
    """Move the object, contact points and turn kept, to where `room` is largest near the position asked for.

    Pattern search (Hooke, Jeeves 1961): a step along each axis in turn as long as that helps, then half the step.

    Args:
        scenario: with the grasp in the axes of the object.
        span: farthest way from the position asked for [m].
        progress: called now and then with the share done.

    Raises:
        GraspError: no grasp at rest was found; it says what stood in the way at the best position. Or the joints of the
            hand are coupled.
    """
    world, start = read_world(scenario), np.array(scenario.object.position)
    require_uncoupled(world)
    tried: dict[tuple[float, ...], tuple[float, Scenario, GraspQuality]] = {}

    def at(offset: Array) -> float:
        key = tuple(np.round(offset, 9))
        if key not in tried:
            moved = scenario.with_values({"object.position": np.round(start + offset, 9).tolist()})
            quality = quality_in(world, moved)
            tried[key] = room(world, moved, quality), moved, quality
            if progress is not None:
                progress(min(len(tried) / _MOST, 1.0))
        return tried[key][0]

    best, step = np.zeros(3), _FIRST
    at(best)
    while step >= _LAST and len(tried) < _MOST:
        before = at(best)
        for way in (*np.eye(3), *-np.eye(3)):
            ahead = best + step * way
            if np.linalg.norm(ahead) <= span and at(ahead) > at(best):
                best = ahead
        if at(best) <= before:
            step *= 0.5
    if progress is not None:
        progress(1.0)
    found, moved, quality = tried[tuple(np.round(best, 9))]
    if quality.refusal is not None:
        raise GraspError(
            f"within {1e3 * span:g} mm of object.position there is no place where the grasp is at rest; "
            f"at the best one: {quality.refusal}",
            finger="", quantity="room", value=found,
        )  # fmt: skip
    return Placement(moved, quality, found, at(np.zeros(3)))


def room(world: World, scenario: Scenario, quality: GraspQuality) -> float:
    """The least share in which anything of a grasp is free [1]; below 0 without a grasp at rest, the less the nearer.

    Of each joint the distance to the nearer limit over half its range, and 1 less its share of the effort limit; of
    each contact Phi between rim and apex, 1 in the middle. For a law in surface coordinates the apex is no border, so
    that Phi counts from the rim alone. The use of friction is the same at all places.
    """
    missing = max(finger.missing for finger in quality.fingers)
    if quality.refusal is not None:
        return -1.0 - missing / 0.01
    lower, upper = world.position_limits
    free = []
    for tip, finger, law in zip(world.tips, quality.fingers, read_laws(scenario), strict=True):
        columns = list(tip.columns)
        free.append(1.0 - float(finger.torque_use.max()))
        free.append(float(np.min(2.0 * finger.reserve / (upper - lower)[columns], initial=1.0)))
        border = finger.Phi if law.coordinates == "surface" else min(finger.Phi, 0.5 * math.pi - finger.Phi)
        free.append(min(border / (0.25 * math.pi), 1.0))
    return float(min(free))
