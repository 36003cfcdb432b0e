"""Sums in the words of LLVM, and its texts as machine code on disk and in memory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import llvmlite.binding as llvm
import numpy as np

from softhand.numerics.symbols import TRUTH, Symbol

ENTRY = "sums"
"""Name of the function in each text."""

INTRINSICS = {"sqrt": 1, "sin": 1, "cos": 1, "exp": 1, "log": 1, "fabs": 1, "copysign": 2, "pow": 2}
LIBRARY = {
    "atan2": 2, "expm1": 1, "acos": 1, "atanh": 1, "tan": 1, "log1p": 1, "asin": 1, "atan": 1, "sinh": 1, "cosh": 1,
    "tanh": 1,
}  # fmt: skip
"""Functions of LLVM and of the library of C, and how many numbers each takes."""

OPERATIONS = ("fadd", "fsub", "fmul", "fdiv", "fneg")
DECLARATIONS = tuple(
    f"declare double @{name}({', '.join(['double'] * count)})"
    for name, count in ({f"llvm.{name}.f64": count for name, count in INTRINSICS.items()} | LIBRARY).items()
)
"""Of the functions of `called`, for the end of a text."""


def operand(value: Any) -> str:
    """A number or a symbol where something is computed from it."""
    if isinstance(value, Symbol):
        return f"%s{value.index}"
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"0x{np.float64(value).view(np.uint64):016X}" if isinstance(value, float) else str(int(value))


def called(word: str, operands: Sequence[str]) -> str:
    """A function of real numbers."""
    name = f"llvm.{word}.f64" if word in INTRINSICS else word
    return f"call double @{name}({', '.join(f'double {one}' for one in operands)})"


def computed(word: str, rest: Sequence[Any], kinds: Sequence[str]) -> str:
    """One step that gives a number.

    Args:
        word: what it does.
        rest: with what.
        kinds: of all steps.
    """
    if word in ("zext", "uitofp", "sitofp", "fptosi"):
        return f"{word} {rest[0]} {operand(rest[1])} to {rest[2]}"
    if word == "icmp":
        return f"icmp {rest[0]} {kinds[rest[1].index]} {operand(rest[1])}, {operand(rest[2])}"
    if word == "fcmp":
        return f"fcmp {rest[0]} double {operand(rest[1])}, {operand(rest[2])}"
    operands = list(map(operand, rest))
    if word in OPERATIONS:
        return f"{word} contract double {', '.join(operands)}"
    if word == "add":
        return f"add i64 {', '.join(operands)}"
    if word in ("and", "or", "xor"):
        return f"{word} {TRUTH} {', '.join(operands)}"
    if word == "select":
        return f"select i1 {operands[0]}, double {operands[1]}, double {operands[2]}"
    return called(word, operands)


def processor() -> str:
    """What machine code is made for."""
    return f"{llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()} {llvm.llvm_version_info}"


def assembled(text: str, level: int = 1) -> bytes:
    """The code of a text as an object file.

    Args:
        text: with a function `ENTRY`.
        level: of optimization, 0 to 3.
    """
    module, machine = llvm.parse_assembly(text), _machine(level)
    module.triple, module.data_layout = llvm.get_process_triple(), str(machine.target_data)
    return bytes(machine.emit_object(module))


_engines: list[Any] = []  # they own the code


def loaded(content: bytes) -> int:
    """Address of `ENTRY` of such code in memory."""
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine(0))
    engine.add_object_file(llvm.ObjectFileRef.from_data(content))
    engine.finalize_object()
    _engines.append(engine)
    return int(engine.get_function_address(ENTRY))


def _machine(level: int) -> Any:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=llvm.get_host_cpu_features().flatten(), opt=level, jit=True
    )
