"""What a formula is made of: a text that changes when anything does that its machine code depends on.

numba freezes into the code of a function the functions that it calls, and the values of the constants that it reads, of
its own module and of others. It finds out about changes of the function's own file alone. So the key of a formula's
code on disk has all that can be reached from the formula; and what cannot be told apart is not kept.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from inspect import isbuiltin, isfunction, ismodule
from types import CodeType, ModuleType
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numba.extending import register_jitable


@dataclass
class Makings:
    """What was found on the way through a formula.

    Attributes:
        functions: the plain functions, the formula first.
        texts: of all that was found, by identity.
        can_be_kept: whether the texts tell everything apart, and all functions belong to modules.
    """

    functions: list[Callable[..., Any]] = field(default_factory=list)
    texts: dict[int, str] = field(default_factory=dict)
    can_be_kept: bool = True

    @property
    def key(self) -> str:
        """One text of all."""
        return "\n".join(self.texts.values())


_known: WeakKeyDictionary[Callable[..., Any], str] = WeakKeyDictionary()  # functions that numba may call, as they were


def make_compilable(formula: Callable[..., Any]) -> tuple[str, bool]:
    """Let numba compile a formula and the plain functions that it calls.

    Returns:
        The key of the formula, and whether its code may be kept on disk.
    """
    makings = makings_of(formula)
    for function in makings.functions:
        if _known.get(function) != makings.key:
            register_jitable(function)
            _known[function] = makings.key
    return makings.key, makings.can_be_kept


def makings_of(formula: Callable[..., Any]) -> Makings:
    """All that can be reached from a formula."""
    found = Makings()
    _take_function(formula, found)
    return found


def _take_function(function: Callable[..., Any], found: Makings) -> None:
    if id(function) in found.texts:
        return
    found.functions.append(function)
    found.texts[id(function)] = ""  # in its place, also where it calls itself
    found.can_be_kept &= function.__module__ in sys.modules
    code: CodeType = function.__code__
    names = {name for part in _codes(code) for name in part.co_names}
    outer = {**function.__globals__, **_closure(function)}
    values = {name: outer[name] for name in sorted({*names, *code.co_freevars}) if name in outer}
    read = {name: _text(value, names, found) for name, value in values.items()}
    defaults = _text((function.__defaults__, function.__kwdefaults__), names, found)
    found.texts[id(function)] = repr(([_code_text(part) for part in _codes(code)], defaults, read))


def _codes(code: CodeType) -> Iterator[CodeType]:
    """The code of a function and of those that are written inside it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)


def _code_text(code: CodeType) -> str:
    constants = ["code" if isinstance(constant, CodeType) else constant for constant in code.co_consts]
    return repr((code.co_code, constants, code.co_names, code.co_varnames, code.co_freevars))


def _closure(function: Callable[..., Any]) -> dict[str, Any]:
    cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    return {name: cell.cell_contents for name, cell in cells if _is_filled(cell)}


def _is_filled(cell: Any) -> bool:
    try:
        cell.cell_contents  # noqa: B018
    except ValueError:
        return False
    return True


def _text(value: Any, names: set[str], found: Makings) -> str:
    """What tells a value apart; of a module what the names reach in it."""
    plain = getattr(value, "py_func", value)  # of what numba compiled by itself
    if isfunction(plain):
        _take_function(plain, found)
        return f"function {value.__module__}.{value.__qualname__} {getattr(value, 'targetoptions', '')}"
    if ismodule(value):
        return repr(_module_text(value, names, found))
    if isinstance(value, bool | int | float | complex | str | bytes | type(None) | type(Ellipsis)):
        return repr(value)
    if isinstance(value, np.ndarray | np.generic) and not value.dtype.hasobject:
        content = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
        return f"array {value.dtype.str} {np.shape(value)} {content}"
    if isinstance(value, tuple | list):
        fields = getattr(value, "_fields", "")  # of a NamedTuple
        return f"{type(value).__name__} {fields} {[_text(item, names, found) for item in value]}"
    if isinstance(value, Mapping):
        return f"table {[(_text(key, names, found), _text(item, names, found)) for key, item in value.items()]}"
    if isbuiltin(value) or isinstance(value, np.ufunc) or getattr(value, "__module__", "") in ("builtins", "numpy"):
        return f"builtin {getattr(value, '__name__', value)!s}"
    found.can_be_kept = False
    return f"{type(value).__name__} at {id(value)}"


def _module_text(module: ModuleType, names: set[str], found: Makings) -> Any:
    """The values in a module that code with these names may read."""
    if id(module) in found.texts:
        return module.__name__
    found.texts[id(module)] = module.__name__
    inside = {name: getattr(module, name) for name in sorted(names) if hasattr(module, name)}
    found.texts[id(module)] = repr({name: _text(value, names, found) for name, value in inside.items()})
    return module.__name__
