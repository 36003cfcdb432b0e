"""Machine code without loops and branches, for a kernel and arguments of one structure.

The generic kernels work through tables of joints, columns and envelopes: most of their time goes into finding out what
to do next. Here a kernel is run once on symbols (`tracing`), and what it computes is compiled as one list of sums, in
which all that is fixed is a literal: a third of the time. The kernel stays the only text of the formulas, and does the
work itself wherever the numbers of a run lead off the straight way.
"""

from __future__ import annotations

from threading import Lock
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from numpy.typing import NDArray

from softhand.numerics.addressed import Addressed
from softhand.numerics.arrays import AnyArray
from softhand.numerics.blocks import LARGEST_COUNT, is_structure
from softhand.numerics.symbols import REAL, TRUTH, NotStraightError, Symbol
from softhand.numerics.tracing import Traced, memory_of, place_of

_MOST = 40_000  # steps; longer code does not stay in the caches of a processor
_LOCK = Lock()
_codes: dict[Any, Any] = {}


def straight(function: Any, *arguments: Any, fixed: tuple[AnyArray, ...]) -> Addressed | None:
    """A kernel as straight code, called as `code(words, words)`.

    The code returns 1, or 0 where a `branches.seldom` holds or a `branches.usually` does not; it has then changed
    nothing but what the kernel sets before it reads it.

    Args:
        function: made by `compiled`; what it returns is dropped.
        arguments: arrays, numbers, NamedTuples of them. Whole numbers belong to the structure.
        fixed: of the arrays those whose whole numbers, and reals that are 0, 1 or -1, belong to the structure.

    Returns:
        None if its branches depend on numbers that only a run knows, or if it is too long.
    """
    memories: list[AnyArray] = []
    numbers: list[float] = []
    key = function, tuple(_layout(argument, memories, numbers, {id(array) for array in fixed}) for argument in arguments)
    with _LOCK:
        if key not in _codes:
            _codes[key] = _compile(function, arguments, fixed)
        code = _codes[key]
    if code is None:
        return None
    words = np.array([*map(place_of, memories), *np.array(numbers).view(np.int64)], dtype=np.int64)
    return Addressed(code.get_function_address("straight"), words, (code, *arguments))


def put(code: Addressed, row: NDArray[np.int64]) -> Addressed:
    """Its addresses into a row of a table that kernels read, see `contact.address.done`."""
    row[:] = code.code, code.place
    return code


def _layout(argument: Any, memories: list[AnyArray], numbers: list[float], fixed: set[int]) -> Any:
    """The structure of an argument; the memories that arrays lie in, and numbers, are appended."""
    if isinstance(argument, tuple):
        return tuple(_layout(item, memories, numbers, fixed) for item in argument)
    if isinstance(argument, float):
        numbers.append(argument)
        return "number"
    if not isinstance(argument, np.ndarray):
        return argument
    whole = memory_of(argument)
    number = next((k for k, known in enumerate(memories) if known is whole), len(memories))
    if number == len(memories):
        memories.append(whole)
    own = _pattern(argument) if id(argument) in fixed else b""
    return number, place_of(argument) - place_of(whole), argument.dtype, argument.shape, argument.strides, own


def _pattern(array: AnyArray) -> bytes:
    """Its whole numbers, zeros and ones; all other reals, and all addresses, look the same."""
    words = np.ascontiguousarray(array).reshape(-1).view(np.int64)
    counts = np.abs(words) <= LARGEST_COUNT
    return np.where(counts | is_structure(words), words, LARGEST_COUNT + 1).tobytes()


def _compile(function: Any, arguments: tuple[Any, ...], fixed: tuple[AnyArray, ...]) -> Any:
    try:
        traced = Traced(function, arguments, fixed)
    except NotStraightError:
        return None
    if len(traced.sums.steps) > _MOST:
        return None
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    module = llvm.parse_assembly(written(traced))
    target = llvm.Target.from_triple(llvm.get_process_triple())
    machine = target.create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=llvm.get_host_cpu_features().flatten(), opt=3, jit=True
    )
    module.triple, module.data_layout = llvm.get_process_triple(), str(machine.target_data)
    engine = llvm.create_mcjit_compiler(module, machine)
    engine.finalize_object()
    return engine


def written(traced: Traced) -> str:
    """The sums as text of LLVM."""
    sums, n = traced.sums, len(traced.memories)
    lines = ["define i64 @straight(i64* %words, i64* %unused) {"]
    for k in range(n):
        lines += [f"%w{k} = getelementptr i64, i64* %words, i64 {k}", f"%i{k} = load i64, i64* %w{k}",
                  f"%m{k} = inttoptr i64 %i{k} to i8*"]  # fmt: skip
    needed, branches = _needed(traced), 0
    for index, (word, *rest) in enumerate(sums.steps):
        if index not in needed:
            continue
        if word == "number":
            lines += [f"%a{index} = getelementptr i64, i64* %words, i64 {n + rest[0]}",
                      f"%p{index} = bitcast i64* %a{index} to double*", f"%s{index} = load double, double* %p{index}"]  # fmt: skip
        elif word == "load":
            lines += [*_pointer(index, *rest[:2]), f"%s{index} = load {rest[0]}, {rest[0]}* %p{index}"]
        elif word == "store":
            lines += [*_pointer(index, *rest[:2]), f"store {rest[0]} {_operand(rest[2])}, {rest[0]}* %p{index}"]
        elif word == "call":
            lines += [*_pointer(f"{index}r", REAL, rest[1]), *_pointer(f"{index}w", REAL, rest[2]),
                      f"%f{index} = inttoptr i64 {_operand(rest[0])} to void (double*, double*)*",
                      f"call void %f{index}(double* %p{index}r, double* %p{index}w)"]  # fmt: skip
        elif word == "require":
            lines += [f"br i1 {_operand(rest[0])}, label %b{branches}, label %off", f"b{branches}:"]
            branches += 1
        else:
            lines.append(f"%s{index} = {_sum(word, rest, sums)}")
    for k, (place, kind) in enumerate(sums.written.items()):
        if place[0] >= 0:
            value = sums.memory[place]
            value = _operand(float(value) if kind == REAL and not isinstance(value, Symbol) else value)
            lines += [*_pointer(f"o{k}", kind, place), f"store {kind} {value}, {kind}* %po{k}"]
    lines.append("ret i64 1")
    if branches:
        lines += ["off:", "ret i64 0"]
    return "\n".join([*lines, "}", *_DECLARED])


def _sum(word: str, rest: list[Any], sums: Any) -> str:
    """One step that gives a number."""
    if word in ("zext", "uitofp", "sitofp", "fptosi"):
        return f"{word} {rest[0]} {_operand(rest[1])} to {rest[2]}"
    if word == "icmp":
        return f"icmp {rest[0]} {sums.kinds[rest[1].index]} {_operand(rest[1])}, {_operand(rest[2])}"
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


_INTRINSICS = {"sqrt": 1, "sin": 1, "cos": 1, "exp": 1, "log": 1, "fabs": 1, "copysign": 2}
_DECLARED = [
    *(f"declare double @llvm.{name}.f64({', '.join(['double'] * n)})" for name, n in _INTRINSICS.items()),
    "declare double @atan2(double, double)",
    *(f"declare double @{name}(double)" for name in ("expm1", "acos", "atanh", "tan")),
]


def _operand(value: Any) -> str:
    if isinstance(value, Symbol):
        return f"%s{value.index}"
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"0x{np.float64(value).view(np.uint64):016X}" if isinstance(value, float) else str(int(value))


def _pointer(name: Any, kind: str, place: Any) -> list[str]:
    """To a place, or to what is at an address."""
    if isinstance(place, Symbol):
        return [f"%p{name} = inttoptr i64 {_operand(place)} to {kind}*"]
    return [f"%a{name} = getelementptr i8, i8* %m{place[0]}, i64 {place[1]}",
            f"%p{name} = bitcast i8* %a{name} to {kind}*"]  # fmt: skip


def _needed(traced: Traced) -> set[int]:
    """The steps on which something depends."""
    sums = traced.sums
    waiting = [k for k, step in enumerate(sums.steps) if step[0] in ("store", "call", "require")]
    waiting += [sums.memory[place].index for place in sums.written
                if place[0] >= 0 and isinstance(sums.memory[place], Symbol)]  # fmt: skip
    found: set[int] = set()
    while waiting:
        index = waiting.pop()
        if index not in found:
            found.add(index)
            waiting += [item.index for item in sums.steps[index] if isinstance(item, Symbol)]
    return found
