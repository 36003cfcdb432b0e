"""Straight sums as text of LLVM, and that as machine code."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import llvmlite.binding as llvm
import numpy as np

from softhand.numerics.symbols import REAL, TRUTH, Place, Sums, Symbol

_INTRINSICS = {"sqrt": 1, "sin": 1, "cos": 1, "exp": 1, "log": 1, "fabs": 1, "copysign": 2}
_LIBRARY = {"atan2": 2, "expm1": 1, "acos": 1, "atanh": 1, "tan": 1}
_ENTRY = "straight"
_engines: list[Any] = []  # they own the code


def object_code(sums: Sums, reached: Mapping[Place, tuple[int, int]], pointers: int) -> bytes:
    """Machine code i64 f(words, words) as an object file; the words are pointers, then numbers.

    Args:
        sums: what it computes.
        reached: by which pointer each place is reached, and how many bytes behind.
        pointers: how many there are.
    """
    module, machine = llvm.parse_assembly(_Text(sums, reached, pointers).written()), _machine()
    module.triple, module.data_layout = llvm.get_process_triple(), str(machine.target_data)
    return bytes(machine.emit_object(module))


def load(content: bytes) -> int:
    """Address of such code in memory."""
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine())
    engine.add_object_file(llvm.ObjectFileRef.from_data(content))
    engine.finalize_object()
    _engines.append(engine)
    return int(engine.get_function_address(_ENTRY))


def processor() -> str:
    """What machine code is made for."""
    return f"{llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()} {llvm.llvm_version_info}"


def _machine() -> Any:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_triple(llvm.get_process_triple())
    return target.create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=llvm.get_host_cpu_features().flatten(), opt=3, jit=True
    )


class _Text:
    """The text of one code."""

    def __init__(self, sums: Sums, reached: Mapping[Place, tuple[int, int]], pointers: int) -> None:
        self._sums, self._reached, self._pointers = sums, reached, pointers
        self._branches = 0

    def written(self) -> str:
        lines = [f"define i64 @{_ENTRY}(i64* %words, i64* %unused) {{"]
        for k in range(self._pointers):
            lines += [f"%w{k} = getelementptr i64, i64* %words, i64 {k}", f"%i{k} = load i64, i64* %w{k}",
                      f"%m{k} = inttoptr i64 %i{k} to i8*"]  # fmt: skip
        needed = self._needed()
        for index, (word, *rest) in enumerate(self._sums.steps):
            if index in needed:
                lines += self._step(index, word, rest)
        for k, (place, kind) in enumerate(self._sums.results()):
            value = _operand(self._sums.memory[place])
            lines += [*self._pointer(f"o{k}", kind, place), f"store {kind} {value}, {kind}* %po{k}"]
        lines.append("ret i64 1")
        if self._branches:
            lines += ["off:", "ret i64 0"]
        declared = [
            *(f"declare double @llvm.{name}.f64({', '.join(['double'] * n)})" for name, n in _INTRINSICS.items()),
            *(f"declare double @{name}({', '.join(['double'] * n)})" for name, n in _LIBRARY.items()),
        ]
        return "\n".join([*lines, "}", *declared])

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
            return [*self._pointer(str(index), kind, place), f"store {kind} {_operand(value)}, {kind}* %p{index}"]
        if word == "call":
            code, read, written = rest[:3]
            return [*self._pointer(f"{index}r", REAL, read), *self._pointer(f"{index}w", REAL, written),
                    f"%f{index} = inttoptr i64 {_operand(code)} to void (double*, double*)*",
                    f"call void %f{index}(double* %p{index}r, double* %p{index}w)"]  # fmt: skip
        if word == "require":
            self._branches += 1
            return [f"br i1 {_operand(rest[0])}, label %b{self._branches}, label %off", f"b{self._branches}:"]
        return [f"%s{index} = {self._sum(word, rest)}"]

    def _sum(self, word: str, rest: list[Any]) -> str:
        """One step that gives a number."""
        if word in ("zext", "uitofp", "sitofp", "fptosi"):
            return f"{word} {rest[0]} {_operand(rest[1])} to {rest[2]}"
        if word == "icmp":
            return f"icmp {rest[0]} {self._sums.kinds[rest[1].index]} {_operand(rest[1])}, {_operand(rest[2])}"
        if word == "fcmp":
            return f"fcmp {rest[0]} double {_operand(rest[1])}, {_operand(rest[2])}"
        operands = list(map(_operand, rest))
        if word in ("fadd", "fsub", "fmul", "fdiv", "fneg"):
            return f"{word} contract double {', '.join(operands)}"
        if word == "add":
            return f"add i64 {', '.join(operands)}"
        if word in ("and", "or", "xor"):
            return f"{word} {TRUTH} {', '.join(operands)}"
        if word == "select":
            return f"select i1 {operands[0]}, double {operands[1]}, double {operands[2]}"
        name = f"llvm.{word}.f64" if word in _INTRINSICS else word
        return f"call double @{name}({', '.join(f'double {operand}' for operand in operands)})"

    def _pointer(self, name: str, kind: str, place: Any) -> list[str]:
        """To a place, or to what is at an address."""
        if isinstance(place, Symbol):
            return [f"%p{name} = inttoptr i64 {_operand(place)} to {kind}*"]
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


def _operand(value: Any) -> str:
    if isinstance(value, Symbol):
        return f"%s{value.index}"
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"0x{np.float64(value).view(np.uint64):016X}" if isinstance(value, float) else str(int(value))
