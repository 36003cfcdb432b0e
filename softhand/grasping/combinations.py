"""Which places the fingers take together: those tried first whose force-closure margin could be the largest.

A bound of the margin, the least of `supports` over many directions, costs a thousandth of the margin itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softhand.grasping.margin import closure_margin, supports
from softhand.grasping.places import Place
from softhand.grasping.situation import Situation
from softhand.grasping.wrenches import Contacts
from softhand.numerics.arrays import Array

Choice = tuple[Place, ...]
"""One place a finger."""

_MOST = 30000  # combinations looked at
_DIRECTIONS = 400
_BATCH = 200  # combinations whose margin is found before the best of them are solved
_BATCHES = 5
_CLOSED = 1e-6  # margin of a grasp worth solving


@dataclass(frozen=True, eq=False)
class Combinations:
    """The places of all fingers.

    Attributes:
        here: hand and object.
        places: of each finger.
        lengths: tau_max / (mu f_z) of each tip [m].
        apart: least distance between two fingers [m].
    """

    here: Situation
    places: list[list[Place]]
    lengths: Array
    apart: float

    def best_first(self, rng: np.random.Generator) -> Iterator[tuple[float, Choice]]:
        """Share done and a combination, in batches of falling bounds, within each by falling margin."""
        chosen = self._drawn(rng)
        bounds = self._bounds(chosen)
        order = np.argsort(-bounds, kind="stable")
        order = order[bounds[order] > _CLOSED][: _BATCH * _BATCHES]
        for begin in range(0, len(order), _BATCH):
            batch: list[tuple[float, int, Choice]] = []
            for row in order[begin : begin + _BATCH]:
                choice = tuple(found[k] for found, k in zip(self.places, chosen[row], strict=True))
                margin = closure_margin(self.contacts(choice))
                if margin > _CLOSED:
                    batch.append((margin, len(batch), choice))
            batch.sort(key=lambda entry: (-entry[0], entry[1]))
            for k, (_, _, choice) in enumerate(batch):
                yield (begin + _BATCH * k / len(batch)) / len(order), choice

    def contacts(self, choice: Sequence[Place], fingers: Sequence[int] | None = None) -> Contacts:
        """Contacts in axes of the object, about its centre of mass; of the fingers in their order if not said."""
        who = list(range(len(choice)) if fingers is None else fingers)
        points, normals = (np.array([getattr(place, name) for place in choice]) for name in ("point", "normal"))
        return self.here.contacts(points, normals, self.lengths[who], who)

    def _drawn(self, rng: np.random.Generator) -> NDArray[np.int64]:
        """Indices of the places of each combination looked at whose fingers keep apart, shape (combinations, nc)."""
        sizes = [len(found) for found in self.places]
        total = math.prod(sizes)
        flat = np.arange(total) if total <= _MOST else np.unique(rng.integers(0, total, _MOST))
        chosen = np.array(np.unravel_index(flat, sizes)).T
        apart = np.ones(len(chosen), dtype=bool)
        for i in range(len(sizes)):
            for j in range(i + 1, len(sizes)):
                apart &= self._keep_apart(i, j)[chosen[:, i], chosen[:, j]]
        return chosen[apart]

    def _keep_apart(self, i: int, j: int) -> NDArray[np.bool_]:
        """Which places of two fingers keep these apart, shape (places of i, places of j)."""
        others = np.array([place.line for place in self.places[j]])
        base = float(np.linalg.norm(self.places[i][0].line[0] - others[0, 0]))
        least = min(self.apart, 0.99 * base)
        return np.array(
            [
                np.linalg.norm(place.line[None, :, None] - others[:, None], axis=3).min(axis=(1, 2)) >= least
                for place in self.places[i]
            ]
        )

    def _bounds(self, chosen: NDArray[np.int64]) -> Array:
        """Upper bounds of the margins: the least support over some directions of the space of wrenches."""
        directions = np.random.default_rng(0).normal(size=(_DIRECTIONS, 6))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        reached = [supports(self.contacts(found, [i] * len(found)), directions) for i, found in enumerate(self.places)]
        bounds = np.empty(len(chosen))
        for begin in range(0, len(chosen), 4096):
            rows = chosen[begin : begin + 4096]
            best = np.max([support[rows[:, i]] for i, support in enumerate(reached)], axis=0)
            bounds[begin : begin + 4096] = best.min(axis=1)
        return bounds
