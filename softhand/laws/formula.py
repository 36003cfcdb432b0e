"""Whether the formulas of a law can be used: their arguments, the names in them, what they return."""

from __future__ import annotations

import builtins
import dis
import inspect
import re
from collections.abc import Callable, Iterator
from types import CodeType
from typing import TYPE_CHECKING, Any

import numpy as np

from softhand.errors import LawError
from softhand.laws.first_call import check_formulas_end, first_cases
from softhand.laws.key import makings_of
from softhand.settings.failures import failure

if TYPE_CHECKING:
    from softhand.laws.law import Law

_PLAIN = "write it with plain numbers, `if` and the functions of `math`"
_TOLD = ("Untyped global name", "Unknown attribute", "NameError", "No implementation", "Unsupported", "Invalid")
"""What the most telling line of a message of numba has in it, the best first."""


def check_formulas(law: Law, leading: tuple[str, ...]) -> None:
    """The formulas of a law run in plain Python at a small deformation and return the right count of numbers.

    Args:
        law: with its parameters.
        leading: names of the arguments of a formula before the fields of the law.

    Raises:
        LawError: they do not; names the law, the file and the line. Carries `.law`, `.file` and `.line`.
    """
    if law.coordinates == "polar" and (own := _formula(law, "moment")) is not None:
        raise _refused(
            law, own, "it has a `moment`, and polar coordinates, in which no contact transmits one: write the law in "
            'surface coordinates, `coordinates = "surface"`, or take `moment` out'
        )  # fmt: skip
    parameters = _numbers(law)
    arguments = (*_small(law), *parameters)
    for name, n_results in (("force", 4), ("stiffness", 16), ("moment", 2)):
        formula = _formula(law, name)
        if formula is None:
            continue
        if (type(law), formula) not in _checked:
            _check_arguments(law, formula, (*leading, *law.parameter_names()))
            _check_names(law, formula)
            check_formulas_end(type(law).__name__, [formula], first_cases(law))
            if not _has_loop(formula):
                _checked.add((type(law), formula))
        results = _results(law, formula, arguments, n_results)
        if results.shape != (n_results,) or not np.all(np.isfinite(results)):
            at = f"({', '.join(leading)}) = ({', '.join(f'{value:g}' for value in arguments[: len(leading)])})"
            raise _refused(
                law, formula, f"{name} must return {n_results} finite numbers, got {results.tolist()} at {at}"
            )
        if name == "force" and results[0] < 0.0:
            raise _refused(
                law, formula,
                f"its normal force is {results[0]:.3g} N at dr = {1e3 * arguments[0]:.3g} mm; a compressed tip must "
                f"push: turn the sign of the first number that `force` returns",
            )  # fmt: skip


_checked: set[tuple[type[Law], Callable[..., Any]]] = set()
"""Formulas of which all is known that does not depend on the coefficients."""


def _has_loop(formula: Callable[..., Any]) -> bool:
    """Whether a formula, or what it calls, may go round and round for some coefficients: its code jumps back."""
    return any(_jumps_back(function.__code__) for function in makings_of(formula).functions)


def _jumps_back(code: CodeType) -> bool:
    jumps = {*dis.hasjrel, *dis.hasjabs}
    steps = dis.get_instructions(code)
    return any(step.opcode in jumps and step.argval <= step.offset for step in steps) or any(
        _jumps_back(constant) for constant in code.co_consts if isinstance(constant, CodeType)
    )


def uncompilable(law: Law, error: Exception) -> LawError:
    """The error for formulas that numba refuses with this one, in one line."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    text = str(error)
    counts = re.search(r"unify return type.*?types: (.*)", text)
    if counts and len(sizes := sorted(set(re.findall(r"x (\d+)\)", counts[1])), key=int)) > 1:
        why = f"it returns {' numbers in one place and '.join(sizes)} in another"
    else:
        why = next((line for word in _TOLD for line in lines if word in line), lines[min(1, len(lines) - 1)])
    formula = _formula(law, "force")
    assert formula is not None
    file = formula.__code__.co_filename
    places = re.findall(r'File "([^"]+)", line (\d+)', text)
    own = [int(line) for name, line in places if file.endswith(name.lstrip("."))]
    return _refused(law, formula, f"its formula cannot be compiled: {why.rstrip('.:')}; {_PLAIN}", (own or [0])[-1])


def _formula(law: Law, name: str) -> Callable[..., Any] | None:
    """A formula of a law, None for one that it may lack."""
    own = inspect.getattr_static(type(law), name, None)
    if own is None and name == "force":
        raise LawError(
            f"law '{type(law).__name__}' has no formula; write the static method `force`.", law=type(law).__name__
        )
    if own is not None and not isinstance(own, staticmethod):
        function = own if inspect.isfunction(own) else None
        raise _refused(law, function, f"{name} is no static method; write @staticmethod above it, and no `self`")
    return None if own is None else getattr(law, name)


def _numbers(law: Law) -> list[float]:
    own = law.parameter_names()
    for name, value in dict(law).items():
        try:
            if name in own:
                float(value)
        except (TypeError, ValueError) as error:
            raise _refused(
                law, _formula(law, "force"), f"its field {name} is {value!r}; a formula is compiled for numbers alone"
            ) from error
    return law.parameters().tolist()


def _small(law: Law) -> tuple[float, ...]:
    """The arguments before the fields, at a deformation of a hundredth of the radius."""
    small = law.radius * np.array([1e-2, 1e-3, 1e-3])
    return (small[0], 1e-3, 1e-3, 1e-3, 1.0) if law.coordinates == "polar" else (*small, 1e-3, 0.0, 0.5)


def _check_arguments(law: Law, formula: Callable[..., Any], names: tuple[str, ...]) -> None:
    needed = f"{formula.__name__} must take {', '.join(names)} ({len(names)} numbers)"
    try:
        bound = inspect.signature(formula).bind(*names)
    except TypeError as error:
        raise _refused(law, formula, f"{needed}: {error}") from error
    taken = tuple(bound.arguments)
    if taken != names and set(taken) == set(names):
        raise _refused(law, formula, f"{needed} in this order, and takes {', '.join(taken)}")


def _check_names(law: Law, formula: Callable[..., Any]) -> None:
    """All names are known that the formula and the functions below it use, in branches not taken too."""
    for function in makings_of(formula).functions:
        known = {**vars(builtins), **function.__globals__}
        for name, line in _globals_in(function.__code__):
            if name not in known:
                what = f"the name {name!r} is not defined; a formula uses its arguments and what its file defines"
                raise _refused(law, function, what, line)


def _globals_in(code: CodeType) -> Iterator[tuple[str, int]]:
    """Names that code looks for outside of it, and their lines."""
    line = code.co_firstlineno
    for step in dis.get_instructions(code):
        starts = getattr(step, "line_number", step.starts_line)
        line = starts if isinstance(starts, int) and not isinstance(starts, bool) else line
        if step.opname == "LOAD_GLOBAL":
            yield step.argval, line
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _globals_in(constant)


def _results(
    law: Law, formula: Callable[..., Any], arguments: tuple[float, ...], n_results: int
) -> np.ndarray[Any, np.dtype[np.float64]]:
    try:
        with np.errstate(all="ignore"):
            found = formula(*map(np.float64, arguments))  # which divide as compiled code does
    except (Exception, SystemExit) as error:
        code = formula.__code__
        why = failure(error, code.co_filename, code.co_firstlineno)
        raise LawError(f"law '{type(law).__name__}': {formula.__name__} fails with {why}; mend the formula.",
                       law=type(law).__name__, file=code.co_filename, line=code.co_firstlineno) from error  # fmt: skip
    try:
        return np.asarray(found, dtype=float)
    except (TypeError, ValueError) as error:
        what = f"{formula.__name__} must return {n_results} finite numbers, got {found!r}"[:300]
        raise _refused(law, formula, what) from error


def _refused(law: Law, function: Callable[..., Any] | None, what: str, line: int = 0) -> LawError:
    """The error for what is wrong in a function, at a line of it or at its first."""
    name, code = type(law).__name__, getattr(function, "__code__", None)
    file, line = ("", 0) if code is None else (code.co_filename, line or code.co_firstlineno)
    where = f" ({file}, line {line})" if file else ""
    return LawError(f"law '{name}': {what}{where}.", law=name, file=file, line=line)
