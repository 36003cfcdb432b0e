"""Straight sums as text of LLVM."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from softhand.numerics.llvm_text import DECLARATIONS, ENTRY, assembled, computed, operand
from softhand.numerics.symbols import REAL, Place, Sums, Symbol


def object_code(sums: Sums, reached: Mapping[Place, tuple[int, int]], pointers: int) -> bytes:
    """Machine code i64 f(words, words) as an object file; the words are pointers, then numbers.

    Args:
        sums: what it computes.
        reached: by which pointer each place is reached, and how many bytes behind.
        pointers: how many there are.
    """
    return assembled(_Text(sums, reached, pointers).written(), 3)


class _Text:
    """The text of one code."""

    def __init__(self, sums: Sums, reached: Mapping[Place, tuple[int, int]], pointers: int) -> None:
        self._sums, self._reached, self._pointers = sums, reached, pointers
        self._branches = 0

    def written(self) -> str:
        lines = [f"define i64 @{ENTRY}(i64* %words, i64* %unused) {{"]
        for k in range(self._pointers):
            lines += [f"%w{k} = getelementptr i64, i64* %words, i64 {k}", f"%i{k} = load i64, i64* %w{k}",
                      f"%m{k} = inttoptr i64 %i{k} to i8*"]  # fmt: skip
        needed = self._needed()
        for index, (word, *rest) in enumerate(self._sums.steps):
            if index in needed:
                lines += self._step(index, word, rest)
        for k, (place, kind) in enumerate(self._sums.results()):
            value = operand(self._sums.memory[place])
            lines += [*self._pointer(f"o{k}", kind, place), f"store {kind} {value}, {kind}* %po{k}"]
        lines.append("ret i64 1")
        if self._branches:
            lines += ["off:", "ret i64 0"]
        return "\n".join([*lines, "}", *DECLARATIONS])

    def _step(self, index: int, word: str, rest: list[Any]) -> list[str]:
        if word == "number":
            place = f"%a{index} = getelementptr i64, i64* %words, i64 {self._pointers + rest[0]}"
            cast = f"%p{index} = bitcast i64* %a{index} to double*"
            return [place, cast, f"%s{index} = load double, double* %p{index}"]
        if word == "load":
            kind = rest[0]
            return [*self._pointer(str(index), kind, rest[1]), f"%s{index} = load {kind}, {kind}* %p{index}"]
        if word == "store":
            kind, place, value = rest[:3]
            return [*self._pointer(str(index), kind, place), f"store {kind} {operand(value)}, {kind}* %p{index}"]
        if word == "call":
            code, read, written = rest[:3]
            return [*self._pointer(f"{index}r", REAL, read), *self._pointer(f"{index}w", REAL, written),
                    f"%f{index} = inttoptr i64 {operand(code)} to void (double*, double*)*",
                    f"call void %f{index}(double* %p{index}r, double* %p{index}w)"]  # fmt: skip
        if word == "require":
            self._branches += 1
            return [f"br i1 {operand(rest[0])}, label %b{self._branches}, label %off", f"b{self._branches}:"]
        return [f"%s{index} = {computed(word, rest, self._sums.kinds)}"]

    def _pointer(self, name: str, kind: str, place: Any) -> list[str]:
        """To a place, or to what is at an address."""
        if isinstance(place, Symbol):
            return [f"%p{name} = inttoptr i64 {operand(place)} to {kind}*"]
        pointer, behind = self._reached[place]
        return [f"%a{name} = getelementptr i8, i8* %m{pointer}, i64 {behind}",
                f"%p{name} = bitcast i8* %a{name} to {kind}*"]  # fmt: skip

    def _needed(self) -> set[int]:
        """The steps on which something depends."""
        steps, memory = self._sums.steps, self._sums.memory
        waiting = [k for k, step in enumerate(steps) if step[0] in ("store", "call", "require")]
        waiting += [value.index for place, _ in self._sums.results() if isinstance(value := memory[place], Symbol)]
        found: set[int] = set()
        while waiting:
            index = waiting.pop()
            if index not in found:
                found.add(index)
                waiting += [item.index for item in steps[index] if isinstance(item, Symbol)]
        return found
