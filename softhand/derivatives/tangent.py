"""Derivatives of parts in one compiled call, which is made anew where a part takes a way that is new."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from softhand.derivatives.assembling import Ways, note_near, ways_of
from softhand.derivatives.families import LARGEST, Family
from softhand.errors import SofthandError
from softhand.numerics.addressed import Addressed, addressed
from softhand.numerics.arrays import Array
from softhand.numerics.layouts import Layouts

_MOST_WAYS = 200


class NoTangentError(Exception):
    """What is asked for is not of the kind that can be followed."""


class Tangent:
    """Families of parts at work.

    Attributes:
        is_lost: whether a way could not be followed; there are no derivatives any more.

    Args:
        families: of all parts.
        D: derivatives of all numbers by all seeds, shape (rows, width).
        spans: which of the seeds each row may depend on: begin and end, shape (rows, 2).
        columns: of D or made from it, what is found.
        call_of: the compiled call for some ways, the address of their numbers, shape (1,), and what it is to set, to 1
            if it came to its end and to 0 where a way is missing, shape (1,).
    """

    def __init__(
        self,
        families: Sequence[Family],
        D: Array,
        spans: NDArray[np.int64],
        columns: Array,
        call_of: Callable[[Ways, NDArray[np.int64], NDArray[np.int64]], Addressed],
    ) -> None:
        self.is_lost = False
        self._families, self._D, self._spans, self._columns, self._call_of = families, D, spans, columns, call_of
        self._place, self._told = np.zeros((2, 1), np.int64)
        self._steps, self._near = np.zeros(columns.shape[1]), np.zeros(columns.shape[1], np.int64)
        self._note: Addressed | None = None
        self._prepare()

    def find(self) -> bool:
        """Compute the derivatives.

        Returns:
            False if a way cannot be followed, or a derivative is no number; then there are none.
        """
        for _ in range(0 if self.is_lost else _MOST_WAYS):
            self._call()
            if self._told[0]:
                return bool(np.isfinite(self._columns).all())
            try:
                self._follow()
            except SofthandError:
                raise
            except Exception:  # whatever a law or a shape does that cannot be followed
                self.is_lost = True
                return False
            self._prepare()
        return False

    def near(self, steps: Array, reach: float) -> NDArray[np.int64]:
        """Seeds that may cross a switch, in ascending order.

        Args:
            steps: of each seed.
            reach: how many of them count.
        """
        self._steps[:] = steps
        if self._note is None:
            own = self._ways, self._D, self._steps, reach, self._near
            self._note = addressed(note_near, *own, layouts=Layouts())
        self._note()
        return np.flatnonzero(self._near)

    def _follow(self) -> None:
        family, lanes = self._ways.missing.tolist()
        for lane in range(LARGEST):
            if lanes >> lane & 1:
                self._families[family].follow(lane)

    def _prepare(self) -> None:
        self._ways = ways_of(self._families, self._spans, self._D.shape[1])
        self._place[0] = self._ways.numbers.ctypes.data
        self._call, self._note = self._call_of(self._ways, self._place, self._told), None
