"""A controller in plain Python in a run on tape: it is asked as ever, and differenced where derivatives pass it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import deepcopy
from math import prod
from typing import Any, NamedTuple

import numpy as np

from softhand.closed_loop.feedback import numbers_of, rebuilt
from softhand.controllers.controller import Controller
from softhand.derivatives.parameters import Parameter
from softhand.derivatives.shadowed import Shadowed
from softhand.derivatives.taped_run import TapedRun
from softhand.errors import ControllerError
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.scenario.scenario import Scenario
from softhand.sensing.fields import FIELDS, beginnings, shapes
from softhand.sensing.observation import Observation
from softhand.settings.settings import read_settings
from softhand.simulation.asking import Asking

_SHARE, _LEAST = 1e-4, 1e-4
"""Step of the differences: share of the largest number of a field, and at least."""


@compiled
def _nothing(observed, settings, memory, torque):
    """No torque."""
    for j in range(torque.shape[0]):
        torque[j] = 0.0


class Given(Controller):
    """Stands where torques come from elsewhere."""

    formula = _nothing


class _Sample(NamedTuple):
    """What the controller was asked, and what its answer depends on."""

    block: Array
    time: float
    memory: Any
    has_started: bool
    used: list[int]
    """Numbers of the block."""
    slopes: Array
    """Of torque and memory by these, by the memory and by the parameters."""
    after: int
    """Numbers of the memory behind it."""


class InPython:
    """A controller along one run.

    Args:
        taped: the run.
        controller: asked.
        parameters: of its settings, by which derivatives are taken.
        scenario: that they are of.
    """

    def __init__(
        self, taped: TapedRun, controller: Controller, parameters: Sequence[Parameter], scenario: Scenario
    ) -> None:
        self._taped, self._controller, self.parameters, self._scenario = taped, controller, parameters, scenario
        self._observation = taped.run.observation
        self._asking = Asking(controller, taped.plan.command)
        self._samples: dict[int, _Sample] = {}
        self._fields: set[str] = set()
        self._found = np.zeros(len(parameters))

    def ask(self, entry: int) -> None:
        """Where the run comes to it."""
        time = self._taped.time()
        self._observation.__dict__["time"] = time
        block = self._observation.block.copy()
        started, memory = self._asking.has_started, deepcopy(self._asking.memory)
        self._asking.ask(self._observation)
        self._samples[entry] = self._sampled(block, time, memory, started)

    def _answer(self, controller: Controller, block: Array, sample: tuple[float, Any, bool]) -> Array:
        time, memory, started = sample
        observation = Observation(self._observation.known, block, time)
        memory = memory if started else controller.start(observation)
        torque, after = controller.torque(observation, memory)
        return np.concatenate([np.asarray(torque, dtype=float), *numbers_of(after)])

    def _sampled(self, block: Array, time: float, memory: Any, started: bool) -> _Sample:
        controller, asked = self._controller, (time, memory, started)
        self._find_fields(block, asked)
        used, columns = [], []
        begins, every = beginnings(self._observation.known.sizes), shapes(self._observation.known.sizes)
        for name in (name for name in FIELDS if name in self._fields):
            begin, size = begins[name], prod(every[name])
            h = max(_SHARE * float(np.max(np.abs(block[begin : begin + size]))), _LEAST)
            for k in range(begin, begin + size):
                used.append(k)

                def there(x: float, k: int = k) -> Array:
                    return self._answer(controller, _with(block, k, x), asked)

                columns.append(self._slope(there, h))
        base = self._answer(controller, block.copy(), asked)
        if started:
            held = np.concatenate([[], *numbers_of(memory)])
            for k in range(len(held)):
                h = max(_SHARE * abs(held[k]), _LEAST)

                def beside(x: float, k: int = k) -> Array:
                    return self._answer(
                        controller, block.copy(), (time, rebuilt(memory, iter(_with(held, k, x))), True)
                    )

                columns.append(self._slope(beside, h))
        for one in self.parameters:

            def moved(x: float, one: Parameter = one) -> Array:
                values = self._scenario.with_values(one.moved(x)).controller.parameters
                return self._answer(read_settings(type(controller), values, "controller"), block.copy(), asked)

            columns.append(self._slope(moved, one.step))
        slopes = np.array(columns).T if columns else np.zeros((len(base), 0))
        n = len(self._taped.plan.command)
        return _Sample(block, time, memory, started, used, slopes, len(base) - n)

    def _find_fields(self, block: Array, asked: tuple[float, Any, bool]) -> None:
        """Which fields the answer depends on: those whose numbers it cannot do without."""
        begins, every = beginnings(self._observation.known.sizes), shapes(self._observation.known.sizes)
        for name in FIELDS:
            size = prod(every[name])
            if name in self._fields or name == "clock" or not size:
                continue
            poisoned = block.copy()
            poisoned[begins[name] : begins[name] + size] = np.nan
            try:
                with np.errstate(all="ignore"):
                    is_used = not np.all(np.isfinite(self._answer(self._controller, poisoned, asked)))
            except Exception:
                is_used = True
            if is_used:
                self._fields.add(name)

    def _slope(self, answer: Callable[[float], Array], h: float) -> Array:
        """By central differences with h and h / 2, extrapolated."""
        wide, narrow = ((answer(step) - answer(-step)) / (2.0 * step) for step in (h, 0.5 * h))
        slope: Array = (4.0 * narrow - wide) / 3.0
        if not np.all(np.isfinite(slope)):
            name = type(self._controller).__name__
            raise ControllerError(
                f"controller '{name}' answers with no number beside what it was asked (at t = {self._taped.time():g} "
                "s), so that it has no derivative there.",
                controller=name, reason="controller", time=self._taped.time(),
            )  # fmt: skip
        return slope

    def pull(self, shadowed: Shadowed) -> Callable[[int], None]:
        """The adjoint of what was answered at an entry."""
        shadows = shadowed.shadows
        held: list[Array] = [np.zeros(0)]
        self._found[:] = 0.0

        def back(entry: int) -> None:
            sample = self._samples[entry]
            after = held[0] if len(held[0]) else np.zeros(sample.after)
            bars = sample.slopes.T @ np.concatenate([shadows.command, after])
            shadows.command[:] = 0.0
            count, p = len(sample.used), len(self.parameters)
            shadows.block[sample.used] += bars[:count]
            held[0] = bars[count : len(bars) - p]
            self._found += bars[len(bars) - p :]

        return back

    def push(self, shadowed: Shadowed, columns: Sequence[Any]) -> Callable[[int], None]:
        """Their tangent, for some parameters of all."""
        n, lanes, shadows = len(self._taped.plan.command), shadowed.lanes, shadowed.shadows
        own = np.zeros((len(self.parameters), lanes))
        for lane, one in enumerate(columns):
            if isinstance(one, Parameter):
                own[list(self.parameters).index(one), lane] = 1.0
        held: list[Array] = [np.zeros((0, lanes))]

        def on(entry: int) -> None:
            sample = self._samples[entry]
            block = shadows.block.reshape(-1, lanes)[sample.used]
            dots = sample.slopes @ np.concatenate([block, held[0] if sample.has_started else np.zeros((0, lanes)), own])
            shadows.command[:] = dots[:n].reshape(-1)
            held[0] = dots[n:]

        return on

    def slopes(self, mode: str) -> dict[str, float]:
        """By its parameters, of an adjoint."""
        if mode != "adjoint":
            return {}
        return {one.name: float(value) for one, value in zip(self.parameters, self._found, strict=True)}


def _with(numbers: Array, k: int, amount: float) -> Array:
    """A copy with one number moved."""
    moved = numbers.copy()
    moved[k] += amount
    return moved
