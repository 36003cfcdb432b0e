"""What a run costs: sums over its samples of squares, or any function, of recorded variables; and the derivatives."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from softhand.errors import ScenarioError
from softhand.numerics.arrays import Array, as_numbers
from softhand.recording.variables import COMMANDED, FOUND_AFTERWARDS, MEASURED_PREFIX, VARIABLES
from softhand.settings.failures import failure
from softhand.settings.guesses import did_you_mean

_STEP = 1e-3  # of the largest value of a variable, in the differences of a function


@dataclass(frozen=True)
class QuadraticCost:
    """weight |variable - wanted|^2, integrated over the samples of a run, or at the last one.

    Attributes:
        variable: name of a variable of a recording.
        wanted: in its unit, a number or an array of its shape at one sample, or the name of another variable.
        weight: likewise, each number with its own, or one for all.
        terminal: at the last sample alone; else the sum over all samples, times the time between two of them.
        start: first sample that counts [s].
        end: last one [s].
    """

    variable: str
    wanted: ArrayLike | str = 0.0
    weight: ArrayLike = 1.0
    terminal: bool = False
    start: float = 0.0
    end: float = math.inf

    @property
    def name(self) -> str:
        """In words."""
        return f"{self.variable}{' at the end' if self.terminal else ''}"

    @property
    def variables(self) -> tuple[str, ...]:
        """What it is a function of."""
        return (self.variable, self.wanted) if isinstance(self.wanted, str) else (self.variable,)

    def at(self, time: Array, values: Mapping[str, Array]) -> tuple[float, dict[str, Array]]:
        """Its value, and its derivatives by the variables, shape (samples, ...) each."""
        y = values[self.variable]
        wanted = values[self.wanted] if isinstance(self.wanted, str) else self._numbers("wanted", y.shape[1:])
        weight = self._numbers("weight", y.shape[1:])
        if np.shape(wanted) not in ((), y.shape[1:], y.shape):
            raise ScenarioError(
                f"cost: {self.variable} has shape {y.shape[1:]} at a sample, {self.wanted!r} has "
                f"{np.shape(wanted)[1:]}; give one of the same shape.",
                key="cost", value=self.wanted,
            )  # fmt: skip
        share = _share(time, self.terminal, self.start, self.end).reshape(-1, *[1] * (y.ndim - 1))
        off = y - wanted
        slopes = {self.variable: 2.0 * share * weight * off}
        if isinstance(self.wanted, str):
            slopes[self.wanted] = -slopes[self.variable]
        return float(np.sum(share * weight * off * off)), slopes

    def _numbers(self, name: str, shape: tuple[int, ...]) -> Array:
        given = getattr(self, name)
        numbers = as_numbers(given)
        if numbers is None or not np.all(np.isfinite(numbers)) or numbers.shape not in ((), shape):
            raise ScenarioError(
                f"cost: {name} of {self.variable} is {given!r}; give a finite number, or an array of shape {shape}.",
                key="cost", value=given,
            )  # fmt: skip
        return numbers


@dataclass(frozen=True)
class PeakCost:
    """weight times the largest number of a variable over the samples of a run, all its components together.

    Its derivative is that at the sample and component which is largest: exact as long as that stays the same one.

    Attributes:
        variable: name of a variable of a recording.
        weight: of it.
        start: first sample that counts [s].
        end: last one [s].
    """

    variable: str
    weight: float = 1.0
    start: float = 0.0
    end: float = math.inf

    @property
    def name(self) -> str:
        """In words."""
        return f"largest {self.variable}"

    @property
    def variables(self) -> tuple[str, ...]:
        """What it is a function of."""
        return (self.variable,)

    def at(self, time: Array, values: Mapping[str, Array]) -> tuple[float, dict[str, Array]]:
        """As `QuadraticCost.at`."""
        counted = (time >= self.start - 1e-9) & (time <= self.end + 1e-9)
        y = values[self.variable].reshape(len(time), -1)
        slopes = np.zeros(y.shape)
        if not counted.any() or not y.size:
            return 0.0, {self.variable: slopes.reshape(values[self.variable].shape)}
        place = np.unravel_index(int(np.argmax(np.where(counted[:, None], y, -math.inf))), y.shape)
        slopes[place] = self.weight
        return self.weight * float(y[place]), {self.variable: slopes.reshape(values[self.variable].shape)}


@dataclass(frozen=True)
class FunctionCost:
    """A function of variables of a recording at one sample, integrated over the samples of a run, or at the last one.

        def effort(joint_torque, joint_velocity):
            return np.abs(joint_torque @ joint_velocity)

    Attributes:
        function: its arguments are named as the variables, and it returns a number; it is differenced.
        terminal: as of `QuadraticCost`.
        start: likewise [s].
        end: likewise [s].
    """

    function: Callable[..., float]
    terminal: bool = False
    start: float = 0.0
    end: float = math.inf
    variables: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        try:
            names = tuple(inspect.signature(self.function).parameters)
        except (TypeError, ValueError) as error:
            raise ScenarioError(
                f"cost: {self.function!r} is no function whose arguments can be read.", key="cost", value=self.function
            ) from error
        object.__setattr__(self, "variables", names)

    @property
    def name(self) -> str:
        """In words."""
        return f"{getattr(self.function, '__name__', 'function')}{' at the end' if self.terminal else ''}"

    def at(self, time: Array, values: Mapping[str, Array]) -> tuple[float, dict[str, Array]]:
        """As `QuadraticCost.at`; by central differences with h and h / 2, extrapolated."""
        share = _share(time, self.terminal, self.start, self.end)
        slopes = {name: np.zeros(values[name].shape) for name in self.variables}
        steps = {name: _STEP * (float(np.max(np.abs(values[name]))) or 1.0) for name in self.variables}
        total = 0.0
        for k in np.flatnonzero(share):
            given = {name: np.array(values[name][k]) for name in self.variables}
            total += share[k] * self._value(time[k], given)
            for name, h in steps.items():
                for place in np.ndindex(*given[name].shape):
                    kept, found = given[name][place], []
                    for step in (h, 0.5 * h):
                        ends = []
                        for sign in (1.0, -1.0):
                            given[name][place] = kept + sign * step
                            ends.append(self._value(time[k], given))
                        found.append((ends[0] - ends[1]) / (2.0 * step))
                    given[name][place] = kept
                    slopes[name][k][place] = share[k] * (4.0 * found[1] - found[0]) / 3.0
        return total, slopes

    def _value(self, time: float, given: Mapping[str, Array]) -> float:
        try:
            value = float(self.function(**given))
        except Exception as error:
            raise ScenarioError(
                f"cost: {self.name} raised {failure(error)} (at t = {time:g} s).", key="cost", value=self.function
            ) from error
        if not math.isfinite(value):
            raise ScenarioError(
                f"cost: {self.name} is {value} at t = {time:g} s; it must be a finite number.", key="cost", value=value
            )
        return value


Term: TypeAlias = QuadraticCost | PeakCost | FunctionCost
"""One term of a cost."""

Cost: TypeAlias = Term | Callable[..., float]
"""What a run may cost; a function alone is a `FunctionCost` over the whole run."""


def costs_of(cost: Cost | Iterable[Cost]) -> list[Term]:
    """All that is summed.

    Raises:
        ScenarioError: there is none, or one is no cost, or of an unknown variable or one without derivative.
    """
    given = list(cost) if isinstance(cost, list | tuple) else [cost]
    found: list[Term] = []
    for one in given:
        if not isinstance(one, QuadraticCost | PeakCost | FunctionCost):
            if not callable(one):
                raise ScenarioError(
                    f"cost: got {one!r}; give a QuadraticCost, a PeakCost, a FunctionCost, a function, or a list of "
                    "them.",
                    key="cost", value=one,
                )  # fmt: skip
            one = FunctionCost(one)
        for name in one.variables:
            _check(name)
        found.append(one)
    if not found:
        raise ScenarioError("cost: there is none; give at least one.", key="cost", value=cost)
    return found


_WHOLE = ("torque_limited", "joint_limited", "is_slipping", "support_is_slipping", "contact_feature")


def _check(name: str) -> None:
    if name not in VARIABLES or name == "time":
        raise ScenarioError(
            f"cost: {name!r} is no variable of a recording{did_you_mean(name, list(VARIABLES)[1:]) or '.'}",
            key="cost", value=name,
        )  # fmt: skip
    if name in COMMANDED.values() or name.startswith(MEASURED_PREFIX):
        raise ScenarioError(
            f"cost: {name} is there in runs with instruments or drives alone, which have no gradient; choose "
            f"{_applied(name)}.",
            key="cost", value=name,
        )  # fmt: skip
    if name in FOUND_AFTERWARDS:
        raise ScenarioError(
            f"cost: {name} is found in a recording by softhand.incipient_slip, and no part of the model; choose "
            "limit_surface_use.",
            key="cost", value=name,
        )  # fmt: skip
    if name in _WHOLE:
        raise ScenarioError(
            f"cost: {name} is 0, 1 or another whole number, which has no derivative; choose another variable.",
            key="cost", value=name,
        )  # fmt: skip


def _share(time: Array, terminal: bool, start: float, end: float) -> Array:
    """How much each sample counts."""
    share = np.zeros(len(time))
    if terminal:
        share[-1] = 1.0
        return share
    every = time[1] - time[0] if len(time) > 1 else 1.0
    share[(time >= start - 1e-9) & (time <= end + 1e-9)] = every
    return share


def _applied(name: str) -> str:
    """What is there in the place of a variable as it was seen or asked for."""
    return name.removesuffix("_commanded") if name in COMMANDED.values() else name.removeprefix(MEASURED_PREFIX)
