"""Calls of compiled functions whose arguments are taken apart once."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numba
import numpy as np
from numba.core.imputils import impl_ret_borrowed
from numba.extending import intrinsic

from softhand.numerics.compiled import compiled


def prepared(function: Callable[..., Any], *fixed: Any, varying: tuple[Any, ...] = ()) -> Callable[..., Any]:
    """A call of a compiled function whose arguments are taken apart only once, here.

    Numba takes every array apart at every call, which for twenty of them takes longer than many a kernel. Here it is
    given a single one, a block of memory that describes all. The arrays are kept and read anew at each call; what is in
    them may change, where they lie may not.

    Args:
        function: made by `compiled`.
        fixed: its first arguments, the same at each call: arrays and numbers.
        varying: examples of the remaining arguments, which the caller gives each time, always of these types.
    """
    types = tuple(numba.typeof(argument) for argument in fixed)
    block = np.array([word for argument in fixed for word in _words(argument)], dtype=np.int64)
    signature = (numba.typeof(block), *(numba.typeof(argument) for argument in varying))
    entry = _entry(function, types, len(varying))
    if signature not in entry.overloads:
        entry.compile(signature)
    call: Any = partial(entry.overloads[signature].entry_point, block)
    call.kept = fixed  # the block holds addresses only
    return call


def _words(argument: Any) -> list[int]:
    """An argument as numba holds it: an array as its parts (no owner), a number as its bits."""
    if isinstance(argument, np.ndarray):
        return [0, 0, argument.size, argument.itemsize, argument.ctypes.data, *argument.shape, *argument.strides]
    if isinstance(argument, float):
        return [int(np.float64(argument).view(np.int64))]
    return [int(argument)]


@cache
def _entry(function: Any, kinds: tuple[numba.types.Type, ...], n_varying: int) -> Any:
    """The function that takes a block in place of its first arguments; it is kept on disk with its module."""
    names: dict[str, Any] = {"function": function}
    arguments, word = [], 0
    for k, kind in enumerate(kinds):
        names[f"load_{k}"] = _loader(kind)
        arguments.append(f"load_{k}(block, {word})")
        word += 5 + 2 * kind.ndim if isinstance(kind, numba.types.Array) else 1
    rest = [f"x_{k}" for k in range(n_varying)]
    original = function.py_func
    name = f"{original.__name__}_{hashlib.sha256(repr(kinds).encode()).hexdigest()[:16]}"
    source = f"def {name}({', '.join(['block', *rest])}):\n    return function({', '.join(arguments + rest)})\n"
    exec(compile(source, original.__code__.co_filename, "exec"), names)
    names[name].__module__ = original.__module__
    return compiled(names[name])


@cache
def _loader(kind: numba.types.Type) -> Any:
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
