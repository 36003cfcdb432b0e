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
from softhand.numerics.assembling import object_code
from softhand.numerics.blocks import LARGEST_COUNT, is_structure
from softhand.numerics.kept_codes import KeptCodes
from softhand.numerics.layouts import Layouts, numbers_in
from softhand.numerics.llvm_text import loaded
from softhand.numerics.symbols import NotStraightError, Place
from softhand.numerics.tracing import Traced

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

    def key(self, layouts: Layouts) -> Any:
        """All of it that makes a difference to code."""
        patterns = tuple(map(structure_of, self.patterns))
        return layouts.of(self.arrays), patterns, layouts.of(self.scratch)


class _Code(NamedTuple):
    """Code for one instance: its number among those of the kernel, and of each pointer the memory and bytes behind."""

    number: int
    memories: tuple[int, ...]
    shifts: tuple[int, ...]


class _Codes(NamedTuple):
    """All codes of a kernel for some instances."""

    addresses: tuple[int, ...]
    instances: tuple[_Code | None, ...]


_codes: dict[Any, _Codes] = {}


def straight(
    function: Any, instances: Sequence[tuple[Any, ...]], fixed: Fixed, layouts: Layouts
) -> list[Addressed | None]:
    """A kernel as straight code, called as `code(words, words)`, for each of some arguments.

    The code returns 1, or 0 where a `branches.seldom` holds or a `branches.usually` does not; it has then changed
    nothing but what the kernel sets before it reads it.

    Args:
        function: made by `compiled`; what it returns is dropped.
        instances: arguments: arrays, numbers, NamedTuples of them. Whole numbers belong to the structure.
        fixed: what of the arrays does.
        layouts: of the arrays of this run.

    Returns:
        None where its branches depend on numbers that only a run knows, and where the code would be too long.
    """
    key = function, layouts.of(tuple(instances)), fixed.key(layouts)
    with _LOCK:
        if key not in _codes:
            _codes[key] = _found(function, instances, fixed, layouts, key)
        codes = _codes[key]
    found: list[Addressed | None] = []
    for code, arguments in zip(codes.instances, instances, strict=True):
        if code is None:
            found.append(None)
            continue
        places = [layouts.places[memory] + shift for memory, shift in zip(code.memories, code.shifts, strict=True)]
        numbers = np.array(numbers_in(arguments)).view(np.int64).tolist()
        found.append(Addressed(codes.addresses[code.number], np.array(places + numbers, dtype=np.int64), arguments))
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


def _words(array: AnyArray) -> NDArray[np.int64]:
    """Its numbers of eight bytes each, a row each of its rows."""
    return np.ascontiguousarray(array).reshape(len(array), -1).view(np.int64)


def structure_of(pattern: AnyArray) -> bytes:
    """Whole numbers, zeros and ones of an array; all its other reals, and all addresses, look the same.

    Arrays of one layout and one structure have the same straight code.
    """
    if pattern.dtype.itemsize % 8 or not pattern.size:
        return pattern.tobytes()
    words = _words(pattern)
    return np.where((np.abs(words) <= LARGEST_COUNT) | is_structure(words), words, _NOT_FIXED).tobytes()


def _found(function: Any, instances: Sequence[tuple[Any, ...]], fixed: Fixed, layouts: Layouts, key: Any) -> _Codes:
    """From disk, or made now and kept."""
    module, name = function.py_func.__module__, function.py_func.__qualname__
    store = KeptCodes(module, repr((name, *_told(key[1:]))))
    known = store.found()
    if known is None:
        known = _made(function, instances, fixed, layouts)
        store.keep(known)
    objects, codes = known
    return _Codes(tuple(map(loaded, objects)), tuple(None if code is None else _Code(*code) for code in codes))


def _told(key: Any) -> Any:
    """A key as text tells it in every process."""
    if isinstance(key, tuple):
        return tuple(map(_told, key))
    return str(key.descr) if isinstance(key, np.dtype) else key


def _made(
    function: Any, instances: Sequence[tuple[Any, ...]], fixed: Fixed, layouts: Layouts
) -> tuple[list[bytes], list[tuple[Any, ...] | None]]:
    """Object codes, and `_Code` of each instance."""
    objects: list[bytes] = []
    codes: list[tuple[Any, ...] | None] = [None] * len(instances)
    traces: dict[int, Traced] = {}
    alike: dict[Any, list[int]] = {}
    for number, arguments in enumerate(instances):
        try:
            traced = Traced(function, arguments, fixed, layouts)
        except NotStraightError:
            continue
        if len(traced.sums.steps) <= _MOST:
            traces[number] = traced
            alike.setdefault(traced.form, []).append(number)
    for numbers in alike.values():
        shared = [traces[number] for number in numbers]
        pointers: dict[Any, int] = {}  # by where places of the first lie in the others
        reached: dict[Place, tuple[int, int]] = {}
        for places in zip(*(trace.places for trace in shared), strict=True):
            first = places[0]
            apart = tuple((memory, begin - first[1]) for memory, begin in places)
            reached[first] = pointers.setdefault(apart, len(pointers)), first[1]
        for k, number in enumerate(numbers):
            own = [apart[k] for apart in pointers]
            codes[number] = len(objects), tuple(memory for memory, _ in own), tuple(shift for _, shift in own)
        objects.append(object_code(shared[0].sums, reached, len(pointers)))
    return objects, codes
