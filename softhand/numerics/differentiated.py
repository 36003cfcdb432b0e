"""Followed sums and their derivatives as machine code: the sums themselves with a tape, their tangent, their adjoint.

The tape is what the sums read. From it the tangent, dy = f'(x) dx, and the adjoint, x* += f'(x)^T y*, do the sums
again; dx, dy, x* and y* lie in shadows of the memories of x and y. A place that is written has y* of no use before it:
its adjoint is taken from there, which leaves zero, and those of what was read are added.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

from softhand.numerics.followed import FollowedSums
from softhand.numerics.llvm_text import DECLARATIONS, ENTRY, called, computed, operand
from softhand.numerics.symbols import REAL, WHOLE, Place, Symbol


class Ways(NamedTuple):
    """What of the memories counts.

    Attributes:
        constant: numbers of memories that a run does not write to; they are read again and need no tape.
        moving: places in them that derivatives are taken by.
        still: numbers of memories whose contents have no derivatives, though a run writes to them.
    """

    constant: Collection[int]
    moving: Collection[Place]
    still: Collection[int]


def memories_of(sums: FollowedSums) -> list[int]:
    """Numbers of the memories that are read or written, in the order of the words of the code."""
    found: dict[int, None] = {}
    for word, *rest in sums.steps:
        if word in ("load", "store"):
            found[rest[1][0]] = None
        elif word == "invoke":
            found[rest[0][0]] = found[rest[1][0]] = None
    for place, _ in sums.results():
        found[place[0]] = None
    return list(found)


class Writer:
    """Texts of the codes of some sums.

    Args:
        sums: what is computed.
        ways: what of the memories counts.

    Attributes:
        taped: steps that the tape has a word for, in its order.
        memories: as `memories_of`; the words of a code are their addresses, then those of their shadows.
    """

    def __init__(self, sums: FollowedSums, ways: Ways) -> None:
        self.sums, self.ways, self.memories = sums, ways, memories_of(sums)
        self._pointers = {number: k for k, number in enumerate(self.memories)}
        self._results = sums.results()
        self._active = self._find_active()
        reals = [sums.memory[place] for place, kind in self._results if kind == REAL]
        outputs = [v.index for v in reals if isinstance(v, Symbol) and v.index in self._active]
        self._again = self._behind(outputs)
        self.taped = [
            k for k, (word, *rest) in enumerate(sums.steps)
            if k in self._again and word == "load" and not self._is_constant(rest[1])
        ]  # fmt: skip

    def _is_constant(self, place: Place) -> bool:
        return place[0] in self.ways.constant

    def _find_active(self) -> set[int]:
        """Steps that have a derivative."""
        active: set[int] = set()
        for k, (word, *rest) in enumerate(self.sums.steps):
            if self.sums.kinds[k] != REAL:
                continue
            if word == "load":
                place = rest[1]
                if place[0] in self.ways.still or (self._is_constant(place) and place not in self.ways.moving):
                    continue
                active.add(k)
            elif word not in ("sitofp", "uitofp"):
                items = rest[1:] if word == "select" else rest
                if any(isinstance(item, Symbol) and item.index in active for item in items):
                    active.add(k)
        return active

    def _behind(self, wanted: list[int]) -> set[int]:
        found: set[int] = set()
        waiting = list(wanted)
        while waiting:
            index = waiting.pop()
            if index not in found:
                found.add(index)
                waiting += [item.index for item in self.sums.steps[index] if isinstance(item, Symbol)]
        return found

    def recording(self) -> str:
        """i64 f(words, tape): 1 with all written and the tape filled, or 0 with nothing changed but scratch."""
        sums, branches = self.sums, 0
        lines = self._begin(False)
        roots = [k for k, step in enumerate(sums.steps) if step[0] in ("store", "invoke", "require")]
        roots += [v.index for place, _ in self._results if isinstance(v := sums.memory[place], Symbol)]
        needed = self._behind(roots) | set(self.taped)
        for k, (word, *rest) in enumerate(sums.steps):
            if k not in needed:
                continue
            if word == "load":
                lines += self._load(k, rest[0], rest[1])
            elif word == "store":
                lines += [*self._place(f"t{k}", rest[0], rest[1]),
                          f"store {rest[0]} {operand(rest[2])}, {rest[0]}* %pt{k}"]  # fmt: skip
            elif word == "invoke":
                lines += [*self._place(f"f{k}", WHOLE, rest[0]), *self._place(f"g{k}", WHOLE, rest[1]),
                          f"%c{k} = load i64, i64* %pf{k}", f"%h{k} = inttoptr i64 %c{k} to void (i64*, i64*)*",
                          f"%d{k} = load i64, i64* %pg{k}", f"%e{k} = inttoptr i64 %d{k} to i64*",
                          f"call void %h{k}(i64* %e{k}, i64* %e{k})"]  # fmt: skip
            elif word == "require":
                branches += 1
                lines += [f"br i1 {operand(rest[0])}, label %b{branches}, label %off", f"b{branches}:"]
            else:
                lines.append(f"%s{k} = {computed(word, rest, self.sums.kinds)}")
        for n, k in enumerate(self.taped):
            kind = sums.kinds[k]
            lines.append(f"%x{n} = getelementptr double, double* %tape, i64 {n}")
            if kind == REAL:
                lines.append(f"store double %s{k}, double* %x{n}")
            else:
                wide = f"%s{k}"
                if kind != WHOLE:
                    lines.append(f"%xz{n} = sext {kind} %s{k} to i64")
                    wide = f"%xz{n}"
                lines += [f"%xi{n} = bitcast double* %x{n} to i64*", f"store i64 {wide}, i64* %xi{n}"]
        for n, (place, kind) in enumerate(self._results):
            value = operand(sums.memory[place])
            lines += [*self._place(f"o{n}", kind, place), f"store {kind} {value}, {kind}* %po{n}"]
        lines.append("ret i64 1")
        if branches:
            lines += ["off:", "ret i64 0"]
        return self._whole(lines)

    def tangent(self, lanes: int) -> str:
        """i64 f(words, tape) with shadows of so many numbers for each."""
        kind = REAL if lanes == 1 else f"<{lanes} x double>"
        lines, dots = [*self._begin(True), *self._again_lines()], {}
        splats: dict[str, str] = {}
        text = _Lanes(lines, kind, lanes, splats)
        for k, (word, *rest) in enumerate(self.sums.steps):
            if k not in self._again or k not in self._active:
                continue
            if word == "load":
                lines += self._shadow(f"l{k}", rest[1], kind, lanes)
                lines.append(f"%d{k} = load {kind}, {kind}* %ql{k}, align 8")
                dots[k] = f"%d{k}"
                continue
            total: str | None = None
            for n, item in enumerate(rest):
                if isinstance(item, Symbol) and item.index in dots:
                    total = text.added(total, self._share(text, k, word, rest, n, dots[item.index]))
            if total is not None:
                dots[k] = total
        for n, (place, one) in enumerate(self._results):
            if one != REAL:
                continue
            value = self.sums.memory[place]
            dot = dots.get(value.index) if isinstance(value, Symbol) else None
            lines += self._shadow(f"o{n}", place, kind, lanes)
            lines.append(
                f"store {kind} {dot or 'zeroinitializer' if lanes > 1 else dot or '0.0'}, {kind}* %qo{n}, align 8"
            )
        lines.append("ret i64 1")
        return self._whole(lines)

    def adjoint(self) -> str:
        """i64 f(words, tape)."""
        lines = [*self._begin(True), *self._again_lines()]
        text = _Lanes(lines, REAL, 1, {})
        bars: dict[int, str] = {}
        for n, (place, kind) in enumerate(self._results):
            if kind != REAL:
                continue
            lines += self._shadow(f"o{n}", place, REAL, 1)
            value = self.sums.memory[place]
            if isinstance(value, Symbol) and value.index in self._active:
                lines.append(f"%y{n} = load double, double* %qo{n}")
                bars[value.index] = text.added(bars.get(value.index), f"%y{n}")
            lines.append(f"store double 0.0, double* %qo{n}")
        for k in range(len(self.sums.steps) - 1, -1, -1):
            if k not in bars:
                continue
            word, *rest = self.sums.steps[k]
            if word == "load":
                lines += self._shadow(f"l{k}", rest[1], REAL, 1)
                lines += [f"%z{k} = load double, double* %ql{k}", f"%zz{k} = fadd double %z{k}, {bars[k]}",
                          f"store double %zz{k}, double* %ql{k}"]  # fmt: skip
                continue
            for n, item in enumerate(rest):
                if isinstance(item, Symbol) and item.index in self._active and not (word == "select" and n == 0):
                    share = self._share(text, k, word, rest, n, bars[k])
                    bars[item.index] = text.added(bars.get(item.index), share)
        lines.append("ret i64 1")
        return self._whole(lines)

    def _again_lines(self) -> list[str]:
        """The sums once more, from the tape."""
        lines, taped = [], {k: n for n, k in enumerate(self.taped)}
        for k, (word, *rest) in enumerate(self.sums.steps):
            if k not in self._again:
                continue
            if k in taped:
                kind = rest[0]
                lines.append(f"%x{k} = getelementptr double, double* %tape, i64 {taped[k]}")
                if kind == REAL:
                    lines.append(f"%s{k} = load double, double* %x{k}")
                else:
                    lines += [f"%xi{k} = bitcast double* %x{k} to i64*"]
                    if kind == WHOLE:
                        lines.append(f"%s{k} = load i64, i64* %xi{k}")
                    else:
                        lines += [f"%xw{k} = load i64, i64* %xi{k}", f"%s{k} = trunc i64 %xw{k} to {kind}"]
            elif word == "load":
                lines += self._load(k, rest[0], rest[1])
            else:
                lines.append(f"%s{k} = {computed(word, rest, self.sums.kinds)}")
        return lines

    def _share(self, text: _Lanes, k: int, word: str, rest: list[Any], n: int, g: str) -> str:
        """g times the derivative of step k by its argument n."""
        a = operand(rest[0])
        b = operand(rest[1]) if len(rest) > 1 else ""
        s = f"%s{k}"
        if word == "fadd":
            return g
        if word == "fsub":
            return g if n == 0 else text.negative(g)
        if word == "fmul":
            return text.times(g, b if n == 0 else a)
        if word == "fneg":
            return text.negative(g)
        if word == "fdiv":
            if n == 0:
                return text.times(g, text.one("fdiv", "1.0", b))
            return text.times(g, text.one("fneg", text.one("fdiv", s, b)))
        if word == "select":
            chosen = operand(rest[0])
            return text.chosen(chosen, g, None) if n == 1 else text.chosen(chosen, None, g)
        if word == "fabs":
            return text.times(g, text.call("copysign", "1.0", a))
        if word == "copysign":
            signs = text.one("fmul", text.call("copysign", "1.0", a), text.call("copysign", "1.0", b))
            return text.times(g, signs if n == 0 else "0.0")
        if word == "atan2":
            square = text.one("fadd", text.one("fmul", a, a), text.one("fmul", b, b))
            return text.times(g, text.one("fdiv", b if n == 0 else text.one("fneg", a), square))
        if word == "pow":
            if n == 0:
                return text.times(g, text.one("fmul", b, text.call("pow", a, text.one("fsub", b, "1.0"))))
            return text.times(g, text.one("fmul", s, text.call("log", a)))
        return text.times(g, self._rate(text, word, a, s))

    @staticmethod
    def _rate(text: _Lanes, word: str, a: str, s: str) -> str:
        """The derivative of a function of one number."""
        if word == "sqrt":
            return text.guarded(s, text.one("fdiv", "0.5", s))
        if word == "sin":
            return text.call("cos", a)
        if word == "cos":
            return text.one("fneg", text.call("sin", a))
        if word == "tan":
            return text.one("fadd", "1.0", text.one("fmul", s, s))
        if word == "exp":
            return s
        if word == "expm1":
            return text.one("fadd", s, "1.0")
        if word == "log":
            return text.one("fdiv", "1.0", a)
        if word == "log1p":
            return text.one("fdiv", "1.0", text.one("fadd", "1.0", a))
        if word == "sinh":
            return text.call("cosh", a)
        if word == "cosh":
            return text.call("sinh", a)
        if word == "tanh":
            return text.one("fsub", "1.0", text.one("fmul", s, s))
        square = text.one("fmul", a, a)
        if word == "atan":
            return text.one("fdiv", "1.0", text.one("fadd", "1.0", square))
        less = text.one("fsub", "1.0", square)
        if word == "atanh":
            return text.one("fdiv", "1.0", less)
        root = text.call("sqrt", less)
        return text.one("fdiv", "1.0" if word == "asin" else "-1.0", root)

    def _begin(self, with_shadows: bool) -> list[str]:
        lines = [f"define i64 @{ENTRY}(i64* %words, double* %tape) {{"]
        for name, first in (("m", 0), ("n", len(self.memories)))[: 2 if with_shadows else 1]:
            for k in range(len(self.memories)):
                lines += [f"%{name}w{k} = getelementptr i64, i64* %words, i64 {first + k}",
                          f"%{name}i{k} = load i64, i64* %{name}w{k}",
                          f"%{name}{k} = inttoptr i64 %{name}i{k} to i8*"]  # fmt: skip
        return lines

    def _place(self, name: str, kind: str, place: Place) -> list[str]:
        return [f"%a{name} = getelementptr i8, i8* %m{self._pointers[place[0]]}, i64 {place[1]}",
                f"%p{name} = bitcast i8* %a{name} to {kind}*"]  # fmt: skip

    def _shadow(self, name: str, place: Place, kind: str, lanes: int) -> list[str]:
        return [f"%r{name} = getelementptr i8, i8* %n{self._pointers[place[0]]}, i64 {place[1] * lanes}",
                f"%q{name} = bitcast i8* %r{name} to {kind}*"]  # fmt: skip

    def _load(self, k: int, kind: str, place: Place) -> list[str]:
        return [*self._place(f"l{k}", kind, place), f"%s{k} = load {kind}, {kind}* %pl{k}"]

    def _whole(self, lines: list[str]) -> str:
        return "\n".join([*lines, "}", *DECLARATIONS])


class _Lanes:
    """Lines of numbers, plain ones and those of all lanes."""

    def __init__(self, lines: list[str], kind: str, lanes: int, splats: dict[str, str]) -> None:
        self._lines, self._kind, self._lanes, self._splats, self._count = lines, kind, lanes, splats, 0
        self._known: dict[str, str] = {}

    def _named(self, what: str) -> str:
        if what not in self._known:
            self._count += 1
            self._known[what] = f"%v{self._count}"
            self._lines.append(f"%v{self._count} = {what}")
        return self._known[what]

    def one(self, word: str, *operands: str) -> str:
        """A plain number."""
        return self._named(f"{word} contract double {', '.join(operands)}")

    def call(self, word: str, *operands: str) -> str:
        """A function of plain numbers."""
        return self._named(called(word, list(operands)))

    def guarded(self, number: str, value: str) -> str:
        """A plain number, zero where another is not above zero."""
        condition = self._named(f"fcmp ogt double {number}, 0.0")
        return self._named(f"select i1 {condition}, double {value}, double 0.0")

    def added(self, a: str | None, b: str) -> str:
        """a + b in all lanes."""
        return b if a is None else self._named(f"fadd contract {self._kind} {a}, {b}")

    def negative(self, a: str) -> str:
        """-a in all lanes."""
        return self._named(f"fneg {self._kind} {a}")

    def times(self, a: str, number: str) -> str:
        """a times a plain number in all lanes."""
        return self._named(f"fmul contract {self._kind} {a}, {self._splat(number)}")

    def chosen(self, condition: str, yes: str | None, no: str | None) -> str:
        """One of two in all lanes; None is zero."""
        zero = "zeroinitializer" if self._lanes > 1 else "0.0"
        return self._named(f"select i1 {condition}, {self._kind} {yes or zero}, {self._kind} {no or zero}")

    def _splat(self, number: str) -> str:
        if self._lanes == 1:
            return number
        if number not in self._splats:
            first = self._named(f"insertelement {self._kind} undef, double {number}, i32 0")
            self._splats[number] = self._named(
                f"shufflevector {self._kind} {first}, {self._kind} undef, <{self._lanes} x i32> zeroinitializer"
            )
        return self._splats[number]


def addresses(memories: list[int], places: Mapping[int, int] | list[int]) -> list[int]:
    """The words of a code."""
    return [places[number] for number in memories]
