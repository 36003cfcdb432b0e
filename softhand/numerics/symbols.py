"""Numbers and arrays that stand for those of a kernel: run on them, its Python text writes down what it computes.

A kernel whose loops and branches follow the structure of what it is given, and not its numbers, does the same sums each
time. Run once on symbols it leaves these sums as one list without loops, branches and addresses to work out, from which
`straight` makes machine code.
"""

from __future__ import annotations

from typing import Any

REAL, WHOLE, SMALL, TRUTH = "double", "i64", "i8", "i1"
"""Kinds of numbers, in the words of LLVM."""

Place = tuple[int, int]
"""Which memory, and how many bytes behind its begin."""


class NotStraightError(Exception):
    """What a kernel does depends on numbers that only a run knows."""


class Sums:
    """What a kernel computes, step by step.

    Attributes:
        steps: each a word and what it is done with, numbers of earlier steps among it; none is there twice.
        kinds: of what each step gives, "" if it gives nothing.
        memory: what places of arrays hold now, as far as the kernel has read or written them.
        written: kind of each place that was written.
        scratch: numbers of memories of which nothing is read later.
        taken_for_granted: places whose numbers belong to the structure, and must stay what they are.
    """

    def __init__(self) -> None:
        self.steps: list[tuple[Any, ...]] = []
        self.kinds: list[str] = []
        self.memory: dict[Place, Any] = {}
        self.written: dict[Place, str] = {}
        self.scratch: set[int] = set()
        self.taken_for_granted: set[Place] = set()
        self._known: dict[tuple[Any, ...], Symbol] = {}

    def step(self, kind: str, *step: Any) -> Symbol:
        """One step; the earlier one if it was there."""
        key = tuple((item.index,) if type(item) is Symbol else item for item in step)
        if key not in self._known:
            self._known[key] = Symbol(self, len(self.steps))
            self.steps.append(step)
            self.kinds.append(kind)
        return self._known[key]

    def read(self, kind: str, place: Place) -> Any:
        """The number at a place."""
        if place not in self.memory:
            self.memory[place] = self.step(kind, "load", kind, place, 0)
        return self.memory[place]

    def write(self, kind: str, place: Place, value: Any) -> None:
        """Another number at a place."""
        if place in self.taken_for_granted:
            raise NotStraightError("a number of the structure that changes")
        self.memory[place], self.written[place] = self.converted(kind, value), kind

    def results(self) -> list[tuple[Place, str]]:
        """Places that hold other numbers at the end, and their kinds."""
        return [(place, kind) for place, kind in self.written.items() if place[0] >= 0 and place[0] not in self.scratch]

    def converted(self, kind: str, value: Any) -> Any:
        """A number as one of another kind."""
        if not isinstance(value, Symbol):
            return float(value) if kind == REAL else int(value)
        own = self.kinds[value.index]
        if own == kind:
            return value
        word = "uitofp" if own == TRUTH else "sitofp"
        return self.step(kind, word if kind == REAL else "zext", own, value, kind)

    def call(self, address: Any, read: list[Place] | Symbol, written: list[Place]) -> None:
        """Code at an address, which reads numbers from the first of these places on, and reads and writes others.

        Args:
            address: number of an earlier step.
            read: or the address of what nothing but such code writes to.
            written: of the places.
        """
        for place in [*(read if isinstance(read, list) else ()), *written]:
            if place in self.written:
                self.step("", "store", REAL, place, self.memory[place], len(self.steps))
        self.step("", "call", address, read[0] if isinstance(read, list) else read, written[0], len(self.steps))
        for place in written:
            self.memory[place] = self.step(REAL, "load", REAL, place, len(self.steps))
            self.written.pop(place, None)

    def require(self, condition: Symbol) -> None:
        """What the numbers of a run must be like; if they are not, it is not for this code."""
        self.step("", "require", condition)


class Symbol:
    """A number that only a run knows."""

    __slots__ = ("index", "sums")
    __array_ufunc__ = None

    def __init__(self, sums: Sums, index: int) -> None:
        self.sums, self.index = sums, index

    def __bool__(self) -> bool:
        raise NotStraightError("a branch on a number that only a run knows")

    def _do(self, word: str, *others: Any, kind: str = REAL) -> Symbol:
        return self.sums.step(kind, word, *others)

    def __add__(self, other: Any) -> Any:
        if self.sums.kinds[self.index] == WHOLE:
            return self if _is(other, 0) else self._do("add", self, other, kind=WHOLE)
        return self if _is(other, 0.0) else self._do("fadd", self, _real(other))

    def __radd__(self, other: Any) -> Any:
        return self + other

    def __sub__(self, other: Any) -> Any:
        return self if _is(other, 0.0) else self._do("fsub", self, _real(other))

    def __rsub__(self, other: Any) -> Any:
        return -self if _is(other, 0.0) else self._do("fsub", _real(other), self)

    def __mul__(self, other: Any) -> Any:
        if _is(other, 0.0):
            return 0.0
        if _is(other, 1.0):
            return self
        return -self if _is(other, -1.0) else self._do("fmul", self, _real(other))

    def __rmul__(self, other: Any) -> Any:
        return self * other

    def __truediv__(self, other: Any) -> Any:
        return self._do("fdiv", self, _real(other))

    def __rtruediv__(self, other: Any) -> Any:
        return 0.0 if _is(other, 0.0) else self._do("fdiv", _real(other), self)

    def __pow__(self, power: int) -> Any:
        result: Any = self
        for _ in range(power - 1):
            result = result * self
        return result

    def __neg__(self) -> Any:
        word, *rest = self.sums.steps[self.index]
        return rest[0] if word == "fneg" else self._do("fneg", self)

    def __abs__(self) -> Any:
        return self._do("fabs", self)

    def _compare(self, word: str, other: Any) -> Symbol:
        if self.sums.kinds[self.index] == REAL:
            return self._do("fcmp", word, self, _real(other), kind=TRUTH)
        return self._do("icmp", _WHOLE_WORDS[word], self, int(other), kind=TRUTH)

    def __gt__(self, other: Any) -> Any:
        return self._compare("ogt", other)

    def __lt__(self, other: Any) -> Any:
        return self._compare("olt", other)

    def __ge__(self, other: Any) -> Any:
        return self._compare("oge", other)

    def __le__(self, other: Any) -> Any:
        return self._compare("ole", other)

    def __eq__(self, other: Any) -> Any:
        return self._compare("oeq", other)

    def __ne__(self, other: Any) -> Any:
        return self._compare("une", other)

    __hash__ = object.__hash__

    def __and__(self, other: Any) -> Any:
        if isinstance(other, Symbol):
            return self._do("and", self, other, kind=TRUTH)
        return self if other else False

    def __rand__(self, other: Any) -> Any:
        return self & other

    def __or__(self, other: Any) -> Any:
        if isinstance(other, Symbol):
            return self._do("or", self, other, kind=TRUTH)
        return True if other else self

    def __ror__(self, other: Any) -> Any:
        return self | other


_WHOLE_WORDS = {"oeq": "eq", "une": "ne", "ogt": "sgt", "olt": "slt", "oge": "sge", "ole": "sle"}


def _is(value: Any, number: float) -> bool:
    return not isinstance(value, Symbol) and bool(value == number)


def _real(value: Any) -> Any:
    return value if isinstance(value, Symbol) else float(value)
