"""Derivatives of what may have kinks: extrapolated differences that stay on the side of each switch the state is on.

    f' = (4 D(h / 2) - D(h)) / 3,   D(h) = (f(h) - f(-h)) / 2 h

and where one of the two ways crosses a switch, three extrapolations of D(h) = (f(h) - f(0)) / h the other way.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.arrays import Array

Function = Callable[[NDArray[np.int64], Array], tuple[Array, NDArray[np.int64]]]
"""Entries, -1 for none, and by how much each is moved; values and sides of the switches, a row each.

A side is made of bits. Where the first differs, which tells touch, the others mean nothing.
"""

_BOTH = np.array([1.0, -1.0, 0.5, -0.5])
_ONE = np.array([1.0, 0.5, 0.25, 0.125])
_SMALLER, _TIMES = 0.125, 4
"""How a step shrinks that crosses switches both ways, and how often at most."""


class Slopes(NamedTuple):
    """Derivatives of a function, a column an entry.

    `crossed` has the bits of the sides that differ a step away, for each switch any of them, shape (sides,).
    """

    columns: Array
    crossed: NDArray[np.int64]


def slopes(function: Function, steps: Array) -> Slopes:
    """Derivatives along each entry.

    Args:
        function: as `Function`.
        steps: h of each entry, in its unit; NaN values count as beyond a switch, shape (k,).
    """
    k = len(steps)
    index = np.concatenate([[-1], np.repeat(np.arange(k), 4)]).astype(np.int64)
    values, sides = function(index, np.concatenate([[0.0], np.outer(steps, _BOTH).ravel()]))
    at, here = values[0], sides[0]
    values, sides = values[1:].reshape(k, 4, -1), sides[1:].reshape(k, 4, -1)
    same = np.all(sides == here, axis=2) & np.all(np.isfinite(values), axis=2)
    columns = _central(values, steps[:, None]).T.copy()
    change = (sides ^ here).reshape(-1, len(here))
    crossed = np.bitwise_or.reduce(np.where(change & 1, 1, change), axis=0, initial=0)
    for j in np.flatnonzero(~np.all(same, axis=1)):
        columns[:, j] = _on_one_side(function, int(j), steps[j], at, here, same[j])
    return Slopes(columns, crossed)


def _central(values: Array, step: Array) -> Array:
    """From f at h, -h, h / 2, -h / 2 along the axis before the last."""
    wide = (values[..., 0, :] - values[..., 1, :]) / (2.0 * step)
    narrow = (values[..., 2, :] - values[..., 3, :]) / step
    slope: Array = (4.0 * narrow - wide) / 3.0
    return slope


def _on_one_side(function: Function, entry: int, step: float, at: Array, here: Array, same: NDArray[np.bool_]) -> Array:
    """Along one entry, where at least one of the four places of `_BOTH` is beyond a switch."""
    for _ in range(_TIMES):
        ways = [way for way, near, far in ((1.0, 0, 2), (-1.0, 1, 3)) if same[near] and same[far]]
        if len(ways) == 2:
            values, _ = function(np.full(4, entry), step * _BOTH)
            return _central(values, np.array(step))
        if ways:
            h = ways[0] * step
            values, sides = function(np.full(4, entry), h * _ONE)
            if np.all(sides == here):
                return _outward(values, at, h)
        step *= _SMALLER
        values, sides = function(np.full(4, entry), step * _BOTH)
        same = np.all(sides == here, axis=1) & np.all(np.isfinite(values), axis=1)
    return _central(values, np.array(step))


def _outward(values: Array, at: Array, step: float) -> Array:
    """From f at h, h / 2, h / 4, h / 8, and at 0."""
    table = [(value - at) / (step * share) for value, share in zip(values, _ONE, strict=True)]
    for order in (1, 2, 3):
        table = [(2.0**order * b - a) / (2.0**order - 1.0) for a, b in pairwise(table)]
    return table[0]
