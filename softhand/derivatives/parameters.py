"""Parameters of a scenario as numbers that can be moved: which there are, and the scenario with one of them moved."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.errors import ScenarioError
from softhand.model.world import World
from softhand.recording.units import slides_in
from softhand.scenario.keywords import all_keys, full_keys
from softhand.scenario.scenario import Scenario
from softhand.scenario.values import list_values
from softhand.settings.guesses import did_you_mean
from softhand.settings.wording import show

WRENCH = "wrench"
"""The parameter that is a force and a moment on the object, at the origin of its frame, world axes."""

WRENCH_UNITS = ("N", "N", "N", "N m", "N m", "N m")
WRENCH_NAMES = tuple(f"{WRENCH} {what} {axis}" for what in ("force", "moment") for axis in "xyz")

_SHARE = 2e-4  # of a value, its step
_LEAST = 1e-6  # step of a value that is zero
_LOOP = ("duration", "control_period", "stepper.step", "controller.period", "record.every")


class Parameter(NamedTuple):
    """One number of a scenario."""

    name: str
    key: str
    place: tuple[int, ...]
    """In the list that the key has, or in the lists of it; empty for a key that has one number."""
    value: float
    step: float
    """Of its differences."""
    unit: str
    whole: Any
    """What the key has."""

    def moved(self, amount: float) -> dict[str, Any]:
        """The key with the number moved, for `Scenario.with_values`."""
        return {self.key: _beside(self.whole, self.place, amount)}

    @property
    def written(self) -> Any:
        """The number as the scenario has it."""
        number = self.whole
        for k in self.place:
            number = number[k]
        return number


def _beside(whole: Any, place: tuple[int, ...], amount: float) -> Any:
    """Lists, or a number, with one number of them moved."""
    if not place:
        return whole + amount
    first, *rest = place
    return [_beside(part, tuple(rest), amount) if k == first else part for k, part in enumerate(whole)]


def find_parameters(scenario: Scenario, world: World, names: Iterable[str]) -> list[Parameter | str]:
    """Parameters by key, and `WRENCH` as it is.

    Args:
        scenario: with the defaults of all plugins written out.
        world: that it makes.
        names: dotted keys, or the last part of one; a key that has a list of numbers gives one parameter each, or
            those of a place in it, `contact_points[0][1]`.

    Raises:
        ScenarioError: there is no such key, or its value is no number; names what is near.
    """
    slides = np.array([name in slides_in(world.hand_text) for name in world.joint_names])
    table = scenario.model_dump(exclude_none=True)
    known = [*all_keys(table, Scenario), WRENCH]
    found: list[Parameter | str] = []
    for name in dict.fromkeys([names] if isinstance(names, str) else names):
        if name == WRENCH:
            found.append(WRENCH)
            continue
        stem, bracket, rest = name.partition("[") if isinstance(name, str) else (name, "", "")
        key = _key(stem, table, known)
        whole = _value(key, table)
        if whole is None and key == "object.mass":
            whole = float(world.model.inertias[world.object_joint].mass)
            scenario = scenario.with_values({key: whole})
        every = _numbers(key, whole, _unit(scenario, slides, key))
        chosen = f"{key}{bracket}{rest}"
        some = [one for one in every if not bracket or one.name == chosen or one.name.startswith(f"{chosen}[")]
        if not some:
            raise ScenarioError(
                f"parameters: {name} is no part of {key}; there are {every[0].name} to {every[-1].name}.",
                key="parameters", value=name,
            )  # fmt: skip
        found += some
    return found


def _key(name: str, table: Mapping[str, Any], known: list[str]) -> str:
    if not isinstance(name, str):
        raise ScenarioError(
            f"parameters: {name!r} is no name; give dotted keys of the scenario.", key="parameters", value=name
        )
    if name not in known and "." not in name:
        try:
            return next(iter(full_keys({name: None}, table, Scenario)))
        except ScenarioError as error:
            raise ScenarioError(f"parameters: {error}", key="parameters", value=name) from error
    if name not in known:
        hint = did_you_mean(name, known) or "; `softhand schema` tells all keys."
        raise ScenarioError(f"parameters: {name!r} is no key of the scenario{hint}", key="parameters", value=name)
    if name in _LOOP:
        raise ScenarioError(
            f"parameters: {name} counts the steps of a period, which no derivative goes along; leave it out.",
            key="parameters", value=name,
        )  # fmt: skip
    return name


def _value(key: str, table: Any) -> Any:
    for part in key.split("."):
        table = table.get(part) if isinstance(table, Mapping) else None
    return table


def _unit(scenario: Scenario, slides: NDArray[np.bool_], key: str) -> str:
    """Unit of a key; "" where its plugin is not known by name."""
    try:
        values = list_values(scenario, slides)
    except ScenarioError:
        return ""
    return next((unit for name, _, unit in values if name == key), "")


def _numbers(key: str, whole: Any, unit: str) -> list[Parameter]:
    places = list(_places(whole))
    if places and all(_is_number(number) for _, number in places):
        step = _SHARE * max(abs(float(number)) for _, number in places) or _LEAST
        return [
            Parameter(key + "".join(f"[{k}]" for k in place), key, place, float(number), step, unit, whole)
            for place, number in places
        ]
    what = "is not set" if whole is None else f"is {show(whole)}"
    remedy = "set it in the scenario" if whole is None else "choose a key whose value is a number"
    raise ScenarioError(f"parameters: {key} {what}, which is no number; {remedy}.", key="parameters", value=key)


def _places(whole: Any, before: tuple[int, ...] = ()) -> Iterator[tuple[tuple[int, ...], Any]]:
    """Where in lists, and lists of lists, what lies."""
    if not isinstance(whole, list | tuple):
        yield before, whole
        return
    for k, part in enumerate(whole):
        yield from _places(part, (*before, k))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
