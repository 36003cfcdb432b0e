"""What is turned: numbers of a scenario between bounds, and the scenario with them at a point of the unit cube."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from softhand.assembly.resolve import Setup
from softhand.batch.variations import varied
from softhand.derivatives.parameters import WRENCH, Parameter, find_parameters
from softhand.errors import SofthandError
from softhand.numerics.arrays import Array
from softhand.scenario.scenario import Scenario
from softhand.settings.settings import Settings
from softhand.settings.wording import show
from softhand.studies.keys import values_at
from softhand.studies.study_file import StudyFile
from softhand.tuning.settings import Turned

_DIGITS = 5  # of a number that is written


class Knob(NamedTuple):
    """One number that is turned, or one factor on all numbers of a key."""

    name: str
    """Its key, with its place in a list."""
    unit: str
    low: float
    high: float
    is_log: bool
    start: float
    """In the scenario; 1 for a factor."""
    parts: tuple[Parameter, ...]
    """Numbers of the scenario that a factor is on; one that is turned by itself."""
    is_factor: bool

    def at(self, u: float) -> float:
        """The number at a place between the bounds, from 0 to 1."""
        u = min(max(u, 0.0), 1.0)
        value = self.low * (self.high / self.low) ** u if self.is_log else self.low + u * (self.high - self.low)
        return min(max(value, self.low), self.high)

    def place(self, value: float) -> float:
        """Where between the bounds a number is; those beyond are at the nearest bound."""
        value = min(max(value, self.low), self.high)
        if self.is_log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def slope(self, u: float) -> float:
        """d value / d u."""
        return self.at(u) * math.log(self.high / self.low) if self.is_log else self.high - self.low

    def values(self, value: float) -> Iterator[tuple[str, float]]:
        """Keys and numbers of the scenario, those in lists with their place."""
        for part in self.parts:
            yield part.name, part.value * value if self.is_factor else value


class Knobs:
    """All that is turned.

    Args:
        knobs: one for each number.
        scenario: that they belong to, with all defaults written out.
    """

    def __init__(self, knobs: Sequence[Knob], scenario: Scenario) -> None:
        self.knobs = tuple(knobs)
        self._table = scenario.model_dump(exclude_none=True)

    def __len__(self) -> int:
        return len(self.knobs)

    @property
    def start(self) -> Array:
        """The scenario as it is, or what is nearest to it within the bounds, shape (n,)."""
        return np.array([knob.place(knob.start) for knob in self.knobs])

    def numbers(self, point: Array) -> list[float]:
        """The numbers at a point of the unit cube."""
        return [knob.at(float(u)) for knob, u in zip(self.knobs, point, strict=True)]

    def values(self, numbers: Sequence[float]) -> dict[str, Any]:
        """Keys of the scenario and their values with the numbers put in."""
        pairs = [
            pair for knob, number in zip(self.knobs, numbers, strict=True) for pair in knob.values(number)
        ]  # fmt: skip
        return values_at(pairs, self._table)


def rounded(knob: Knob, number: float) -> float:
    """The number as it is written, with a few digits, still within its bounds."""
    return min(max(float(f"{number:.{_DIGITS}g}"), knob.low), knob.high)


def read_knobs(file: StudyFile, table: Mapping[str, Any], setup: Setup) -> Knobs:
    """What `[tune]` turns.

    Raises:
        StudyError: a key is unknown, is no number, is there twice, has no room between its bounds, or the scenario
            does not take what is at one.
    """
    if not table:
        raise file.error("tune: there is nothing to turn; give a key of the scenario and its bounds.", ["tune"])
    knobs: list[Knob] = []
    taken: set[str] = set()
    for keys, entry in leaves(table, Turned):
        place, key = ["tune", *keys], ".".join(keys)
        own = file.section(Turned, entry, place)
        try:
            found = find_parameters(setup.scenario, setup.world, [key])
        except SofthandError as error:
            told = str(error).removeprefix("parameters: ")
            raise file.error(f"tune.{key}: {told}", place, key) from error
        parts = [one for one in found if isinstance(one, Parameter)]
        if not parts or any(isinstance(one.written, int) for one in parts):
            what = "no key of the scenario" if found == [WRENCH] else f"{show(parts[0].written)}, a whole number"
            raise file.error(f"tune.{key}: it is {what}; turn keys that have numbers with a point.", place, key)
        for one in parts:
            if one.name in taken:
                raise file.error(f"tune.{key}: {one.name} is turned twice.", place, key)
            taken.add(one.name)
        knobs += _knobs_of(own, parts)
    made = Knobs(knobs, setup.scenario)
    _check_ends(file, made, setup.asked)
    return made


def _knobs_of(own: Turned, parts: Sequence[Parameter]) -> list[Knob]:
    low, high = own.ends
    is_log = own.scale == "log"
    if own.factor is not None:
        name = parts[0].name if len(parts) == 1 else parts[0].key
        return [Knob(f"{name} (factor)", "1", low, high, is_log, 1.0, tuple(parts), True)]
    return [Knob(one.name, one.unit, low, high, is_log, one.value, (one,), False) for one in parts]


def _check_ends(file: StudyFile, made: Knobs, scenario: Scenario) -> None:
    """Each number at its bounds, the others as they are."""
    for k, knob in enumerate(made.knobs):
        for end in (knob.low, knob.high):
            numbers = [one.start for one in made.knobs]
            numbers[k] = end
            try:
                varied(scenario, made.values(numbers), 0)
            except SofthandError as error:
                told = str(error.__cause__ or error)
                raise file.error(f"tune: the scenario does not take {knob.name} = {end:g}: {told}", ["tune"]) from error


def leaves(
    table: Mapping[str, Any], cls: type[Settings], above: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Keys and entries of a table whose keys may be written as tables in tables."""
    for name, value in table.items():
        is_inner = isinstance(value, Mapping) and value and all(isinstance(one, Mapping) for one in value.values())
        if is_inner and not set(value) & set(cls.model_fields):
            yield from leaves(value, cls, (*above, name))
        else:
            yield (*above, name), value
