"""What references ask for, as tables over time that runs share."""

from __future__ import annotations

from collections import OrderedDict
from threading import Lock
from typing import Any

import numpy as np

from softhand.numerics.arrays import Array
from softhand.references.goal import Goal
from softhand.references.reference import Motion, Reference

PERIODS = 500
"""Control periods in one table."""

_TABLES = 64  # kept


class Asked:
    """Tables of references: a row a control period, its time [s], then `Motion.now` and `Motion.twist` as they lie."""

    def __init__(self) -> None:
        self._tables: OrderedDict[Any, Array] = OrderedDict()
        self._lock = Lock()

    def rows(self, reference: Reference, start: Goal, motion: Motion, period: float, first: int, last: int) -> Array:
        """The rows of the control periods from `first` to `last`, both with them; at most `PERIODS`.

        Args:
            reference: which asks.
            start: where the run begins.
            motion: of both; asked for what is in no table yet.
            period: control period [s].
            first: period of the first row.
            last: of the last.
        """
        key = reference, tuple(start.row()), period, first, last
        with self._lock:
            if key in self._tables:
                self._tables.move_to_end(key)
                return self._tables[key]
        table = np.empty((last - first + 1, 1 + motion.now.size + motion.twist.size))
        now, twist = motion.now.reshape(-1), motion.twist.reshape(-1)
        for row, k in zip(table, range(first, last + 1), strict=True):
            row[0] = round(k * period, 12)
            motion.update(row[0])
            row[1 : 1 + now.size], row[1 + now.size :] = now, twist
        with self._lock:
            self._tables[key] = table
            if len(self._tables) > _TABLES:
                self._tables.popitem(last=False)
        return table
