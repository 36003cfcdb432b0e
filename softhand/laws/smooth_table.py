"""Columns of a table as smooth curves: uniform cubic splines that grow where the table does."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from softhand.numerics.arrays import Array

COEFFICIENTS = 20
"""Of one curve."""
_POINTS = 200  # at which a curve follows its column
_REPEATED = 20  # times that a row counts as much as a point between rows


def spline(t, a, b, c, e):
    """A cubic B-spline in its cell: value and first and second derivative by the cell, at t from 0 to 1."""
    u = 1.0 - t
    value = a * u * u * u + b * ((3.0 * t - 6.0) * t * t + 4.0) + c * ((3.0 * u - 6.0) * u * u + 4.0) + e * t * t * t
    slope = -a * u * u + b * (3.0 * t - 4.0) * t - c * (3.0 * u - 4.0) * u + e * t * t
    bend = a * u + b * (3.0 * t - 2.0) + c * (3.0 * u - 2.0) + e * t
    return value / 6.0, 0.5 * slope, bend


def work(t, a, b, c, e):
    """The integral of `spline` by t from 0."""
    u = 1.0 - t
    first = (1.0 - u**4) / 4.0
    second = 0.75 * t**4 - 2.0 * t**3 + 4.0 * t
    third = 2.75 - (0.75 * u**4 - 2.0 * u**3 + 4.0 * u)
    return (a * first + b * second + c * third + e * t**4 / 4.0) / 6.0


@lru_cache(64)
def fit(depths: tuple[float, ...], values: tuple[float, ...], grows: bool) -> tuple[float, ...]:
    """Coefficients of the curve over cells of the last depth / (COEFFICIENTS - 3); 0 at depth 0.

    A curve whose coefficients grow grows itself, so least squares over what they grow by, at least 0, keep it so.

    Args:
        depths: that grow, the last the end of the curve.
        values: of the column.
        grows: whether the curve grows; else it is positive.
    """
    from scipy.interpolate import PchipInterpolator
    from scipy.optimize import nnls

    rows = [(depth, value) for depth, value in zip(depths, values, strict=True) if depth > 0.0]
    powers = PchipInterpolator(*np.log(np.transpose(rows)))  # between rows a power of the depth
    x = np.concatenate([np.linspace(0.0, depths[-1], _POINTS + 1)[1:], np.repeat([d for d, _ in rows], _REPEATED)])
    wanted = np.exp(powers(np.log(x)))
    sizes = np.maximum(wanted, rows[0][1])
    # coefficients by what they grow by, or by themselves, so that (c_0 + 4 c_1 + c_2) / 6, the value at 0, is 0
    free = (np.tri(COEFFICIENTS) if grows else np.eye(COEFFICIENTS))[:, 1:]
    at_nothing = 4.0 * free[1] + free[2]
    if grows:
        free = free - at_nothing / 6.0
    else:
        free[0] = -at_nothing
    found, _ = nnls(_rows(x / depths[-1]) @ free / sizes[:, None], wanted / sizes)
    return tuple((free @ found).tolist())


def curve(coefficients: Sequence[float], shares: Array) -> Array:
    """The curve at shares of the last depth."""
    return _rows(shares) @ np.asarray(coefficients)


def _rows(shares: Array) -> Array:
    """The curve at shares of the last depth by its coefficients."""
    cells = COEFFICIENTS - 3
    rows = np.zeros((len(shares), COEFFICIENTS))
    for row, share in zip(rows, shares, strict=True):
        cell = min(int(share * cells), cells - 1)
        for k, unit in enumerate(np.eye(4)):
            row[cell + k] = spline(share * cells - cell, *unit)[0]
    return rows
