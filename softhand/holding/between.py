"""Between directions whose edges are known: where a worse one is to be expected."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from softhand.holding.loads import directions
from softhand.numerics.arrays import Array

_FINE = 3  # level of the directions that are looked through: 642
_BESIDE = 3  # known directions that tell of one
_APART = 0.06  # [rad] between two that are tried


class Between:
    """Directions all over the sphere, and what the linear bound promises there.

    How far an edge is from the linear bound changes less from way to way than the edge itself: it is the mean of the
    nearest known directions, by 1 / angle^2.

    Args:
        bound: the linear bound along ways.
    """

    def __init__(self, bound: Callable[[Array], Array]) -> None:
        self._ways, self._bound = directions(_FINE), bound
        self._bounds = bound(self._ways)

    def promised(self, ways: Array, known: Array, edges: Array) -> Array:
        """The edges along ways, shape (ways,), by those along known directions, shapes (known, 3) and (known,)."""
        return _promised(self._bound(ways), ways, known, edges / self._bound(known))

    def worst(self, known: Array, edges: Array, below: float, most: int) -> Array:
        """Directions that promise less than a size, the least first, apart from each other and from those known.

        Args:
            known: directions, shape (known, 3).
            edges: along them, shape (known,).
            below: the size.
            most: of the directions.
        """
        promised = _promised(self._bounds, self._ways, known, edges / self._bound(known))
        far = np.max(self._ways @ known.T, axis=1) < np.cos(_APART)
        found: list[int] = []
        for k in np.argsort(promised).tolist():
            if promised[k] >= below or len(found) == most:
                break
            if far[k] and all(self._ways[k] @ self._ways[other] < np.cos(_APART) for other in found):
                found.append(k)
        chosen: Array = self._ways[found]
        return chosen


def _promised(bounds: Array, ways: Array, known: Array, ratio: Array) -> Array:
    angle = np.arccos(np.clip(ways @ known.T, -1.0, 1.0))
    near = np.argsort(angle, axis=1)[:, :_BESIDE]
    weight = 1.0 / (np.take_along_axis(angle, near, 1) ** 2 + 1e-6)
    found: Array = bounds * np.sum(weight * ratio[near], axis=1) / np.sum(weight, axis=1)
    return found
