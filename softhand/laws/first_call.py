"""Whether a formula of a user ends: its first calls, in plain Python, within a time limit.

Machine code cannot be stopped: an endless loop in it holds the whole process. So what is about to be compiled is called
first as plain Python, with what numba has compiled already taken back to its source, in a thread that is given up when
the time is over. What a formula raises or returns is of no interest here.
"""

from __future__ import annotations

import contextlib
import ctypes
import threading
from collections.abc import Callable, Iterable, Sequence
from inspect import isfunction
from types import CellType, FunctionType
from typing import TYPE_CHECKING, Any

from softhand.errors import LawError

if TYPE_CHECKING:
    from softhand.laws.law import Law

TIME_LIMIT = 5.0
"""Of the first calls of all formulas of a law [s]. They take some microseconds each."""

Formula = Callable[..., Any]


def first_cases(law: Law) -> list[list[float]]:
    """Arguments of first calls, from a touch to as deep as the law is meant for, upright and tilted."""
    depths = (0.0, 1e-3, 0.05, 0.3 * min(law.deepest, 1.0))
    deformations = [[depth * law.radius, tilt, -tilt, tilt] for depth in depths for tilt in (0.0, 1e-3, 0.1)]
    if law.coordinates == "surface":
        deformations = [[dr, law.radius * s1, law.radius * s2, psi] for dr, s1, s2, psi in deformations]
    return [law.arguments(deformation, Phi).tolist() for deformation in deformations for Phi in (0.5, 1.0, 1.5)]


def check_formulas_end(name: str, formulas: Iterable[Formula], cases: Sequence[Sequence[Any]]) -> None:
    """Call formulas with some arguments each, and wait.

    Args:
        name: of the law, for the message.
        formulas: of it; those that numba has compiled are called as they were written.
        cases: arguments of a call each.

    Raises:
        LawError: the time is over. Carries `.law`.
    """
    made: dict[int, Formula] = {}
    calls = [(_plain(formula, made), case) for formula in formulas for case in cases]
    worker = threading.Thread(target=_call, args=(calls,), daemon=True)
    worker.start()
    worker.join(TIME_LIMIT)
    if worker.is_alive():
        _give_up(worker)
        raise LawError(
            f"law '{name}': a formula has not ended after {TIME_LIMIT:g} s and {len(cases)} first calls; look for a "
            "loop without end in `force`, `stiffness` or `moment`.",
            law=name,
        )


def _call(calls: Sequence[tuple[Formula, Sequence[Any]]]) -> None:
    with contextlib.suppress(_GivenUp):
        for formula, case in calls:
            try:
                formula(*case)
            except _GivenUp:
                raise
            except BaseException:  # SystemExit too; what it raises is told by whoever calls it next
                continue


class _GivenUp(BaseException):
    """Ends the thread of a loop."""


def _give_up(worker: threading.Thread) -> None:
    """Raise in another thread, at the next line of Python there."""
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(worker.ident or 0), ctypes.py_object(_GivenUp))


def _plain(formula: Formula, made: dict[int, Formula]) -> Formula:
    """The formula, and what it calls by name, as it was before numba compiled it."""
    function = getattr(formula, "py_func", formula)
    if not isfunction(function):
        return formula
    if id(function) not in made:
        outer = dict(function.__globals__)
        cells = tuple(CellType() for _ in function.__closure__ or ())
        made[id(function)] = FunctionType(
            function.__code__, outer, function.__name__, function.__defaults__, cells or None
        )
        made[id(function)].__kwdefaults__ = function.__kwdefaults__
        for name in function.__code__.co_names:
            if callable(outer.get(name)):
                outer[name] = _plain(outer[name], made)
        for cell, own in zip(cells, function.__closure__ or (), strict=True):
            with contextlib.suppress(ValueError):  # an empty cell
                cell.cell_contents = _plain(own.cell_contents, made)
    return made[id(function)]
