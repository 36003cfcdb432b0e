"""Derivatives of what may have kinks: extrapolated differences that stay on the side of each switch the state is on.

    f' = (4 D(h / 2) - D(h)) / 3,   D(h) = (f(h) - f(-h)) / 2 h

Where one of the two ways crosses a switch, or D changes much from h to h / 2, as where a tip hardly moves over what it
slips on, the slope of a polynomial through more points is taken, to both sides or to one, at the best of some steps.
"""

from __future__ import annotations

from collections.abc import Callable
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.arrays import Array

Function = Callable[[NDArray[np.int64], Array, Array], tuple[Array, NDArray[np.int64]]]
"""Entries, -1 for none, by how much each is moved, and what share of their shear all tips that may slip let go at the
same time; values and sides of the switches, a row each.

A side is made of bits. Where the first differs, which tells touch, the others mean nothing.
"""

_BOTH = np.array([1.0, -1.0, 0.5, -0.5])
_POINTS = 6
"""To each side, of the polynomials."""
_SHORTER, _TIMES = 0.25, 5
"""How a step is shortened, and how often at most."""
_CHANGE = 3e-7
"""How much of the largest of its row D may change from h to h / 2."""
_LEFT = 1e-9
"""How much the outermost points may do to the slope of a polynomial, likewise, for no shorter step to be tried."""
_SHEAR = 2e-3
"""Share of the shear of tips that they let go while an entry goes a step."""
_ROUNDING, _NOTHING = 1e-11, 1e-12
"""Of a value over the step, and of the largest derivative of all: rows that have less have rounding alone."""


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
    values, sides = function(index, np.concatenate([[0.0], np.outer(steps, _BOTH).ravel()]), np.zeros(len(index)))
    at, here = values[0], sides[0]
    values, sides = values[1:].reshape(k, 4, -1), sides[1:].reshape(k, 4, -1)
    crossed = crossed_in(sides.reshape(-1, len(here)), here)
    same = _same(values, sides, here)
    rows, changes = _central(values, steps[:, None])
    smooth = same.all(axis=1)
    scale = np.max(np.abs(rows[smooth if smooth.any() else np.isfinite(rows).all(axis=1)]), axis=0, initial=0.0)
    scale = np.maximum(
        scale, np.maximum(_NOTHING * np.max(scale, initial=1e-100), _ROUNDING * np.abs(at) / np.min(steps))
    )
    doubt = np.max(np.abs(changes) / scale, axis=1, initial=0.0)
    for j in np.flatnonzero(~(smooth & (doubt < _CHANGE))):
        rows[j] = _along(function, int(j), float(steps[j]), at, here, scale)
    return Slopes(rows.T.copy(), crossed)


def crossed_in(sides: NDArray[np.int64], here: NDArray[np.int64]) -> NDArray[np.int64]:
    """`Slopes.crossed` from the sides of some moves, shape (moves, sides), and those of the state, shape (sides,)."""
    change = sides ^ here
    found: NDArray[np.int64] = np.bitwise_or.reduce(np.where(change & 1, 1, change), axis=0, initial=0)
    return found


def _along(function: Function, entry: int, step: float, at: Array, here: NDArray[np.int64], scale: Array) -> Array:
    """Along one entry that crosses a switch, or is curved: that which depends least on its outermost points."""
    best, least, longest = np.full_like(at, np.nan), np.inf, step
    ways = np.arange(1, _POINTS + 1) / _POINTS
    for _ in range(_TIMES):
        values, sides = function(
            np.full(2 * _POINTS, entry), step * np.concatenate([ways, -ways]), np.zeros(2 * _POINTS)
        )
        same = _same(values, sides, here)
        ahead, behind = ((values[side] - at) * _POINTS / step for side in (slice(_POINTS), slice(_POINTS, None)))
        found = [(ahead - behind, _CENTRAL)] if same.all() else []
        found += [(ahead, _OUTWARD)] if same[:_POINTS].all() else []
        found += [(-behind, _OUTWARD)] if same[_POINTS:].all() else []
        for rises, weights in found:
            slope, less = weights @ rises
            left = float(np.max(np.abs(slope - less) / scale, initial=0.0))
            if left < least:
                best, least = slope, left
        if least < _LEFT:
            break
        step *= _SHORTER
    return best if least < np.inf else _aslant(function, entry, longest, at, here, scale)


def _aslant(function: Function, entry: int, step: float, at: Array, here: NDArray[np.int64], scale: Array) -> Array:
    """Along one entry that crosses a switch either way, as where two tips slip and one of them gets more to hold.

    All tips let go, or take, some shear on the way, so that the way stays on the side that the state is on. There the
    function is smooth, so what they do by themselves can be taken off: f' = f'(entry + shear) - f'(shear).
    """
    best, least = np.full_like(at, np.nan), np.inf
    ways = np.arange(1, _POINTS + 1) / _POINTS
    nothing = np.full(_POINTS, -1)
    for shorter in (1.0, 0.25, 0.0625):
        for share in (_SHEAR * shorter * more * sign for more in (0.1, 1.0, 10.0) for sign in (1.0, -1.0)):
            alone, alone_sides = function(nothing, np.zeros(_POINTS), share * ways)
            if not _same(alone, alone_sides, here).all():
                continue
            for h in (shorter * step, -shorter * step):
                values, sides = function(np.full(_POINTS, entry), h * ways, share * ways)
                if _same(values, sides, here).all():
                    slope, less = _OUTWARD @ ((values - alone) * _POINTS / h)
                    left = float(np.max(np.abs(slope - less) / scale, initial=0.0))
                    if left < least:
                        best, least = slope, left
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


def _weights(weight: Callable[[int, int], float]) -> Array:
    """Of the rises at d, 2 d, ... in the slope at 0 of the polynomial through all, or through all but the outermost."""
    return np.array([[weight(n, k) if k <= n else 0.0 for k in range(1, _POINTS + 1)] for n in (_POINTS, _POINTS - 1)])


_OUTWARD = _weights(lambda n, k: (-1.0) ** (k + 1) * comb(n, k) / k)
_CENTRAL = _weights(lambda n, k: (-1.0) ** (k + 1) * comb(2 * n, n - k) / comb(2 * n, n) / k)
