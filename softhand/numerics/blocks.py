"""Arrays of symbols: what a kernel is given when it runs on symbols in place of numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from softhand.numerics.arrays import AnyArray
from softhand.numerics.symbols import REAL, SMALL, WHOLE, Place, Sums, Symbol

_KINDS = {"f8": REAL, "i8": WHOLE, "i1": SMALL, "b1": SMALL}
LARGEST_COUNT = 1 << 24
"""Whole numbers beyond are addresses."""


class Count(int):
    """A whole number that belongs to the structure; where it is an address, `at` is the number that a run knows."""

    at: Symbol


class Block:
    """An array, or a view of one.

    Attributes:
        sums: what is done with it is written down there.
        memory: number of the memory that it lies in; negative if it is a kernel's own.
        fixed: the array itself, if its whole numbers, zeros and ones belong to the structure.
    """

    def __init__(
        self, sums: Sums, memory: int, begin: int, dtype: Any, shape: Any, strides: Any, fixed: AnyArray | None
    ) -> None:
        self.sums, self.memory, self.begin, self.dtype = sums, memory, begin, dtype
        self.shape, self.strides, self.fixed = tuple(shape), tuple(strides), fixed

    def __len__(self) -> int:
        return int(self.shape[0])

    def __iter__(self) -> Iterator[Any]:
        return (self[i] for i in range(self.shape[0]))

    def __getitem__(self, index: Any) -> Any:
        begin, shape, strides = self._view(index)
        return _item(
            self.sums, self.memory, begin, self.dtype, shape, strides, None if self.fixed is None else self.fixed[index]
        )

    def __setitem__(self, index: Any, value: Any) -> None:
        begin, shape, strides = self._view(index)
        for place in _places(self.memory, begin, shape, strides):
            self.sums.write(_KINDS[self.dtype.str[1:]], place, value)

    def places(self) -> list[Place]:
        """Those of its numbers."""
        return list(_places(self.memory, self.begin, self.shape, self.strides))

    def _view(self, index: Any) -> tuple[int, tuple[int, ...], tuple[int, ...]]:
        index = index if isinstance(index, tuple) else (index,)
        begin, shape, strides = self.begin, [], []
        for axis, part in enumerate(index):
            if isinstance(part, slice):
                chosen = range(self.shape[axis])[part]
                begin += chosen.start * self.strides[axis]
                shape.append(len(chosen))
                strides.append(chosen.step * self.strides[axis])
            else:
                begin += range(self.shape[axis])[part] * self.strides[axis]
        axis = len(index)
        return begin, (*shape, *self.shape[axis:]), (*strides, *self.strides[axis:])


class Row:
    """One row of a table, its fields by name."""

    def __init__(self, *parts: Any) -> None:
        object.__setattr__(self, "_parts", parts)

    def __getattr__(self, name: str) -> Any:
        sums, memory, begin, dtype, fixed = self._parts
        kind, begin, shape, strides = _field(dtype, name, begin)
        return _item(sums, memory, begin, kind, shape, strides, None if fixed is None else fixed[name])

    def __setattr__(self, name: str, value: Any) -> None:
        sums, memory, begin, dtype, _ = self._parts
        kind, begin, _, _ = _field(dtype, name, begin)
        sums.write(_KINDS[kind.str[1:]], (memory, begin), value)


def room(sums: Sums, number: int, shape: Any) -> Block:
    """An array of the kernel's own."""
    shape = shape if isinstance(shape, tuple) else (shape,)
    return Block(sums, -number, 0, np.dtype(float), shape, strides_of(8, shape), None)


def is_structure(numbers: AnyArray) -> AnyArray:
    """Which of the numbers of a fixed array belong to the structure, as integers of eight bytes each."""
    return (numbers == 0) | (numbers == _ONE) | (numbers == _MINUS_ONE)


_ONE, _MINUS_ONE = np.array([1.0, -1.0]).view(np.int64)


def _item(sums: Sums, memory: int, begin: int, dtype: Any, shape: Any, strides: Any, fixed: Any) -> Any:
    """A number, a row, or an array."""
    if shape:
        return Block(sums, memory, begin, dtype, shape, strides, fixed)
    if dtype.names:
        return Row(sums, memory, begin, dtype, fixed)
    kind, place = _KINDS[dtype.str[1:]], (memory, begin)
    if fixed is None or place in sums.memory:
        return sums.read(kind, place)
    if kind == REAL:
        if not is_structure(np.float64(fixed).view(np.int64)):
            return sums.read(kind, place)
        sums.taken_for_granted.add(place)
        return float(fixed)
    count = Count(fixed)
    if abs(count) > LARGEST_COUNT:
        count.at = sums.step(kind, "load", kind, place, 0)
    return count


def _field(dtype: Any, name: str, begin: int) -> tuple[Any, int, tuple[int, ...], tuple[int, ...]]:
    kind, offset = dtype.fields[name][:2]
    base, shape = kind.subdtype or (kind, ())
    return base, begin + offset, tuple(shape), strides_of(base.itemsize, shape)


def strides_of(size: int, shape: Any) -> tuple[int, ...]:
    """Of an array in the order of C, of items of so many bytes."""
    return tuple(size * math.prod(shape[k + 1 :]) for k in range(len(shape)))


def _places(memory: int, begin: int, shape: Any, strides: Any) -> Iterator[Place]:
    if not shape:
        yield memory, begin
        return
    for i in range(shape[0]):
        yield from _places(memory, begin + i * strides[0], shape[1:], strides[1:])
