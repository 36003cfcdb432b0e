"""A kernel followed with the numbers of a run: what it computes on the way that these take, and what they must be like.

As `tracing`, but each symbol has a number with it, so that a branch goes the way of that number, and the sums tell
what must hold for this way. Where it does not, another way is followed; a run has few of them.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Mapping
from types import FunctionType
from typing import Any

import numpy as np

from softhand.numerics import branches
from softhand.numerics.blocks import Block, strides_of
from softhand.numerics.layouts import Layouts
from softhand.numerics.symbols import REAL, SMALL, TRUTH, WHOLE, NotStraightError, Place, Sums, Symbol
from softhand.numerics.tracing import Arrays, Functions, Traced, traced_function

Meaning = Callable[..., Any]
"""What a function does on symbols: called with the `Followed` first."""

_COMPARED = {
    "ogt": lambda a, b: a > b, "olt": lambda a, b: a < b, "oge": lambda a, b: a >= b, "ole": lambda a, b: a <= b,
    "oeq": lambda a, b: a == b, "une": lambda a, b: a != b, "uno": lambda a, b: a != a or b != b,
    "eq": lambda a, b: a == b, "ne": lambda a, b: a != b, "sgt": lambda a, b: a > b, "slt": lambda a, b: a < b,
    "sge": lambda a, b: a >= b, "sle": lambda a, b: a <= b,
}  # fmt: skip
_KINDS: dict[str, Any] = {REAL: ctypes.c_double, WHOLE: ctypes.c_int64, SMALL: ctypes.c_int8}


def _over(a: float, b: float) -> float:
    return a / b if b else (math.nan if a == 0.0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b))


def _root(a: float) -> float:
    return math.sqrt(a) if a >= 0.0 else math.nan


_COMPUTED: dict[str, Callable[..., Any]] = {
    "fadd": lambda a, b: a + b, "fsub": lambda a, b: a - b, "fmul": lambda a, b: a * b, "fdiv": _over,
    "fneg": lambda a: -a, "fabs": abs, "sqrt": _root, "select": lambda c, a, b: a if c else b,
    "and": lambda a, b: a and b, "or": lambda a, b: a or b, "xor": lambda a, b: a != b, "add": lambda a, b: a + b,
    "pow": lambda a, b: math.pow(a, b), "log1p": math.log1p, "asin": math.asin, "atan": math.atan, "sinh": math.sinh,
    "cosh": math.cosh, "tanh": math.tanh,
}  # fmt: skip


class FollowedSums(Sums):
    """Sums whose steps have numbers.

    Attributes:
        values: of each step, for the run that is followed.
    """

    def __init__(self, layouts: Layouts) -> None:
        super().__init__()
        self.values: list[Any] = []
        self._layouts = layouts

    def step(self, kind: str, *step: Any) -> Symbol:
        """One step, with its number."""
        key = tuple((item.index,) if type(item) is Number else (type(item), item) for item in step)
        if key not in self._known:
            value = self._computed(step[0], step[1:])
            self._known[key] = Number(self, len(self.steps))
            self.steps.append(step)
            self.kinds.append(kind)
            self.values.append(value)
        return self._known[key]

    def require(self, condition: Symbol) -> None:
        """What the numbers must be like on this way."""
        self.step("", "require", condition)

    def _computed(self, word: str, rest: tuple[Any, ...]) -> Any:
        values = [self.values[item.index] if isinstance(item, Symbol) else item for item in rest]
        if word == "load":
            return self.now(rest[0], rest[1])
        if word in ("fcmp", "icmp"):
            return _COMPARED[values[0]](values[1], values[2])
        if word in ("zext", "uitofp", "sitofp", "fptosi"):
            return float(values[1]) if values[2] == REAL else int(values[1])
        if word in ("require", "store", "invoke"):
            return None
        compute = _COMPUTED.get(word) or getattr(math, word)
        try:
            return compute(*values)
        except (OverflowError, ValueError):
            return math.nan

    def now(self, kind: str, place: Place) -> Any:
        """What a run has at a place."""
        return _KINDS[kind].from_address(self._layouts.places[place[0]] + place[1]).value

    def converted(self, kind: str, value: Any) -> Any:
        """A number as one of another kind."""
        if isinstance(value, Symbol) and self.kinds[value.index] == TRUTH and kind != REAL:
            return self.step(kind, "zext", TRUTH, value, kind)
        return super().converted(kind, value)


class Number(Symbol):
    """A symbol with the number that a run has for it."""

    __slots__ = ()

    @property
    def value(self) -> Any:
        """That number."""
        return self.sums.values[self.index]  # type: ignore[attr-defined]

    def __bool__(self) -> bool:
        sums = self.sums
        if sums.kinds[self.index] != TRUTH:
            return bool(self != 0)
        sums.require(self if self.value else sums.step(TRUTH, "xor", self, True))
        return bool(self.value)

    def __index__(self) -> int:
        value = int(self.value)
        bool(self == value)
        return value

    def __pow__(self, power: Any) -> Any:
        if isinstance(power, Symbol):
            return self._do("pow", self, power)
        if power == int(power) and 0 < power <= 8:
            return super().__pow__(int(power))
        if power == 0:
            return 1.0
        return self._do("sqrt", self) if power == 0.5 else self._do("pow", self, float(power))

    def __rpow__(self, base: Any) -> Any:
        return self._do("pow", float(base), self)

    def __pos__(self) -> Any:
        return self

    def __hash__(self) -> int:
        return object.__hash__(self)

    def __eq__(self, other: Any) -> Any:
        return self._compare("oeq", other)


class View(Block):
    """An array of symbols that can be given another shape."""

    def __getitem__(self, index: Any) -> Any:
        return _as_view(super().__getitem__(index))

    def reshape(self, *shape: Any) -> View:
        """The same numbers in another shape; they must lie behind one another."""
        wanted = list(shape[0] if isinstance(shape[0], tuple) else shape)
        size = math.prod(self.shape)
        if -1 in wanted:
            known = -math.prod(wanted)
            wanted[wanted.index(-1)] = size // known if known else 0
        if self.strides != strides_of(self.dtype.itemsize, self.shape):
            raise NotStraightError("another shape of numbers that do not lie behind one another")
        fixed = None if self.fixed is None else self.fixed.reshape(wanted)
        return View(
            self.sums, self.memory, self.begin, self.dtype, wanted, strides_of(self.dtype.itemsize, wanted), fixed
        )

    def ravel(self) -> View:
        """All in a row."""
        return self.reshape(-1)


def _as_view(item: Any) -> Any:
    if type(item) is not Block:
        return item
    return View(item.sums, item.memory, item.begin, item.dtype, item.shape, item.strides, item.fixed)


class Followed(Traced):
    """A kernel that was followed on its arguments as they are now.

    Attributes:
        sums: what it computes.
        layouts: of the arrays.
        notes: what meanings have noted on the way.

    Args:
        function: made by `compiled`, or plain Python.
        arguments: arrays, numbers, NamedTuples of them; a number beside arrays is read from where `numbers` has it.
        tables: arrays whose whole numbers, and whose reals that are 0, 1 or -1, belong to the structure.
        moving: places of such reals that do not.
        meanings: of functions that are not followed.
        layouts: of all arrays of the run.
        numbers: array of the numbers among the arguments, in their order; literals if None.
        patterns: of the tables, where they are shared with others of their kind, see `straight.pattern_of`.
    """

    def __init__(
        self,
        function: Any,
        arguments: tuple[Any, ...],
        tables: tuple[Any, ...],
        moving: frozenset[Place],
        meanings: Mapping[Any, Meaning],
        layouts: Layouts,
        numbers: Any = None,
        patterns: tuple[Any, ...] | None = None,
    ) -> None:
        self.sums: FollowedSums = FollowedSums(layouts)
        self.layouts, self.notes = layouts, []  # type: Layouts, list[Any]
        kept = tables if patterns is None else patterns
        self._patterns = {
            id(array): _without(array, pattern, moving, layouts) for array, pattern in zip(tables, kept, strict=True)
        }
        self._layouts, self._rooms, self._count, self._array = layouts, 0, 0, numbers
        self._texts: dict[Any, Any] = {}
        self._meanings = meanings
        self.result = self.on_symbols(function)(*map(self._symbol, arguments))

    def _symbol(self, argument: Any) -> Any:
        if isinstance(argument, float):
            self._count += 1
            if self._array is None:
                return argument
            number, begin = self.layouts.number_of(self._array)
            return self.sums.read(REAL, (number, begin + 8 * (self._count - 1)))
        if isinstance(argument, tuple):
            items = [self._symbol(item) for item in argument]
            return type(argument)(*items) if hasattr(argument, "_fields") else tuple(items)
        return _as_view(super()._symbol(argument))

    def room(self, shape: Any) -> Block:
        """An array that a kernel makes."""
        found: Block = _as_view(super().room(shape))
        return found

    def block(self, array: Any) -> Block:
        """Symbols of an array."""
        number, begin = self.layouts.number_of(array)
        return Block(self.sums, number, begin, array.dtype, array.shape, array.strides, self._patterns.get(id(array)))

    def on_symbols(self, function: Any) -> Any:
        """The function with the same text in which all that it calls works on symbols."""
        text = getattr(function, "py_func", function)
        if text not in self._texts:
            names = {**text.__globals__, **_BUILTINS, "np": _Numpy(self)}
            self._texts[text] = FunctionType(
                text.__code__, names, text.__name__, text.__defaults__, _closure(text, self._replaced)
            )
            for name in _every_name(text.__code__):
                if name in text.__globals__:
                    names[name] = self._replaced(name, text.__globals__[name])
        return self._texts[text]

    def _replaced(self, name: str, called: Any) -> Any:
        if called is math:
            return _Math
        if called is np:
            return _Numpy(self)
        if getattr(called, "__module__", "") == "math" and callable(called):
            return getattr(_Math, called.__name__)
        try:
            meaning = self._meanings.get(called)
            plain = called in _BRANCHES
        except TypeError:  # has no hash
            return called
        if plain:
            return _same
        if meaning is not None:
            return lambda *arguments: meaning(self, *arguments)
        if hasattr(called, "py_func") or isinstance(called, FunctionType):
            return self.on_symbols(called)
        return called


def offsets_of(array: Any) -> Any:
    """How many bytes behind the begin of an array each of its numbers lies, in the order of its indices."""
    if array.dtype.names is not None:
        assert array.flags["C_CONTIGUOUS"]
        return np.arange(0, array.nbytes, 8)
    index = np.indices(array.shape).reshape(array.ndim, -1)
    return np.array(array.strides, dtype=np.int64) @ index if array.ndim else np.zeros(1, np.int64)


def _without(array: Any, pattern: Any, moving: frozenset[Place], layouts: Layouts) -> Any:
    """A pattern of an array in which the reals that may move are NaN, so that they are no part of the structure."""
    number, begin = layouts.number_of(array)
    own = [shift - begin for memory, shift in moving if memory == number]
    if not own or array.dtype.kind not in "fV":
        return pattern
    copy = np.array(pattern, order="C")
    words = copy.reshape(-1).view(np.float64)
    words[np.isin(offsets_of(array), own)] = np.nan
    return copy


def _closure(text: Any, replaced: Callable[[str, Any], Any]) -> Any:
    if text.__closure__ is None:
        return None
    import types

    return tuple(types.CellType(replaced("", cell.cell_contents)) for cell in text.__closure__)


def _every_name(code: Any) -> list[str]:
    names = list(code.co_names)
    for constant in code.co_consts:
        if hasattr(constant, "co_names"):
            names += _every_name(constant)
    return names


def _same(condition: Any) -> Any:
    return condition


_BRANCHES = {branches.seldom, branches.usually, branches.spared}


class _Numpy(Arrays):
    """numpy."""

    pi = math.pi

    def __getattr__(self, name: str) -> Any:
        if hasattr(_Math, name):
            return getattr(_Math, name)
        raise NotStraightError(f"np.{name}")

    def ones(self, shape: Any) -> Block:
        block = self.empty(shape)
        block[:] = 1.0
        return block


class _Math(Functions):
    """math."""

    e, tau = math.e, math.tau
    log1p, asin, atan, sinh, cosh, tanh = map(traced_function, ("log1p", "asin", "atan", "sinh", "cosh", "tanh"))

    @staticmethod
    def fabs(x: Any) -> Any:
        return abs(x)

    @staticmethod
    def pow(x: Any, y: Any) -> Any:
        return x**y

    @staticmethod
    def isinf(x: Any) -> Any:
        return abs(x) == math.inf

    @staticmethod
    def degrees(x: Any) -> Any:
        return x * (180.0 / math.pi)

    radians = staticmethod(lambda x: x * (math.pi / 180.0))  # type: ignore[assignment]


def _larger(*numbers: Any) -> Any:
    return _extreme(numbers, lambda a, b: b > a)


def _smaller(*numbers: Any) -> Any:
    return _extreme(numbers, lambda a, b: b < a)


def _extreme(numbers: Any, better: Any) -> Any:
    """The way of the number: what it is beside is no longer looked at."""
    best = numbers[0]
    for number in numbers[1:]:
        if not any(isinstance(item, Symbol) for item in (best, number)):
            best = number if better(best, number) else best
            continue
        condition = better(best, number)
        if isinstance(condition, Symbol):
            best = condition.sums.step(REAL, "select", condition, number, best)
        else:
            best = number if condition else best
    return best


def _whole(value: Any) -> Any:
    if not isinstance(value, Symbol):
        return int(value)
    if value.sums.kinds[value.index] == REAL:
        return value.sums.step(WHOLE, "fptosi", REAL, value, WHOLE)
    return value.sums.converted(WHOLE, value)


_BUILTINS = {"min": _smaller, "max": _larger, "int": _whole}
