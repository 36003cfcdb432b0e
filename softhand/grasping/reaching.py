"""Where to put the object so that every finger reaches it, before any contact point is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from softhand.assembly.plant import read_world
from softhand.errors import GraspError
from softhand.grasping.places import PlaceFinder
from softhand.grasping.situation import Situation, situation_of
from softhand.numerics.arrays import Array
from softhand.scenario.scenario import Scenario

_POINTS = 60  # of the surface that are tried
_WALKS = 8  # turns in which the object goes to the fingers
_FIRST, _LAST = 16e-3, 4e-3  # [m] steps of the search
_MOST = 60  # positions tried
_MISSED = 10e-3  # [m] that count as one finger which reaches nothing
_NEAR = 1e-4  # [m] from which a finger is tried in earnest
_ENOUGH = 0.25  # share of the surface


@dataclass(frozen=True, eq=False)
class ReachablePlace:
    """A position of the object that every finger reaches.

    Attributes:
        position: of the object frame [m], shape (3,).
        way: to it from where it was [m], shape (3,).
        counts: points of the surface that each finger reaches well.
        points: how many were tried.
    """

    position: Array
    way: Array
    counts: tuple[int, ...]
    points: int

    def __str__(self) -> str:
        x, y, z = 1e3 * self.way
        reached = ", ".join(map(str, self.counts))
        return (
            f"move the object by ({x:.3g}, {y:.3g}, {z:.3g}) mm of the base frame, to object.position = "
            f"{_told(self.position)}, where the fingers reach {reached} of {self.points} points"
        )


def reachable_place(here: Situation, progress: Callable[[float], None] | None = None) -> ReachablePlace:
    """Where each finger reaches a good share of the surface, near to where the object is; its turn is kept.

    The object first goes to the fingers that miss it, by the mean of their shortest ways. From there a pattern search
    (Hooke, Jeeves 1961) looks for where the finger that reaches least reaches most. On a table the object stays on it.

    Args:
        here: hand and object; no contact points are needed.
        progress: called now and then with the share done.

    Raises:
        GraspError: no such place was found; says how far the best one is from each finger.
    """
    search = _Search(here, progress or (lambda share: None))
    best = np.zeros(3)
    for _ in range(_WALKS):
        counts, ways = search.at(best)
        missing = [way for count, way in zip(counts, ways, strict=True) if not count and np.linalg.norm(way) > _NEAR]
        if not missing:
            break
        best = best + search.allowed(np.mean(missing, axis=0))
    step = _FIRST
    while step >= _LAST and len(search.tried) < _MOST and search.score(best) < _ENOUGH:
        before = search.score(best)
        for way in (*np.eye(3), *-np.eye(3)):
            ahead = best + search.allowed(step * way)
            if search.score(ahead) > search.score(best):
                best = ahead
        if search.score(best) <= before:
            step *= 0.5
    counts, ways = search.at(best)
    if not all(counts):
        gaps = ", ".join(
            f"{tip.name} {1e3 * np.linalg.norm(way):.3g} mm" if not count else f"{tip.name} none"
            for tip, count, way in zip(here.world.tips, counts, ways, strict=True)
        )
        raise GraspError(
            f"no place of the object was found that all fingers reach well; at the best one, "
            f"{np.round(1e3 * best, 1).tolist()} mm away, their ways to it are: {gaps}. Turn the object with "
            "object.rpy, give another grasp.joint_guess, or take a smaller object.",
            finger="", quantity="reach", value=0,
        )  # fmt: skip
    return ReachablePlace(here.position + best, best, counts, len(search.finder.surface))


@dataclass(frozen=True, eq=False)
class InReach:
    """A scenario with its object put where all fingers reach it."""

    scenario: Scenario
    place: ReachablePlace

    def rows(self) -> list[tuple[str, str]]:
        """Key and value of the place, with what is reached there."""
        reached = f"the fingers reach {', '.join(map(str, self.place.counts))} of {self.place.points} points"
        return [("object.position", f"{_told(self.scenario.object.position)}  # [m], {reached}")]


def place_in_reach(scenario: Scenario, progress: Callable[[float], None] | None = None) -> InReach:
    """The object of a scenario put at its `reachable_place`; raises as that."""
    found = reachable_place(situation_of(scenario, read_world(scenario)), progress)
    return InReach(scenario.with_values({"object.position": np.round(found.position, 4).tolist()}), found)


def _told(position: Array | tuple[float, ...]) -> str:
    return f"[{', '.join(f'{value:g}' for value in np.round(position, 4))}]"


class _Search:
    """What the fingers reach of the object at positions beside its own."""

    def __init__(self, here: Situation, report: Callable[[float], None]) -> None:
        self._here, self._report = here, report
        self.finder = PlaceFinder(here, _POINTS)
        self.tried: dict[tuple[float, ...], tuple[tuple[int, ...], tuple[Array, ...]]] = {}
        table = here.scenario.table
        normal = np.zeros(3) if table is None else np.array(table.normal) / np.linalg.norm(table.normal)
        self._along = np.eye(3) - np.outer(normal, normal)

    def allowed(self, way: Array) -> Array:
        """A way of the object as far as its table lets it go."""
        return np.asarray(self._along @ way)

    def at(self, offset: Array) -> tuple[tuple[int, ...], tuple[Array, ...]]:
        """How many points each finger reaches well, and the way by which the object misses it [m]."""
        key = tuple(np.round(offset, 6))
        if key not in self.tried:
            self.finder.here = replace(self._here, position=self._here.position + offset)
            fingers = range(self._here.world.n_tips)
            ways = tuple(self.finder.way(i) for i in fingers)
            counts = tuple(0 if np.linalg.norm(ways[i]) > _NEAR else len(self.finder.places(i)) for i in fingers)
            self.tried[key] = counts, ways
            self._report(min(len(self.tried) / _MOST, 1.0))
        return self.tried[key]

    def score(self, offset: Array) -> float:
        """The least share of the surface that a finger reaches; below 0, the less the nearer, if one has none."""
        counts, ways = self.at(offset)
        missed = [1.0 + np.linalg.norm(way) / _MISSED for count, way in zip(counts, ways, strict=True) if not count]
        return -float(sum(missed)) if missed else min(counts) / len(self.finder.surface)
