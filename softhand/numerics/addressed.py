"""Compiled functions with all their arguments in place, as machine code at an address.

What calls such code, another kernel or a thread of Python, need not be compiled for it: a loop is compiled once and
runs every hand and every control law. See also `prepared`, whose words and texts are used here.
"""

from __future__ import annotations

import ctypes
import hashlib
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numba
from numba import carray, types

from softhand.numerics.arrays import AnyArray
from softhand.numerics.compiled import kernel_folder
from softhand.numerics.layouts import Layouts
from softhand.numerics.prepared import kind_of, load_text


class Addressed(NamedTuple):
    """Machine code void f(words, words) and the words that describe its arguments."""

    code: int
    """Address of the machine code."""
    words: AnyArray
    """What it is called with; int64."""
    kept: tuple[Any, ...]
    """The arguments and the code itself, which must live as long as they may be called."""

    @property
    def place(self) -> int:
        """Address of the words."""
        return int(self.words.ctypes.data)

    def __call__(self) -> None:
        """Call it, without the lock of the interpreter, so that other threads run meanwhile."""
        _FUNCTION(self.code)(self.place, self.place)


_FUNCTION = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
_SIGNATURE = types.void(types.CPointer(types.int64), types.CPointer(types.int64))


def addressed(function: Callable[..., Any], *arguments: Any, layouts: Layouts) -> Addressed:
    """A compiled function with all its arguments in place: arrays, numbers, and NamedTuples of them.

    The arrays are read anew at each call; what is in them may change, where they lie may not.

    Args:
        function: made by `compiled`; what it returns is dropped.
        arguments: all that it takes.
        layouts: of the arrays.
    """
    key = function, layouts.of(arguments)
    if key not in _codes:
        _codes[key] = _compile(function, tuple(kind_of(argument) for argument in arguments))
    code = _codes[key]
    return Addressed(code.address, layouts.words(arguments), (code, *arguments))


_codes: dict[Any, Any] = {}


@cache
def _compile(function: Any, kinds: tuple[Any, ...]) -> Any:
    names: dict[str, Any] = {"function": function, "carray": carray}
    texts, word = [], 0
    for kind in kinds:
        text, word = load_text(kind, word, names)
        texts.append(text)
    original = function.py_func
    name = f"{original.__name__}_{hashlib.sha256(repr(kinds).encode()).hexdigest()[:16]}_addressed"
    source = f"def {name}(words, unused):\n    block = carray(words, {word})\n    function({', '.join(texts)})\n"
    exec(compile(source, original.__code__.co_filename, "exec"), names)
    names[name].__module__ = original.__module__
    if not original.__module__.startswith("softhand."):  # of which nothing tells when it is stale
        return numba.cfunc(_SIGNATURE, error_model="numpy")(names[name])
    with kernel_folder(original.__module__):
        return numba.cfunc(_SIGNATURE, cache=True, error_model="numpy")(names[name])
