"""Control laws as one compiled formula: what it reads, its settings, its memory, and the call."""

from __future__ import annotations

import ctypes
import dis
from collections import namedtuple
from collections.abc import Callable, Iterable
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import njit
from numba.core.errors import NumbaError

from softhand.errors import ControllerError
from softhand.laws.key import make_compilable, makings_of
from softhand.numerics.addressed import Addressed, addressed
from softhand.numerics.arrays import Array, overwrite
from softhand.numerics.layouts import Layouts, numbers_in
from softhand.numerics.straight import Fixed, straight, structure_of
from softhand.sensing.fields import ALIASES, FIELDS, SPANS, observed_by, pick
from softhand.sensing.observation import Observation
from softhand.settings.settings import Settings
from softhand.settings.wording import nearest

if TYPE_CHECKING:
    from softhand.controllers.controller import Controller

_CALL = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)


class Law:
    """The formula of a controller on the numbers of one observation, ready to be called by any loop.

    Args:
        controller: has a formula.
        observation: whose arrays are read at each call.
        memory: before the first call; it is copied.

    Attributes:
        memory: before the next call.
        shape: of the memory.
        torque: what the last call answered [N m, N], shape (n,).
        reads: fields of an observation that the formula reads.
        call: the machine code.

    Raises:
        ControllerError: numba does not take the formula, or the memory is no array of numbers.
    """

    def __init__(self, controller: Controller, observation: Observation, memory: Any) -> None:
        if wrong := _no_field(controller.formula):
            raise ControllerError(
                f"controller '{type(controller).__name__}': its formula cannot be compiled: an observation has no "
                f"field {wrong}",
                controller=type(controller).__name__, reason="formula", time=observation.time,
            )  # fmt: skip
        code = _code_of(controller.formula)
        self.controller, self.reads = controller, code.reads
        self.memory = _as_memory(controller, memory)
        self.shape = self.memory.shape
        self.torque = np.zeros(observation.joint_position.shape[0])
        observed = pick(code.observed, observation._views, **code.renamed)
        arguments = observed, _own(controller.constants(observation), {}), self.memory, self.torque
        layouts = Layouts()
        try:
            self.call: Addressed = addressed(code.kernel, *arguments, layouts=layouts)
        except NumbaError as error:
            raise _refused(controller, error) from error
        self._entry, self._place = _CALL(self.call.code), self.call.place
        self._plain, self._arguments = code.plain, arguments
        self._structure = _structure(arguments[1])
        self._reals = layouts.places_of_numbers(arguments)
        self._straight: Addressed | None = None

    def __call__(self, memory: Array) -> tuple[Array, Array]:
        """Torque and the memory after it, both new; the memory that is handed in stays as it is."""
        self.memory[...] = memory
        self._entry(self._place, self._place)
        return self.torque.copy(), self.memory.copy()

    def straight(self, layouts: Layouts) -> Addressed | None:
        """The same as straight code, if it is a formula that ships and there is any.

        Args:
            layouts: of the arrays of the run.
        """
        if self._plain is not None:
            return None
        settings = tuple(item for item in self._arguments[1] if isinstance(item, np.ndarray))
        code = straight(self.controller.formula, [self._arguments], Fixed(settings, settings), layouts)[0]
        self._straight = code
        return code

    def become(self, controller: Controller, observation: Observation) -> bool:
        """Be the law of another controller before its first call, in the same memory, for the same observation.

        Returns:
            False where other settings than reals differ, or what is zero; then this law is of no use.
        """
        memory = _as_memory(controller, controller.start(observation))
        if type(controller) is not type(self.controller) or memory.shape != self.shape:
            return False
        settings = controller.constants(observation)
        if _structure(settings) != self._structure:
            return False
        numbers = np.array(numbers_in((settings,))).view(np.int64)
        self.call.words[self._reals] = numbers
        if self._straight is not None and numbers.size:
            self._straight.words[-numbers.size :] = numbers
        self.controller = controller
        self.memory[...], self.torque[...] = memory, 0.0
        observed, before, *rest = self._arguments
        self._arguments = observed, _renewed(before, settings), *rest
        return True

    def raised(self) -> Exception | None:
        """What a formula in plain Python raises here, if it does; a compiled loop cannot say."""
        if self._plain is not None:
            observed, settings, memory, torque = self._arguments
            try:
                self._plain(observed, settings, memory.copy(), torque.copy())
            except Exception as error:
                return error
        return None


def _own(settings: Any, copies: dict[int, Array]) -> Any:
    """Settings in memory of their own, where arrays that are views of one memory are so again."""
    if isinstance(settings, tuple):
        return _like(settings, [_own(item, copies) for item in settings])
    if not isinstance(settings, np.ndarray):
        return settings
    whole = settings
    while isinstance(whole.base, np.ndarray):
        whole = whole.base
    copy = copies.setdefault(id(whole), whole.copy(order="K"))
    own = copy[...]
    if settings is not whole:
        begin, memory = settings.ctypes.data - whole.ctypes.data, copy.ravel(order="K").view(np.uint8)
        own = np.ndarray(settings.shape, settings.dtype, memory, begin, settings.strides)
    own.flags.writeable = settings.flags.writeable
    return own


def _like(record: tuple[Any, ...], items: Iterable[Any]) -> tuple[Any, ...]:
    """A tuple of the same type."""
    return type(record)(*items) if hasattr(record, "_fields") else tuple(items)


def _structure(settings: Any) -> Any:
    """What settings must have in common with others to use the same code."""
    if isinstance(settings, tuple):
        return type(settings), tuple(map(_structure, settings))
    if isinstance(settings, np.ndarray):
        return settings.dtype, settings.shape, settings.flags.writeable, structure_of(settings)
    return float if isinstance(settings, float) else settings


def _renewed(old: Any, new: Any) -> Any:
    """Old settings with the numbers of new ones, their arrays where they are."""
    if isinstance(old, tuple):
        return _like(old, map(_renewed, old, new))
    if isinstance(old, np.ndarray):
        overwrite(old, new)
        return old
    return new


def law_of(controller: Controller, observation: Observation, memory: Any) -> Law:
    """The law for an observation; it is kept with the observation for the next call."""
    law: Law | None = observation.__dict__.get("law")
    if law is None or law.controller is not controller or getattr(memory, "shape", law.shape) != law.shape:
        if controller.formula is None:
            name = type(controller).__name__
            raise NotImplementedError(f"{name} needs a method `torque` or a static method `formula`")
        law = observation.__dict__["law"] = Law(controller, observation, memory)
    return law


def fields_read(controller: Controller) -> frozenset[str] | None:
    """Fields of an observation that a law reads while it runs; None of a law in plain Python, of which nobody knows."""
    return None if controller.formula is None else _code_of(controller.formula).reads


class _Code(NamedTuple):
    """A formula as compiled code."""

    kernel: Callable[..., Any]
    plain: Callable[..., Any] | None
    """The same without a guard, if it is one of a user."""
    observed: type[Any]
    """What it is handed of an observation, under the names that it has for them."""
    renamed: dict[str, str]
    """Names in it that stand for fields of other names."""
    reads: frozenset[str]
    """The fields."""


@cache
def _code_of(formula: Any) -> _Code:
    is_own = hasattr(formula, "py_func")  # made by `compiled`
    plain = None if is_own else _plain(formula)
    names = _names_in(formula.py_func if is_own else formula)
    renamed = {name: ALIASES[name] for name in names if name in ALIASES}
    kernel = formula if plain is None else _guarded(formula, plain)
    reads = frozenset(renamed.get(name, name) for name in names)
    return _Code(kernel, plain, observed_by(names), renamed, reads)


def _names_in(formula: Callable[..., Any]) -> list[str]:
    """Names of fields in a formula and in all that it calls; the paper's letters only in what does not ship."""
    found: dict[str, None] = {}
    for function in makings_of(formula).functions:
        ships = function.__module__.startswith("softhand.")
        for name in function.__code__.co_names:
            of = name if ships else ALIASES.get(name, name)
            if of in FIELDS or of in SPANS:
                found[name] = None
    return list(found)


@cache
def _no_field(formula: Any) -> str | None:
    """The first name that a formula of a user asks its first argument for in vain, with what is near to it."""
    if hasattr(formula, "py_func"):
        return None
    code, before = formula.__code__, ""
    for step in dis.get_instructions(code):
        field = ALIASES.get(step.argval, step.argval) if step.opname == "LOAD_ATTR" else ""
        if field and before == code.co_varnames[0] and field not in FIELDS and field not in SPANS:
            near = nearest(step.argval, [*FIELDS, *SPANS])
            return f"{step.argval!r} for a formula" + (f"; did you mean {near!r}?" if near else ".")
        loaded = step.argval if step.opname.startswith("LOAD_FAST") else ""
        before = loaded[-1] if isinstance(loaded, tuple) else loaded
    return None


def _plain(formula: Callable[..., Any]) -> Callable[..., Any]:
    make_compilable(formula)
    plain: Callable[..., Any] = njit(error_model="numpy", boundscheck=True)(formula)
    return plain


def _guarded(formula: Callable[..., Any], plain: Callable[..., Any]) -> Callable[..., Any]:
    """Begins with no torque, and answers NaN where the formula raises: compiled loops know no exceptions."""

    def guarded(observed, settings, memory, torque):
        torque[:] = 0.0
        try:
            plain(observed, settings, memory, torque)
        except Exception:
            torque[:] = np.nan

    guarded.__module__ = formula.__module__
    kernel: Callable[..., Any] = njit(error_model="numpy")(guarded)
    return kernel


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


def _refused(controller: Any, error: NumbaError) -> ControllerError:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    reason = next((line for line in lines if "Error" in line or "Unknown" in line or "Use of" in line), lines[0])
    place = next((line.removesuffix(":") for line in lines if line.startswith("File ")), "")
    return ControllerError(
        f"controller '{type(controller).__name__}': its formula cannot be compiled: {reason} ({place}). Write it with "
        "plain numbers, arrays, `for`, `if`, the functions of `math` and the fields of `observed` and `settings`.",
        controller=type(controller).__name__, reason="formula", time=0.0,
    )  # fmt: skip
