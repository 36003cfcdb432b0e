"""What parameters of a scenario do to the numbers that a run begins with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from softhand.assembly.parts import read_start
from softhand.assembly.variations import Variations
from softhand.batch.asked import Asked
from softhand.batch.loop import LAST
from softhand.batch.run import CompiledRun
from softhand.controllers.controller import Controller
from softhand.derivatives.parameters import Parameter
from softhand.derivatives.taped_run import asked_for, inputs_of
from softhand.errors import ScenarioError, SofthandError
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.followed import offsets_of
from softhand.numerics.layouts import numbers_in
from softhand.numerics.symbols import Place
from softhand.scenario.scenario import Scenario
from softhand.settings.settings import read_settings
from softhand.simulation.keep import Keep

_STRAIGHT = 1e-13
"""Up to which share of a number what two steps do to it is straight, so that two values are enough."""


class Direction(NamedTuple):
    """Derivatives by one parameter."""

    inputs: list[Array]
    """Of each array of `inputs_of`, its numbers in a row."""
    desired: Array
    """Of what is asked for, shape (periods + 1, 1 + numbers)."""


class Beside:
    """Runs beside one, of which only the beginning is looked at.

    Args:
        variations: of the scenario.
        scenario: the base.
        keep: as that of the run.
        own: controller in place of that of the scenario, with the settings that the scenario then has.
    """

    def __init__(self, variations: Variations, scenario: Scenario, keep: Keep, own: Controller | None = None) -> None:
        self._variations, self._scenario, self._keep, self._own = variations, scenario, keep, own
        self._run: CompiledRun | None = None
        self._asked: Any = None
        self._desired = np.zeros((0, 0))
        self._base = self._at(scenario)

    def direction(self, one: Parameter) -> Direction:
        """Along one parameter: central differences, extrapolated where two are not enough.

        Raises:
            ScenarioError: the scenario does not take a value beside, or a run of it is made of other numbers.
        """
        ends = [self._moved(one, sign * one.step) for sign in (1.0, -1.0)]
        slope = [(up - down) / (2.0 * one.step) for up, down in zip(*ends, strict=True)]
        if any(np.any(np.abs(up + down - 2.0 * at) > _STRAIGHT * (np.abs(up) + np.abs(down)))
               for up, down, at in zip(*ends, self._base, strict=True)):  # fmt: skip
            near = [self._moved(one, 0.5 * sign * one.step) for sign in (1.0, -1.0)]
            slope = [(4.0 * (up - down) / one.step - wide) / 3.0 for up, down, wide in zip(*near, slope, strict=True)]
        *inputs, desired = slope
        return Direction(list(inputs), desired)

    def _moved(self, one: Parameter, amount: float) -> list[Array]:
        try:
            found = self._at(self._scenario.with_values(one.moved(amount)))
        except SofthandError as error:
            raise ScenarioError(
                f"parameters: {one.name} beside {one.value:g}: {error}", key="parameters", value=one.name
            ) from error
        if [array.shape for array in found] != [array.shape for array in self._base]:
            raise ScenarioError(
                f"parameters: {one.name} beside {one.value:g} changes what a run is made of; give it another value in "
                "the scenario first.",
                key="parameters", value=one.name,
            )  # fmt: skip
        return found

    def _at(self, scenario: Scenario) -> list[Array]:
        """All that a run of it begins with."""
        setup = self._variations.to(scenario)
        if self._own is not None:
            own = read_settings(type(self._own), scenario.controller.parameters, "controller")
            setup = replace(setup, controller=own)
        if self._run is None or not self._run.become(setup, self._keep):
            self._run = CompiledRun(setup, self._keep, Asked())
        run = self._run
        numbers = np.array(numbers_in(run.law._arguments)) if run.law is not None else np.zeros(0)
        asked = setup.reference, read_start(setup.asked).row().tobytes()
        if asked != self._asked:
            self._asked, self._desired = asked, asked_for(run, int(run.plan.progress[LAST]))
        return [*(numbers_of(array) for array in inputs_of(run, numbers)), self._desired]


def numbers_of(array: AnyArray) -> Array:
    """The reals of an array in a row, whole numbers among them as zeros."""
    if array.dtype.names is None:
        return np.array(array, dtype=float).reshape(-1)
    words: Array = np.ascontiguousarray(array).reshape(-1).view(np.float64).copy()
    words.reshape(array.size, array.dtype.itemsize // 8)[:, ~_is_real(array.dtype)] = 0.0
    return np.nan_to_num(words, copy=False)


@cache
def _is_real(dtype: np.dtype[np.void]) -> AnyArray:
    """Which words of a row are reals."""
    assert dtype.names is not None
    found = []
    for name in dtype.names:
        base, shape = dtype[name].subdtype or (dtype[name], ())
        found += [base.kind == "f"] * int(np.prod(shape, dtype=int))
    return np.array(found)


def moving_places(directions: Sequence[Direction], arrays: Sequence[AnyArray], number_of: object) -> frozenset[Place]:
    """Places of numbers that any of them moves.

    Args:
        directions: of all parameters.
        arrays: of `inputs_of`.
        number_of: `Layouts.number_of`.
    """
    found = set()
    for k, array in enumerate(arrays):
        memory, begin = number_of(array)  # type: ignore[operator]
        for one in directions:
            along = one.inputs[k]
            if along.any():
                found |= {(memory, begin + int(byte)) for byte in offsets_of(array)[along != 0.0]}
    return frozenset(found)
