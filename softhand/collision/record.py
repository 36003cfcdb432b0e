"""Collisions as a result: which pairs, when, how deep, and what was not looked at."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from softhand.collision.pairs import AT_ZERO, Disregarded
from softhand.numerics.record import Record
from softhand.numerics.table import html_table
from softhand.recording.events import Event


@dataclass(frozen=True)
class Collision(Record):
    """Two things that are in one another for a while.

    Attributes:
        one: link, or `palm 1`.
        other: link, `object` or `table`.
        begin: of the first sample in which they are [s].
        end: of the last one [s].
        depth: the largest one, the shortest way that parts them [m].
        deepest: when that was [s].
    """

    units: ClassVar = {"begin": "s", "end": "s", "depth": "m", "deepest": "s"}

    one: str
    other: str
    begin: float
    end: float
    depth: float
    deepest: float

    @property
    def event(self) -> Event:
        """As an event of a run."""
        text = f"with {self.other}, until {self.end:.4g} s, at most {_mm(self.depth)} deep at {self.deepest:.4g} s"
        return Event(self.begin, "collision", self.one, text)


@dataclass(frozen=True)
class Collisions(Record):
    """All collisions of a run, or of the start of a scenario.

    Attributes:
        found: in the order of time.
        clearance: least distance of two that count [m]; minus the depth if they collide, infinite if none count.
        clearance_one: name of the one.
        clearance_other: name of the other.
        clearance_time: when that was [s].
        samples: that the recording has; 1 for a scenario.
        disregarded: pairs that do not count, and why.
        unseen: links of the hand without a shape that can be used.
        hulls: links whose meshes are taken as their convex hulls.
    """

    units: ClassVar = {"clearance": "m", "clearance_time": "s", "samples": "1"}
    header: ClassVar = ("pair", "from", "to", "depth", "deepest at")

    found: list[Collision]
    clearance: float
    clearance_one: str
    clearance_other: str
    clearance_time: float
    samples: int
    disregarded: list[Disregarded]
    unseen: list[str]
    hulls: list[str]

    def __repr__(self) -> str:
        return f"<Collisions: {self.short()}>"

    def _repr_html_(self) -> str:
        return html_table("Collisions", self.header, self.rows(), self.notes())

    def rows(self) -> list[tuple[str, ...]]:
        """Pair, begin, end, depth and its time of each collision."""
        return [
            (f"{c.one} - {c.other}", f"{c.begin:.4g} s", f"{c.end:.4g} s", _mm(c.depth), f"{c.deepest:.4g} s")
            for c in self.found
        ]

    def events(self) -> list[Event]:
        """One a collision, see `softhand.recording.events`."""
        return [collision.event for collision in self.found]

    def short(self) -> str:
        """In one line: the deepest collision and how many more there are, or the least clearance."""
        if self.found:
            worst = max(self.found, key=lambda c: c.depth)
            when = "" if self.samples == 1 else f", {worst.begin:.4g} to {worst.end:.4g} s"
            more = f"; {len(self.found) - 1} more" if len(self.found) > 1 else ""
            return f"{worst.one} is {_mm(worst.depth)} deep in {worst.other}{when}{more}"
        if math.isinf(self.clearance):
            return "none: no two shapes count"
        when = "" if self.samples == 1 else f" at {self.clearance_time:.4g} s"
        return f"none, least clearance {_mm(self.clearance)}{when} ({self.clearance_one} - {self.clearance_other})"

    def notes(self) -> list[str]:
        """What was not looked at, a sentence each."""
        return list(self._notes())

    def _notes(self) -> Iterator[str]:
        if self.unseen:
            yield f"not seen, as they have no such shape: {', '.join(self.unseen)}."
        at_zero = [f"{pair.one} - {pair.other}" for pair in self.disregarded if pair.reason == AT_ZERO]
        if at_zero:
            yield f"disregarded, as they overlap with all joints at zero: {', '.join(at_zero)}."
        if self.hulls:
            yield f"meshes as their convex hulls: {', '.join(self.hulls)}."


def _mm(length: float) -> str:
    return f"{1e3 * length:.3g} mm"
