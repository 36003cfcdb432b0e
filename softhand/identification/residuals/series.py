"""Series: rows that were measured in one go, along which one imposed quantity changes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softhand.identification.record import Measurements
from softhand.numerics.arrays import Array

_SAME_ANGLE = np.radians(0.5)
_SAME_DEPTH = 0.01  # of the largest dr
_TURNS = 3  # rows for each turn of a loop, at least
_ORDERED = 2.5  # different settings in a series, from which the order of the rows is taken for that of the experiment


def find_series(measurements: Measurements) -> NDArray[np.int64]:
    """Number of the series of each row, shape (n,).

    Series are what the file says. Otherwise a series goes on for as long as the same components are measured and only
    one imposed quantity changes. Where that makes none to speak of, as in an experiment whose rows were shuffled, all
    rows with one contact angle phi are a series.
    """
    if measurements.has_series:
        return _numbered(measurements.runs[:, None])
    kind = np.isfinite(measurements.force) @ np.array([1, 2, 4, 8])
    where = np.column_stack([measurements.runs, kind])
    imposed = measurements.imposed
    tolerance = np.array([_SAME_DEPTH * max(imposed[:, 0].max(initial=0.0), 1e-9), *[_SAME_ANGLE] * 4])
    series = _follow(where, imposed, tolerance)
    settings = np.unique(np.column_stack([series, measurements.settings]), axis=0)
    if len(settings) >= _ORDERED * (series.max(initial=0) + 1):
        return series
    return _numbered(np.column_stack([where, _groups(measurements.phi, _SAME_ANGLE)]))


def find_directions(measurements: Measurements, series: NDArray[np.int64]) -> NDArray[np.int64]:
    """1 where the deformation grows along a series, -1 where it falls back, shape (n,).

    0 where that is not known, and in series that turn so often that they are no loops.
    """
    size = np.abs(measurements.deformation)
    reach = size.max(axis=0, initial=0.0)
    step = np.diff(size / np.where(reach > 0.0, reach, 1.0), axis=0)
    step[series[1:] != series[:-1]] = 0.0
    varied = np.argmax(np.abs(step), axis=1) if len(step) else np.zeros(0, dtype=np.int64)
    sign = np.sign(np.take_along_axis(step, varied[:, None], axis=1)[:, 0]) if len(step) else np.zeros(0)
    direction = np.zeros(len(series), dtype=np.int64)
    direction[1:] = sign
    starts = np.flatnonzero(np.diff(series, prepend=-1))
    for first, last in zip(starts, [*starts[1:], len(series)], strict=True):
        known = np.flatnonzero(direction[first:last])
        if known.size:  # repeats of a setting go on in the direction in which it was reached
            held = np.maximum.accumulate(np.where(direction[first:last] != 0, np.arange(last - first), 0))
            direction[first:last] = direction[first:last][held]
            direction[first : first + known[0]] = direction[first + known[0]]
        if _TURNS * np.count_nonzero(np.diff(direction[first:last])) > last - first:
            direction[first:last] = 0
    return direction


def _follow(where: NDArray[np.int64], imposed: Array, tolerance: Array) -> NDArray[np.int64]:
    """Series in the order of the rows."""
    series = np.zeros(len(where), dtype=np.int64)
    first, varied = 0, -1
    for k in range(1, len(where)):
        moved = np.flatnonzero(np.abs(imposed[k] - imposed[first]) > tolerance)
        goes_on = np.array_equal(where[k], where[first]) and moved.size <= 1
        if goes_on and moved.size and varied in (-1, moved[0]):
            varied = int(moved[0])
        elif not goes_on or moved.size:
            first, varied = k, -1
        series[k] = series[k - 1] + (first == k)
    return series


def _groups(values: Array, apart: float) -> NDArray[np.int64]:
    """Numbers of groups of values between which there is a gap, shape (n,)."""
    order = np.argsort(values, kind="stable")
    found = np.empty(len(values), dtype=np.int64)
    found[order] = np.cumsum(np.diff(values[order], prepend=values[order[:1]]) > apart)
    return found


def _numbered(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.unique(keys, axis=0, return_inverse=True)[1].ravel()
