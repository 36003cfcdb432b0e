"""Keeping samples while a run goes on: one copy of each live array a sample, no allocation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from softhand.numerics.arrays import AnyArray


class Recorder:
    """Copies live arrays, row by row, into arrays allocated beforehand.

    `recorder[name]` holds the samples so far, shape (samples, *live.shape); it is a view, free to take at any time.

    Args:
        live: arrays that are updated in place while the run goes on: plain or structured, views too, 0-d to n-d.
        capacity: samples to allocate for; a sample more raises IndexError.
    """

    def __init__(self, live: Mapping[str, AnyArray], capacity: int) -> None:
        self._rows = {name: np.empty((capacity, *array.shape), array.dtype) for name, array in live.items()}
        self._copies = [(_as_bytes(self._rows[name]), _as_bytes(array)) for name, array in live.items()]
        self._count = 0

    def record(self) -> None:
        """Copy every live array into the next row."""
        count = self._count
        for rows, live in self._copies:
            rows[count] = live
        self._count = count + 1  # last, so that an interrupted sample does not count

    def clear(self) -> None:
        """Begin anew with the first row."""
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, name: str) -> AnyArray:
        return self._rows[name][: self._count]

    def variables(self) -> dict[str, AnyArray]:
        """All arrays by name, each with the samples recorded so far."""
        return {name: self[name] for name in self._rows}


def _as_bytes(array: AnyArray) -> AnyArray:
    """View a structured array as opaque elements: numpy copies these at once, not field by field."""
    return array if array.dtype.names is None else array.view(np.dtype((np.void, array.dtype.itemsize)))
