"""Derivatives of what may have kinks: extrapolated differences that stay on the side of each switch the state is on.

    f' = (4 D(h / 2) - D(h)) / 3,   D(h) = (f(h) - f(-h)) / 2 h

and where one of the two ways crosses a switch, the slope of a polynomial through six points the other way. Where D
changes much from h to h / 2, as where a tip hardly moves over what it slips on, h is shortened.
"""

from __future__ import annotations

from collections.abc import Callable
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.arrays import Array

Function = Callable[[NDArray[np.int64], Array], tuple[Array, NDArray[np.int64]]]
"""Entries, -1 for none, and by how much each is moved; values and sides of the switches, a row each.

A side is made of bits. Where the first differs, which tells touch, the others mean nothing.
"""

_BOTH = np.array([1.0, -1.0, 0.5, -0.5])
_ONE = np.arange(1, 7) / 6.0
_SHORTER, _TIMES = 0.25, 5
"""How a step is shortened, and how often at most."""
_CHANGE = 3e-7
"""How much of the largest of its row D may change from h to h / 2: what is left is of its square."""
_LEFT = 1e-9
"""How much the last point may change one-sided derivatives, likewise."""

_ROUNDING = 1e-11
"""Of a value, over the step: a row whose largest derivative is less has rounding alone."""


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
    change = (sides ^ here).reshape(-1, len(here))
    crossed = np.bitwise_or.reduce(np.where(change & 1, 1, change), axis=0, initial=0)
    same = _same(values, sides, here)
    rows, changes = _central(values, steps[:, None])
    smooth = same.all(axis=1)
    scale = np.max(np.abs(rows[smooth if smooth.any() else np.isfinite(rows).all(axis=1)]), axis=0, initial=0.0)
    scale = np.maximum(scale, _ROUNDING * np.maximum(np.abs(at), 1e-100) / np.min(steps))
    doubt = np.max(np.abs(changes) / scale, axis=1, initial=0.0)
    for j in np.flatnonzero(~(smooth & (doubt < _CHANGE))):
        rows[j] = _along(function, int(j), float(steps[j]), at, here, scale)
    return Slopes(rows.T.copy(), crossed)


def _along(function: Function, entry: int, step: float, at: Array, here: NDArray[np.int64], scale: Array) -> Array:
    """Along one entry that crosses a switch, or is curved: the best of some shorter steps."""
    best, least = np.full_like(at, np.nan), np.inf
    for _ in range(_TIMES):
        values, sides = function(np.full(4, entry), step * _BOTH)
        same = _same(values, sides, here)
        found, left = best, np.inf
        if same.all():
            found, change = _central(values, np.array(step))
            left = float(np.max(np.abs(change) / scale, initial=0.0))
            left *= left
        elif same[[0, 2]].all() or same[[1, 3]].all():
            h = step if same[[0, 2]].all() else -step
            values, sides = function(np.full(len(_ONE), entry), h * _ONE)
            if _same(values, sides, here).all():
                found, change = _outward(values, at, h)
                left = float(np.max(np.abs(change) / scale, initial=0.0))
        if left < least:
            best, least = found, left
        if least < (_CHANGE**2 if same.all() else _LEFT):
            break
        step *= _SHORTER
    return best


def _same(values: Array, sides: NDArray[np.int64], here: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which moves end on the side that the state is on."""
    same: NDArray[np.bool_] = np.all(sides == here, axis=-1) & np.all(np.isfinite(values), axis=-1)
    return same


def _central(values: Array, step: Array) -> tuple[Array, Array]:
    """From f at h, -h, h / 2, -h / 2 along the axis before the last; and D(h / 2) - D(h)."""
    wide = (values[..., 0, :] - values[..., 1, :]) / (2.0 * step)
    narrow = (values[..., 2, :] - values[..., 3, :]) / step
    return (4.0 * narrow - wide) / 3.0, narrow - wide


def _outward(values: Array, at: Array, step: float) -> tuple[Array, Array]:
    """From f at h / 6, 2 h / 6, ... h, and at 0: the slope at 0 of the polynomial through all; and its last term.

    f'(0) = (1 / d) sum_k (-1)^(k + 1) C(n, k) / k (f(k d) - f(0)),   d = h / 6, n = 6, or 5 without the last point
    """
    rises = (values - at) * len(values) / step
    whole, less = (np.tensordot(_weights(n), rises[:n], axes=1) for n in (len(values), len(values) - 1))
    return whole, whole - less


def _weights(n: int) -> Array:
    return np.array([(-1.0) ** (k + 1) * comb(n, k) / k for k in range(1, n + 1)])
