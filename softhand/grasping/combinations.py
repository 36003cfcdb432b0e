"""Which places the fingers take together: those with the largest force-closure margin first.

The margin is the least of h(d), see `margin`, so that h(d) in any direction bounds it from above, and costs next to
nothing. Where one combination is answered worst, most others are answered badly too: each direction that a margin is
found in bounds all combinations, until the best of those that are known is beyond the bounds of all that are not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softhand.grasping.margin import WrenchSets, supports, worst_wrench, wrench_sets
from softhand.grasping.materials import Torsion
from softhand.grasping.places import Place
from softhand.grasping.situation import Situation
from softhand.numerics.arrays import Array

Choice = tuple[Place, ...]
"""One place a finger."""

_MOST = 100_000  # combinations looked at
_MOST_MARGINS = 3000  # that are looked for
_CLOSED = 1e-6  # margin of a grasp worth solving


@dataclass(frozen=True, eq=False)
class Combinations:
    """The places of all fingers.

    Attributes:
        here: hand and object.
        places: of each finger.
        torsions: how each pressed tip holds against a spin.
        apart: least distance between two fingers [m].
    """

    here: Situation
    places: list[list[Place]]
    torsions: list[Torsion]
    apart: float

    def best_first(self, rng: np.random.Generator) -> Iterator[Choice]:
        """All combinations whose fingers keep apart, by falling margin; of very many, a random choice."""
        chosen = self._drawn(rng)
        sets = [self._sets(found, [i] * len(found)) for i, found in enumerate(self.places)]
        bounds, is_known = np.full(len(chosen), np.inf), np.zeros(len(chosen), bool)
        for _ in range(_MOST_MARGINS if len(chosen) else 0):
            best = int(np.argmax(bounds))
            if bounds[best] <= _CLOSED:
                return
            choice = tuple(own[k] for own, k in zip(self.places, chosen[best], strict=True))
            if is_known[best]:
                bounds[best] = 0.0
                yield choice
                continue
            enough = float(np.max(bounds[is_known], initial=0.0))  # beyond which it would come first
            margin, worst = self.margin(choice, enough)
            reached = [supports(own, worst[None])[:, 0][chosen[:, i]] for i, own in enumerate(sets)]
            np.minimum(bounds, np.max(reached, axis=0), out=bounds)
            bounds[best], is_known[best] = margin, margin >= enough

    def margin(self, choice: Choice, enough: float = 0.0) -> tuple[float, Array]:
        """Margin of a combination, and the wrench that it answers worst; see `worst_wrench`."""
        return worst_wrench(self.sets(choice), enough)

    def sets(self, choice: Choice) -> WrenchSets:
        """What its contacts can do."""
        return self._sets(choice, list(range(len(choice))))

    def _sets(self, places: Sequence[Place], fingers: list[int]) -> WrenchSets:
        points, normals = (np.array([getattr(place, name) for place in places]) for name in ("point", "normal"))
        return wrench_sets(self.here.contacts(points, normals, [self.torsions[i] for i in fingers], fingers))

    def _drawn(self, rng: np.random.Generator) -> NDArray[np.int64]:
        """Indices of the places of each combination looked at whose fingers keep apart, shape (combinations, nc)."""
        sizes = [len(found) for found in self.places]
        total = math.prod(sizes)
        flat = np.arange(total) if total <= _MOST else np.unique(rng.integers(0, total, _MOST))
        chosen = np.array(np.unravel_index(flat, sizes)).T
        apart = np.ones(len(chosen), dtype=bool)
        for i in range(len(sizes)):
            for j in range(i + 1, len(sizes)):
                others = self.places[j]
                clear = np.array([[self.keep_apart(one, other) for other in others] for one in self.places[i]])
                apart &= clear[chosen[:, i], chosen[:, j]]
        return chosen[apart]

    def keep_apart(self, one: Place, other: Place) -> bool:
        """Whether one finger at one place and another at another keep apart."""
        base = np.linalg.norm(one.line[0] - other.line[0])
        return bool(_between(one.line, other.line) >= min(self.apart, 0.99 * base))


def _between(one: Array, other: Array) -> float:
    """Least distance of two lines of points [m]."""
    return float(np.sqrt(np.min(np.sum((one[:, None] - other[None]) ** 2, axis=2))))
