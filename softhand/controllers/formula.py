"""Control laws that are one formula for numba: what it reads, its settings, and its code."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numba.core.errors import NumbaError

from softhand.errors import ControllerError
from softhand.laws.key import make_compilable
from softhand.numerics.arrays import Array
from softhand.sensing.bound import Bound
from softhand.sensing.fields import ALIASES, FIELDS, SPANS, pick
from softhand.sensing.observation import Observation
from softhand.settings.settings import Settings


class _Code(NamedTuple):
    """A formula, and the fields of an observation that it reads, under the names that it has for them."""

    kernel: Callable[..., Any]
    reads: type[Any]
    renamed: dict[str, str]


@cache
def _code_of(formula: Callable[..., Any]) -> _Code:
    names = [name for name in formula.__code__.co_names if name in FIELDS or name in SPANS or name in ALIASES]
    renamed = {name: ALIASES[name] for name in names if name in ALIASES}
    make_compilable(formula)
    return _Code(njit(error_model="numpy")(formula), namedtuple("Observed", names), renamed)


@cache
def _settings_type(controller: type[Settings], names: tuple[str, ...]) -> Any:
    return namedtuple(f"{controller.__name__}Settings", names)


def settings_of(controller: Settings) -> Any:
    """The fields of a controller that are numbers, or lists of them as arrays."""
    found: dict[str, Any] = {}
    for name, value in dict(controller).items():
        if isinstance(value, bool | int | float):
            found[name] = float(value) if type(controller).model_fields[name].annotation is float else value
        elif isinstance(value, tuple):
            try:
                found[name] = np.array(value, dtype=float)
            except (TypeError, ValueError):  # of texts
                continue
    return _settings_type(type(controller), tuple(found))(**found)


def formula_of(controller: Any, observation: Observation) -> Bound:
    """The formula of a controller with the memory of its start."""
    code = _code_of(controller.formula)
    memory = _as_memory(controller, controller.start(observation))
    n = observation.joint_position.shape[0]
    return Bound(n, code.kernel, code.reads, settings_of(controller), memory, **code.renamed)


def call_formula(controller: Any, observation: Observation, memory: Any) -> tuple[Array, Array]:
    """Torque and next memory of a controller that is a formula.

    Raises:
        ControllerError: numba does not take the formula.
    """
    code = _code_of(controller.formula)
    torque, after = np.zeros(observation.joint_position.shape[0]), _as_memory(controller, memory)
    try:
        code.kernel(pick(code.reads, observation._views, **code.renamed), settings_of(controller), after, torque)
    except NumbaError as error:
        raise ControllerError(
            f"controller '{type(controller).__name__}': its formula cannot be compiled: {_reason(error)} Write it with "
            "plain numbers, `for`, `if`, the functions of `math`, and the fields of `observed`.",
            controller=type(controller).__name__, reason="formula", time=observation.time,
        ) from error  # fmt: skip
    return torque, after


def _as_memory(controller: Any, memory: Any) -> Array:
    """A copy of the memory as an array of numbers.

    Raises:
        ControllerError: it is none.
    """
    try:
        return np.array(memory, dtype=float, ndmin=1)
    except (TypeError, ValueError) as error:
        raise ControllerError(
            f"controller '{type(controller).__name__}': the memory of a law with a formula is one array of numbers; "
            f"`start` returned {memory!r}.",
            controller=type(controller).__name__, reason="formula", time=0.0,
        ) from error  # fmt: skip


def _reason(error: NumbaError) -> str:
    """What numba says, in one line."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return " ".join(lines[1:3] if len(lines) > 1 else lines)[:300]
