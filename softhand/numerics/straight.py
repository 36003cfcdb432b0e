"""Machine code without loops and branches, for a kernel and arguments of one structure.

The generic kernels work through tables of joints, columns and envelopes: most of their time goes into finding out what
to do next. Here a kernel is run once on symbols (`tracing`), and what it computes is compiled as one list of sums, in
which all that is fixed is a literal: a third of the time. The kernel stays the only text of the formulas, and does the
work itself wherever the numbers of a run lead off the straight way.

Such code is long, and soon slower than loops if the first cache of a processor cannot hold it. Therefore what is done
alike for each finger or contact is one code, and only where its numbers lie differs.
"""

from __future__ import annotations

from collections.abc import Sequence
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.addressed import Addressed
from softhand.numerics.arrays import AnyArray
from softhand.numerics.assembling import address_of
from softhand.numerics.blocks import LARGEST_COUNT, is_structure
from softhand.numerics.symbols import NotStraightError, Place
from softhand.numerics.tracing import Traced, memory_of, place_of

_MOST = 20_000  # steps
_LOCK = Lock()


class Fixed(NamedTuple):
    """What of the arguments belongs to their structure.

    Attributes:
        arrays: whole numbers of these, and their reals that are 0, 1 or -1.
        patterns: of each a copy, in which a real that need not be so for all that shall share code is NaN.
        scratch: arrays of which nothing is read later.
    """

    arrays: tuple[AnyArray, ...] = ()
    patterns: tuple[AnyArray, ...] = ()
    scratch: tuple[AnyArray, ...] = ()


class _Code(NamedTuple):
    """Code for one instance: its address, and the memory and the bytes behind its begin that each pointer points to."""

    address: int
    memories: NDArray[np.int64]
    shifts: NDArray[np.int64]


_codes: dict[Any, list[_Code | None]] = {}


def straight(function: Any, instances: Sequence[tuple[Any, ...]], fixed: Fixed = Fixed()) -> list[Addressed | None]:
    """A kernel as straight code, called as `code(words, words)`, for each of some arguments.

    The code returns 1, or 0 where a `branches.seldom` holds or a `branches.usually` does not; it has then changed
    nothing but what the kernel sets before it reads it.

    Args:
        function: made by `compiled`; what it returns is dropped.
        instances: arguments: arrays, numbers, NamedTuples of them. Whole numbers belong to the structure.
        fixed: what of the arrays does.

    Returns:
        None where its branches depend on numbers that only a run knows, and where the code would be too long.
    """
    patterns = {id(array): pattern for array, pattern in zip(fixed.arrays, fixed.patterns, strict=True)}
    own = [_Layout(arguments, patterns) for arguments in instances]
    key = function, tuple(layout.key for layout in own)
    with _LOCK:
        if key not in _codes:
            _codes[key] = _compile(function, instances, patterns, fixed.scratch)
        codes = _codes[key]
    found: list[Addressed | None] = []
    for code, layout, arguments in zip(codes, own, instances, strict=True):
        if code is None:
            found.append(None)
            continue
        places = np.array([place_of(memory) for memory in layout.memories], dtype=np.int64)
        words = np.concatenate([places[code.memories] + code.shifts, np.array(layout.numbers).view(np.int64)])
        found.append(Addressed(code.address, words, (arguments,)))
    return found


def pattern_of(table: AnyArray, groups: Sequence[Sequence[int]] = ()) -> AnyArray:
    """`Fixed.patterns` of an array, of which the rows in a group, of one length, shall share code."""
    pattern = np.array(table)
    words, is_whole = _words(pattern), _whole_words(table.dtype)
    for rows in map(list, groups):
        same = (words[rows] == words[rows[:1]]).all(axis=0)
        words[rows] = np.where(same | is_whole, words[rows], _NOT_FIXED)
    return pattern


def _whole_words(dtype: np.dtype[Any]) -> AnyArray:
    """Which of the numbers of a row are whole."""
    if dtype.names is None:
        return np.array([dtype.kind in "iu"])
    parts = [dtype[name].subdtype or (dtype[name], ()) for name in dtype.names]
    return np.repeat([kind.kind in "iu" for kind, _ in parts], [int(np.prod(shape)) for _, shape in parts])


_NOT_FIXED = np.float64(np.nan).view(np.int64)


def put(code: Addressed | None, row: NDArray[np.int64]) -> Addressed | None:
    """Its addresses into a row of a table that kernels read, see `contact.address.done`."""
    if code is not None:
        row[:] = code.code, code.place
    return code


class _Layout:
    """The structure of arguments, and what is not part of it."""

    def __init__(self, arguments: tuple[Any, ...], patterns: dict[int, AnyArray]) -> None:
        self.memories: list[AnyArray] = []
        self.numbers: list[float] = []
        self._patterns = patterns
        self.key = tuple(self._of(argument) for argument in arguments)

    def _of(self, argument: Any) -> Any:
        if isinstance(argument, tuple):
            return tuple(self._of(item) for item in argument)
        if isinstance(argument, float):
            self.numbers.append(argument)
            return "number"
        if not isinstance(argument, np.ndarray):
            return argument
        whole = memory_of(argument)
        number = next((k for k, known in enumerate(self.memories) if known is whole), len(self.memories))
        if number == len(self.memories):
            self.memories.append(whole)
        pattern = self._patterns.get(id(argument))
        fixed = b"" if pattern is None else _pattern_key(pattern)
        return number, place_of(argument) - place_of(whole), argument.dtype, argument.shape, argument.strides, fixed


def _words(array: AnyArray) -> NDArray[np.int64]:
    """Its numbers of eight bytes each, a row each of its rows."""
    return np.ascontiguousarray(array).reshape(len(array), -1).view(np.int64)


def _pattern_key(pattern: AnyArray) -> bytes:
    """Its whole numbers, zeros and ones; all other reals, and all addresses, look the same."""
    if pattern.dtype.itemsize % 8 or not pattern.size:
        return pattern.tobytes()
    words = _words(pattern)
    return np.where((np.abs(words) <= LARGEST_COUNT) | is_structure(words), words, _NOT_FIXED).tobytes()


def _compile(
    function: Any, instances: Sequence[tuple[Any, ...]], patterns: dict[int, AnyArray], scratch: tuple[AnyArray, ...]
) -> list[_Code | None]:
    found: list[_Code | None] = [None] * len(instances)
    alike: dict[Any, list[int]] = {}
    traces: list[Traced | None] = []
    for number, arguments in enumerate(instances):
        try:
            traced = Traced(function, arguments, patterns, scratch)
        except NotStraightError:
            traces.append(None)
            continue
        traces.append(traced)
        if len(traced.sums.steps) <= _MOST:
            alike.setdefault(traced.form, []).append(number)
    for numbers in alike.values():
        shared = [trace for k in numbers if (trace := traces[k]) is not None]
        pointers: dict[Any, int] = {}  # where a place of the first lies in the others: the same for all of one pointer
        reached: dict[Place, tuple[int, int]] = {}
        for places in zip(*(trace.places for trace in shared), strict=True):
            first = places[0]
            key = tuple((memory, begin - first[1]) for memory, begin in places)
            reached[first] = pointers.setdefault(key, len(pointers)), first[1]
        address = address_of(shared[0].sums, reached, len(pointers))
        for k, number in enumerate(numbers):
            memories, shifts = np.array([key[k] for key in pointers], dtype=np.int64).reshape(-1, 2).T.copy()
            found[number] = _Code(address, memories, shifts)
    return found
