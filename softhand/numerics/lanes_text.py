"""Lines of LLVM for numbers that stand beside one another in lanes: one text computes the same for some of a kind."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from softhand.numerics.llvm_text import INTRINSICS, LIBRARY, OPERATIONS
from softhand.numerics.symbols import REAL, TRUTH, WHOLE, Symbol


class LanesText:
    """Lines, in which nothing is computed twice.

    Args:
        lanes: numbers beside one another; of one there are plain numbers.

    Attributes:
        lines: of the text.
    """

    def __init__(self, lanes: int) -> None:
        self.lanes, self.lines = lanes, []  # type: int, list[str]
        self._known: dict[str, str] = {}

    def kind(self, kind: str) -> str:
        """The type of a number in each lane."""
        return kind if self.lanes == 1 else f"<{self.lanes} x {kind}>"

    def literal(self, kind: str, value: Any) -> str:
        """The same number in all lanes."""
        if kind == REAL:
            one = f"0x{np.float64(value).view(np.uint64):016X}"
        else:
            one = str(int(value)) if kind != TRUTH else ("true" if value else "false")
        return one if self.lanes == 1 else f"<{', '.join([f'{kind} {one}'] * self.lanes)}>"

    def operand(self, value: Any, kind: str = REAL) -> str:
        """A symbol, a name of the text, or a number."""
        if isinstance(value, Symbol):
            return f"%s{value.index}"
        return value if isinstance(value, str) else self.literal(kind, value)

    def named(self, what: str) -> str:
        """The number that is computed so."""
        if what not in self._known:
            self._known[what] = f"%v{len(self._known)}"
            self.lines.append(f"{self._known[what]} = {what}")
        return self._known[what]

    def value(self, tree: Any) -> str:
        """A number of the text by a tree of what it is computed with; leaves are symbols, names and numbers."""
        if not isinstance(tree, tuple):
            return self.operand(tree)
        word, *rest = tree
        if word == "chosen":
            condition, yes, no = rest
            kind = self.kind(REAL)
            return self.named(
                f"select {self.kind(TRUTH)} {self._truth(condition)}, {kind} {self.value(yes)}, {kind} {self.value(no)}"
            )
        return self.real(word, [self.value(item) for item in rest])

    def _truth(self, condition: Any) -> str:
        if isinstance(condition, tuple):
            word, a, b = condition
            return self.named(f"fcmp {word} {self.kind(REAL)} {self.value(a)}, {self.value(b)}")
        return self.operand(condition, TRUTH)

    def real(self, word: str, operands: Sequence[str]) -> str:
        """Arithmetic, or a function."""
        kind = self.kind(REAL)
        if word in OPERATIONS:
            return self.named(f"{word} contract {kind} {', '.join(operands)}")
        if word in INTRINSICS:
            name = f"llvm.{word}.f64" if self.lanes == 1 else f"llvm.{word}.v{self.lanes}f64"
            return self.named(f"call {kind} @{name}({', '.join(f'{kind} {one}' for one in operands)})")
        if self.lanes == 1:
            return self.named(f"call double @{word}({', '.join(f'double {one}' for one in operands)})")
        found = "undef"
        for lane in range(self.lanes):
            own = [self.named(f"extractelement {kind} {one}, i32 {lane}") for one in operands]
            one = self.named(f"call double @{word}({', '.join(f'double {item}' for item in own)})")
            found = self.named(f"insertelement {kind} {found}, double {one}, i32 {lane}")
        return found

    def step(self, k: int, word: str, rest: Sequence[Any], kinds: Sequence[str]) -> None:
        """Step k of some sums that gives a number."""
        if word in ("zext", "uitofp", "sitofp", "fptosi"):
            what = f"{word} {self.kind(rest[0])} {self.operand(rest[1], rest[0])} to {self.kind(rest[2])}"
        elif word == "icmp":
            own = kinds[rest[1].index]
            what = f"icmp {rest[0]} {self.kind(own)} {self.operand(rest[1])}, {self.operand(rest[2], own)}"
        elif word == "fcmp":
            what = f"fcmp {rest[0]} {self.kind(REAL)} {self.operand(rest[1])}, {self.operand(rest[2])}"
        elif word == "add":
            what = f"add {self.kind(WHOLE)} {', '.join(self.operand(item, WHOLE) for item in rest)}"
        elif word in ("and", "or", "xor"):
            what = f"{word} {self.kind(TRUTH)} {', '.join(self.operand(item, TRUTH) for item in rest)}"
        elif word == "select":
            kind = self.kind(REAL)
            what = (f"select {self.kind(TRUTH)} {self.operand(rest[0], TRUTH)}, {kind} {self.operand(rest[1])}, "
                    f"{kind} {self.operand(rest[2])}")  # fmt: skip
        elif word in OPERATIONS:
            what = f"{word} contract {self.kind(REAL)} {', '.join(map(self.operand, rest))}"
        else:
            self.lines.append(f"%s{k} = bitcast {self.kind(REAL)} {self.real(word, list(map(self.operand, rest)))} to "
                              f"{self.kind(REAL)}")  # fmt: skip
            return
        self.lines.append(f"%s{k} = {what}")

    def declarations(self) -> list[str]:
        """Of all functions, for the end of a text."""
        kind, end = self.kind(REAL), "f64" if self.lanes == 1 else f"v{self.lanes}f64"
        found = [
            f"declare {kind} @llvm.{name}.{end}({', '.join([kind] * count)})" for name, count in INTRINSICS.items()
        ]
        return found + [f"declare double @{name}({', '.join(['double'] * n)})" for name, n in LIBRARY.items()]
