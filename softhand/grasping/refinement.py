"""A grasp made better: its contacts moved along the surface of the object as long as that raises the margin."""

from __future__ import annotations

import math

import numpy as np

from softhand.grasping.combinations import Choice, Combinations
from softhand.grasping.margin import supports
from softhand.grasping.places import Place, PlaceFinder
from softhand.grasping.wrenches import tangents
from softhand.numerics.arrays import Array

_FIRST, _LAST = 4e-3, 0.4e-3  # [m] steps of the search
_BETTER = 1.0005  # by which a step must raise the margin
_WAYS = 8  # in which each contact is moved alone
_TOGETHER = 12  # random ways in which all are moved at once: a margin has ridges


def refine(choice: Choice, combinations: Combinations, finder: PlaceFinder) -> Choice:
    """The best combination that a pattern search (Hooke, Jeeves 1961) comes to from one.

    A step along each way in turn as long as that helps, then half the step.

    Args:
        choice: where it starts.
        combinations: that it is one of.
        finder: of places beside its own.
    """
    search = _Search(choice, combinations, finder)
    count, step, rng = len(choice), _FIRST, np.random.default_rng(0)
    angles = 2.0 * math.pi * np.arange(_WAYS) / _WAYS
    alone = np.einsum("ij,ka->ikja", np.eye(count), np.column_stack([np.cos(angles), np.sin(angles)]))
    while step >= _LAST:
        together = rng.normal(size=(_TOGETHER, count, 2)) / math.sqrt(2.0)
        helped = [search.follow(step * way) for way in (*alone.reshape(-1, count, 2), *together)]
        if not any(helped):
            step *= 0.5
    return search.choice


class _Search:
    """The best combination so far, and what is known of those beside it."""

    def __init__(self, choice: Choice, combinations: Combinations, finder: PlaceFinder) -> None:
        self.choice, self._combinations, self._finder = choice, combinations, finder
        self._margin, worst = combinations.margin(choice)
        self._worst = [worst]  # what has been answered worst so far: it bounds the margins beside

    def follow(self, way: Array) -> bool:
        """Go one way as long as that helps, the contacts along their tangents [m], shape (nc, 2); whether it did."""
        helped = False
        while self._try(way):
            helped = True
        return helped

    def _try(self, way: Array) -> bool:
        """Take one step if it raises the margin and can be reached; whether it was taken."""
        beside = tuple(self._moved(place, step) for place, step in zip(self.choice, way, strict=True))
        reached = supports(self._combinations.sets(beside), np.array(self._worst))
        if np.min(np.max(reached, axis=0)) <= _BETTER * self._margin:
            return False
        found: list[Place] = []
        for i, (place, step) in enumerate(zip(beside, way, strict=True)):
            there = self._finder.place(i, place.point, place.normal, place.angles) if step.any() else place
            if there is None or not all(self._combinations.keep_apart(there, other) for other in found):
                return False
            found.append(there)
        margin, worst = self._combinations.margin(tuple(found), _BETTER * self._margin)
        self._worst.append(worst)
        if margin <= _BETTER * self._margin:
            return False
        self.choice, self._margin = tuple(found), margin
        return True

    def _moved(self, place: Place, step: Array) -> Place:
        """A place moved along the surface, its finger left behind."""
        if not step.any():
            return place
        first, second = tangents(place.normal)
        point, normal = self._finder.here.shape.nearest(place.point + step[0] * first + step[1] * second)
        return Place(point, normal, place.angles, place.line)
