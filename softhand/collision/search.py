"""Where solids collide along states: every so many samples, then begin, end and depth between these."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from softhand.collision.distances import TOUCH, Boxes, distance
from softhand.collision.solids import Solid
from softhand.numerics.arrays import Array

Pair = tuple[Solid, Solid]
Poses = Callable[[NDArray[np.int64]], tuple[Array, Array]]
"""Axes and origins of all bodies in samples, see `Kinematics.poses`."""

_AT_ONCE = 1000  # samples whose boxes are held in memory


@dataclass(frozen=True)
class Spell:
    """Samples in which two names collide without a break, the deepest one, and the depth there [m]."""

    names: tuple[str, str]
    first: int
    last: int
    deepest: int
    depth: float


@dataclass
class Found:
    """What a search finds: spells of collision, and the least distance of all with its names and sample."""

    spells: list[Spell] = field(default_factory=list)
    clearance: float = np.inf
    names: tuple[str, str] = ("", "")
    sample: int = 0


class Search:
    """Distances of pairs of solids in samples.

    Args:
        pairs: that may collide.
        poses: of the bodies.
        count: of all samples.
    """

    def __init__(self, pairs: Sequence[Pair], poses: Poses, count: int) -> None:
        self._pairs, self._poses, self._count = pairs, poses, count
        self._by_names: dict[tuple[str, str], list[Pair]] = {}
        for pair in pairs:
            self._by_names.setdefault((pair[0].name, pair[1].name), []).append(pair)
        self._known: dict[int, tuple[Array, Array]] = {}

    def run(self, stride: int) -> Found:
        """Every `stride`-th sample and the last one, then what lies between."""
        coarse = np.unique(np.append(np.arange(0, self._count, stride), self._count - 1))
        found, depths = Found(), dict[tuple[str, str], Array]()
        for begin in range(0, len(coarse), _AT_ONCE):
            self._look(coarse, slice(begin, begin + _AT_ONCE), found, depths)
        for names, depth in depths.items():
            hits = np.flatnonzero(depth > TOUCH)
            for part in np.split(hits, np.flatnonzero(np.diff(hits) > 1) + 1):
                found.spells.append(self._spell(names, coarse, part, depth))
        for spell in found.spells:
            if -spell.depth < found.clearance:
                found.clearance, found.names, found.sample = -spell.depth, spell.names, spell.deepest
        return found

    def _look(self, coarse: NDArray[np.int64], part: slice, found: Found, depths: dict[tuple[str, str], Array]) -> None:
        """The depths of all pairs whose boxes meet in some samples, and the least distance of the others."""
        samples = coarse[part]
        R, p = self._poses(samples)
        solids = dict.fromkeys(solid for pair in self._pairs for solid in pair)
        boxes = Boxes(list(solids), R, p)
        least = np.array([boxes.least(a, b) for a, b in self._pairs])
        for i, k in np.argwhere(least <= 0.0).tolist():
            a, b = self._pairs[i]
            value = distance(a, b, R[k], p[k])
            self._keep(value, (a, b), int(samples[k]), found)
            if value < -TOUCH:
                row = depths.setdefault((a.name, b.name), np.zeros(len(coarse)))
                row[part.start + k] = max(row[part.start + k], -value)
        for flat in np.argsort(least, axis=None).tolist():
            i, k = divmod(flat, len(samples))
            if least[i, k] <= 0.0:
                continue
            if least[i, k] >= found.clearance:
                break
            a, b = self._pairs[i]
            self._keep(distance(a, b, R[k], p[k]), (a, b), int(samples[k]), found)

    def _keep(self, value: float, pair: Pair, sample: int, found: Found) -> None:
        if value < found.clearance:
            found.clearance, found.names, found.sample = value, (pair[0].name, pair[1].name), sample

    def _spell(self, names: tuple[str, str], coarse: NDArray[np.int64], part: NDArray[np.int64], depth: Array) -> Spell:
        """Begin and end by bisection between two samples that were looked at, the deepest one among its neighbours."""
        before, after = int(part[0]) - 1, int(part[-1]) + 1
        first, last = int(coarse[part[0]]), int(coarse[part[-1]])
        if before >= 0:
            first = self._edge(names, int(coarse[before]), first)
        if after < len(coarse):
            last = self._edge(names, int(coarse[after]), last)
        k = int(part[np.argmax(depth[part])])
        near = range(max(int(coarse[max(k - 1, 0)]), first), min(int(coarse[min(k + 1, len(coarse) - 1)]), last) + 1)
        deepest = max(near, key=lambda sample: self._depth(names, sample))
        return Spell(names, first, last, deepest, self._depth(names, deepest))

    def _edge(self, names: tuple[str, str], free: int, hit: int) -> int:
        """The sample next to a free one that collides."""
        while abs(hit - free) > 1:
            middle = (hit + free) // 2
            if self._depth(names, middle) > TOUCH:
                hit = middle
            else:
                free = middle
        return hit

    def _depth(self, names: tuple[str, str], sample: int) -> float:
        if sample not in self._known:
            R, p = self._poses(np.array([sample]))
            self._known[sample] = R[0], p[0]
        return max(-distance(a, b, *self._known[sample]) for a, b in self._by_names[names])
