"""The derivative of one step of some sums by one of its arguments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from softhand.numerics.symbols import Symbol

Partial = Any
"""A number, a symbol, or a tree of `(word, ...)` that they are computed with; 1 and -1 are whole numbers."""

_OF_ONE = {
    "sin": lambda a, s: ("cos", a),
    "cos": lambda a, s: ("fneg", ("sin", a)),
    "tan": lambda a, s: ("fadd", 1.0, ("fmul", s, s)),
    "exp": lambda a, s: s,
    "expm1": lambda a, s: ("fadd", s, 1.0),
    "log": lambda a, s: ("fdiv", 1.0, a),
    "log1p": lambda a, s: ("fdiv", 1.0, ("fadd", 1.0, a)),
    "sinh": lambda a, s: ("cosh", a),
    "cosh": lambda a, s: ("sinh", a),
    "tanh": lambda a, s: ("fsub", 1.0, ("fmul", s, s)),
    "atan": lambda a, s: ("fdiv", 1.0, ("fadd", 1.0, ("fmul", a, a))),
    "atanh": lambda a, s: ("fdiv", 1.0, ("fsub", 1.0, ("fmul", a, a))),
    "asin": lambda a, s: ("fdiv", 1.0, ("sqrt", ("fsub", 1.0, ("fmul", a, a)))),
    "acos": lambda a, s: ("fdiv", -1.0, ("sqrt", ("fsub", 1.0, ("fmul", a, a)))),
    "sqrt": lambda a, s: ("chosen", ("ogt", s, 0.0), ("fdiv", 0.5, s), 0.0),  # at 0 it has none
    "fabs": lambda a, s: ("copysign", 1.0, a),
}  # fmt: skip
"""Of functions of one number a, of which s is the value."""


def partial_of(step: Symbol, word: str, rest: Sequence[Any], n: int) -> Partial | None:
    """The derivative of a step, which does `word` with `rest`, by the n-th of these; None if there is none."""
    a, b = rest[0], rest[1] if len(rest) > 1 else None
    if word in _OF_ONE:
        return _OF_ONE[word](a, step)
    if word == "fneg":
        return -1
    if word in ("fadd", "fsub"):
        return 1 if n == 0 or word == "fadd" else -1
    if word == "fmul":
        return b if n == 0 else a
    if word == "fdiv":
        return ("fdiv", 1.0, b) if n == 0 else ("fneg", ("fdiv", step, b))
    if word == "select":
        return None if n == 0 else ("chosen", a, float(n == 1), float(n == 2))
    if word == "copysign":
        return ("fmul", ("copysign", 1.0, a), ("copysign", 1.0, b)) if n == 0 else None
    if word == "atan2":
        square = ("fadd", ("fmul", a, a), ("fmul", b, b))
        return ("fdiv", b if n == 0 else ("fneg", a), square)
    if word == "pow":
        if n == 0:
            return ("fmul", b, ("pow", a, ("fsub", b, 1.0)))
        return ("fmul", step, ("log", a))
    return None
