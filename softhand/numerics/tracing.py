"""A kernel run on symbols: its text is that of the kernel, what it calls is replaced."""

from __future__ import annotations

import builtins
import math
from collections.abc import Callable
from functools import reduce
from types import FunctionType
from typing import Any

import numpy as np

from softhand.numerics import branches
from softhand.numerics.blocks import Block, Count, room
from softhand.numerics.layouts import Layouts
from softhand.numerics.symbols import REAL, TRUTH, WHOLE, NotStraightError, Place, Sums, Symbol

MEANINGS: dict[Any, Callable[..., Any]] = {}
"""What functions without Python text, numba's intrinsics, do on symbols."""


class Traced:
    """A kernel that was run on symbols of its arguments.

    Attributes:
        sums: what it computes.
        places: all that it reads and writes, in the order of what it does with them.
        form: what it computes, apart from where these are: that of another may be the same.
    """

    def __init__(self, function: Any, arguments: tuple[Any, ...], fixed: Any, layouts: Layouts) -> None:
        self.sums = Sums()
        self.sums.scratch = {layouts.number_of(array)[0] for array in fixed.scratch}
        self._patterns = {id(array): pattern for array, pattern in zip(fixed.arrays, fixed.patterns, strict=True)}
        self._layouts, self._numbers, self._rooms = layouts, 0, 0
        self._texts: dict[Any, Any] = {}
        self._on_symbols(function)(*map(self._symbol, arguments))
        self.places, self.form = _form(self.sums)

    def _symbol(self, argument: Any) -> Any:
        if isinstance(argument, tuple):
            items = [self._symbol(item) for item in argument]
            return type(argument)(*items) if hasattr(argument, "_fields") else tuple(items)
        if isinstance(argument, float):
            self._numbers += 1
            return self.sums.step(REAL, "number", self._numbers - 1)
        if not isinstance(argument, np.ndarray):
            return argument
        number, begin = self._layouts.number_of(argument)
        fixed = self._patterns.get(id(argument))
        return Block(self.sums, number, begin, argument.dtype, argument.shape, argument.strides, fixed)

    def _on_symbols(self, function: Any) -> Any:
        """The function with the same text in which all that it calls works on symbols."""
        text = function.py_func
        if text not in self._texts:
            names = {**text.__globals__, **_BUILTINS, "np": Arrays(self)}
            self._texts[text] = FunctionType(text.__code__, names, text.__name__, text.__defaults__)
            for name in text.__code__.co_names:
                called = text.__globals__.get(name)
                if called is math:
                    names[name] = Functions
                elif getattr(called, "__module__", "") == "math":
                    names[name] = getattr(Functions, name)
                elif callable(called) and called in _BRANCHES:
                    names[name] = _BRANCHES[called]
                elif callable(called) and called in MEANINGS:
                    names[name] = MEANINGS[called]
                elif hasattr(called, "py_func"):
                    names[name] = self._on_symbols(called)
        return self._texts[text]

    def room(self, shape: Any) -> Block:
        """An array that a kernel makes."""
        self._rooms += 1
        return room(self.sums, self._rooms, shape)


def _form(sums: Sums) -> tuple[list[Place], Any]:
    """`Traced.places` and `Traced.form`."""
    known: dict[Place, int] = {}

    def told(item: Any) -> Any:
        if isinstance(item, Symbol):
            return "s", item.index
        if isinstance(item, tuple):
            return "p", known.setdefault(item, len(known))
        return type(item), item

    steps = tuple(tuple(map(told, step)) for step in sums.steps)
    results = tuple((told(place), kind, told(sums.memory[place])) for place, kind in sums.results())
    return list(known), (steps, results)


class Arrays:
    """numpy."""

    nan, inf = math.nan, math.inf

    def __init__(self, traced: Traced) -> None:
        self.empty = traced.room

    def __getattr__(self, name: str) -> Any:
        raise NotStraightError(f"np.{name}")

    def zeros(self, shape: Any) -> Block:
        """Room that is zero."""
        block = self.empty(shape)
        block[:] = 0.0
        return block


def traced_function(name: str) -> Any:
    """A function of one number of `math`, which symbols may have too."""

    def apply(x: Any) -> Any:
        return x.sums.step(REAL, name, x) if isinstance(x, Symbol) else getattr(math, name)(x)

    return staticmethod(apply)


class Functions:
    """math."""

    pi, inf, nan = math.pi, math.inf, math.nan
    sqrt, sin, cos, tan, acos, atanh = map(traced_function, ("sqrt", "sin", "cos", "tan", "acos", "atanh"))
    exp, expm1, log = map(traced_function, ("exp", "expm1", "log"))
    radians = math.radians

    @staticmethod
    def atan2(y: Any, x: Any) -> Any:
        """Of numbers or symbols."""
        return _pair("atan2", y, x)

    @staticmethod
    def hypot(x: Any, y: Any) -> Any:
        """By its squares."""
        return Functions.sqrt(x * x + y * y)

    @staticmethod
    def copysign(x: Any, y: Any) -> Any:
        """Of numbers or symbols."""
        return _pair("copysign", x, y)

    @staticmethod
    def isnan(x: Any) -> Any:
        """A truth, or a symbol of one."""
        return x._do("fcmp", "uno", x, 0.0, kind=TRUTH) if isinstance(x, Symbol) else math.isnan(x)

    @staticmethod
    def isfinite(x: Any) -> Any:
        """Likewise."""
        return abs(x) < math.inf


def _pair(name: str, x: Any, y: Any) -> Any:
    sums = x.sums if isinstance(x, Symbol) else y.sums if isinstance(y, Symbol) else None
    return getattr(math, name)(x, y) if sums is None else sums.step(REAL, name, x, y)


def _larger(*numbers: Any) -> Any:
    return reduce(lambda a, b: _chosen(b > a, b, a), numbers)


def _smaller(*numbers: Any) -> Any:
    return reduce(lambda a, b: _chosen(b < a, b, a), numbers)


def _chosen(condition: Any, yes: Any, no: Any) -> Any:
    if not isinstance(condition, Symbol):
        return yes if condition else no
    return condition.sums.step(REAL, "select", condition, yes, no)


def _not(condition: Any) -> Any:
    return condition.sums.step(TRUTH, "xor", condition, True)


def _seldom(condition: Any) -> bool:
    if isinstance(condition, Symbol):
        condition = condition if condition.sums.kinds[condition.index] == TRUTH else condition != 0
        condition.sums.require(_not(condition))
        return False
    return bool(condition)


def _usually(condition: Any) -> bool:
    if isinstance(condition, Symbol):
        condition.sums.require(condition)
        return True
    return bool(condition)


def _spared(condition: Any) -> bool:
    return False if isinstance(condition, Symbol) else bool(condition)


def _whole(value: Any) -> Any:
    if not isinstance(value, Symbol):
        return int(value)
    if value.sums.kinds[value.index] == REAL:
        return value.sums.step(WHOLE, "fptosi", REAL, value, WHOLE)
    return value.sums.converted(WHOLE, value)


_BUILTINS = {"min": _smaller, "max": _larger, "int": _whole, "range": builtins.range}
_BRANCHES = {branches.seldom: _seldom, branches.usually: _usually, branches.spared: _spared}


def call_on_symbols(address: Any, arguments: Block | Count, results: Block) -> None:
    """What `contact.address.call` does."""
    if isinstance(address, Count):
        address = address.at
    elif not isinstance(address, Symbol):
        raise NotStraightError("a call of nothing")
    read = arguments.at if isinstance(arguments, Count) else arguments.places()
    results.sums.call(address, read, results.places())
