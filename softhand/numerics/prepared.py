"""Calls of compiled functions whose arguments are taken apart once.

Numba takes every array apart at every call, about 40 ns each: a kernel of twenty arrays spends 0.9 us on that, more
than on some of its work, and 0.12 us if it is prepared (`benchmarks/bench_step.py` measures both). What is done here
rests on how numba lays out arrays and on a table of entry points that it does not document. Where that has changed, or
`SOFTHAND_PREPARED=0` is set, the call is a plain one: slower, the same result.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator
from functools import cache, partial
from importlib import import_module
from typing import Any

import numba
import numpy as np
from numba.core.imputils import impl_ret_borrowed
from numba.extending import intrinsic

from softhand.numerics.compiled import compiled

Kind = numba.types.Type


class Prepared(partial):
    """A call with its first arguments in place. It can be pickled: what it rests on is found anew."""

    function: Any
    fixed: tuple[Any, ...]
    """Kept alive; the call itself may hold their addresses only."""
    varying: tuple[Any, ...]

    def __reduce__(self) -> Any:
        original = self.function.py_func
        return _again, (original.__module__, original.__qualname__, self.fixed, self.varying)


def _again(module: str, name: str, fixed: tuple[Any, ...], varying: tuple[Any, ...]) -> Prepared:
    return prepared(getattr(import_module(module), name), *fixed, varying=varying)


def prepared(function: Callable[..., Any], *fixed: Any, varying: tuple[Any, ...] = ()) -> Prepared:
    """A call of a compiled function whose first arguments are taken apart only once, here.

    They are put into one block of memory that describes all of them. The arrays are kept and read anew at each call;
    what is in them may change, where they lie may not.

    Args:
        function: made by `compiled`.
        fixed: its first arguments, the same at each call: arrays, numbers, and NamedTuples of them.
        varying: examples of the remaining arguments, which the caller gives each time, always of these types.
    """
    if not _is_understood():
        call = Prepared(function, *fixed)
    else:
        kinds = tuple(kind_of(argument) for argument in fixed)
        block = np.array([word for argument in fixed for word in words_of(argument)], dtype=np.int64)
        entry = _entry(function, kinds, len(varying))
        call = Prepared(_entry_point(entry, (kind_of(block), *map(kind_of, varying))), block)
    call.function, call.fixed, call.varying = function, fixed, varying
    return call


def _entry_point(entry: Any, signature: tuple[Kind, ...]) -> Callable[..., Any]:
    """The machine code of a compiled function for arguments of these kinds, as a function of Python."""
    if signature not in entry.overloads:
        entry.compile(signature)
    point: Callable[..., Any] = entry.overloads[signature].entry_point
    return point


@cache
def _is_understood() -> bool:
    """Whether arrays and entry points of this numba are as they are taken to be: tried on a small function."""
    if os.environ.get("SOFTHAND_PREPARED") == "0":
        return False
    try:
        kinds = (numba.typeof(_SAMPLE), numba.types.float64)
        block = np.array([word for argument in (_SAMPLE, 0.5) for word in words_of(argument)], dtype=np.int64)
        entry = _entry(_try, kinds, 0)
        return bool(_entry_point(entry, (numba.typeof(block),))(block) == _SAMPLE[1, 2] + 0.5)
    except Exception:
        return False


_SAMPLE = np.arange(12.0).reshape(3, 4)[:, 1:]


@compiled
def _try(matrix, number):
    return matrix[1, 2] + number


_MOST = 512  # dtypes
_kinds: dict[Any, Kind] = {}
_dtypes: dict[int, np.dtype[Any]] = {}  # kept, so that no other can get the number of one


def kind_of(argument: Any) -> Kind:
    """As `numba.typeof`, which takes 40 us for a table of contacts, each time."""
    if isinstance(argument, np.ndarray):
        dtype, flags = argument.dtype, argument.flags
        _dtypes[id(dtype)] = dtype
        key: Any = id(dtype), argument.ndim, flags.c_contiguous, flags.f_contiguous, flags.writeable, flags.aligned
    elif isinstance(argument, tuple):
        key = type(argument), tuple(map(kind_of, argument))
    else:
        return numba.typeof(argument)
    if key not in _kinds:
        if len(_dtypes) > _MOST:
            _kinds.clear()
            _dtypes.clear()
        _kinds[key] = numba.typeof(argument)
    return _kinds[key]


PLACE_WORD = 4
"""Which of the words of an array is its address."""


def words_of(argument: Any) -> Iterator[int]:
    """An argument as numba holds it: an array as its parts (no owner), a number as its bits, a tuple as its items."""
    if isinstance(argument, tuple):
        for item in argument:
            yield from words_of(item)
    elif isinstance(argument, np.ndarray):
        place = argument.ctypes.data
        yield from (0, 0, argument.size, argument.itemsize, place, *argument.shape, *argument.strides)
    elif isinstance(argument, float):
        yield int(np.float64(argument).view(np.int64))
    else:
        yield int(argument)


@cache
def _entry(function: Any, kinds: tuple[Kind, ...], n_varying: int) -> Any:
    """The function that takes a block in place of its first arguments; it is kept on disk with its module."""
    names: dict[str, Any] = {"function": function}
    arguments, word = [], 0
    for kind in kinds:
        text, word = load_text(kind, word, names)
        arguments.append(text)
    rest = [f"x_{k}" for k in range(n_varying)]
    original = function.py_func
    name = f"{original.__name__}_{hashlib.sha256(repr(kinds).encode()).hexdigest()[:16]}"
    source = f"def {name}({', '.join(['block', *rest])}):\n    return function({', '.join(arguments + rest)})\n"
    exec(compile(source, original.__code__.co_filename, "exec"), names)
    names[name].__module__ = original.__module__
    return compiled(names[name])


def load_text(kind: Any, word: int, names: dict[str, Any]) -> tuple[str, int]:
    """Text that reads an argument of that kind from a word of the block on, and the word behind it."""
    if hasattr(kind, "types"):
        items = []
        for item in kind.types:
            text, word = load_text(item, word, names)
            items.append(text)
        if not hasattr(kind, "instance_class"):
            return f"({', '.join(items)},)", word
        names[f"make_{kind.instance_class.__name__}"] = kind.instance_class
        return f"make_{kind.instance_class.__name__}({', '.join(items)})", word
    names[f"load_{word}"] = _loader(kind)
    size = 5 + 2 * kind.ndim if isinstance(kind, numba.types.Array) else 1
    return f"load_{word}(block, {word})", word + size


@cache
def _loader(kind: Kind) -> Any:
    """Reads an argument of that type from a word of the block."""
    stored = kind if isinstance(kind, numba.types.Array | numba.types.Float) else numba.types.int64

    @intrinsic
    def load(typing_context, block, word):
        def generate(context, builder, signature, values):
            words = context.make_array(signature.args[0])(context, builder, values[0]).data
            place = builder.gep(words, [values[1]])
            value = builder.load(builder.bitcast(place, context.get_value_type(stored).as_pointer()))
            return impl_ret_borrowed(context, builder, stored, value)

        return stored(block, word), generate

    return load
