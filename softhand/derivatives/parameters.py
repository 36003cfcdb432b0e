"""Parameters of a scenario as numbers that can be moved: which there are, and the scenario with one of them moved."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.derivatives.situation import Situation
from softhand.errors import ScenarioError
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
    place: int | None
    """In the list that the key has; None for a key that has one number."""
    value: float
    step: float
    """Of its differences."""
    unit: str
    whole: Any
    """What the key has."""

    def moved(self, amount: float) -> dict[str, Any]:
        """The key with the number moved, for `Scenario.with_values`."""
        if self.place is None:
            return {self.key: self.value + amount}
        values = list(self.whole)
        values[self.place] += amount
        return {self.key: values}


def find_parameters(situation: Situation, names: Iterable[str]) -> list[Parameter | str]:
    """Parameters by key, and `WRENCH` as it is.

    Args:
        situation: of the scenario.
        names: dotted keys, or the last part of one; a key that has a list of numbers gives one parameter each.

    Raises:
        ScenarioError: there is no such key, or its value is no number; names what is near.
    """
    scenario = situation.setup.scenario
    table = scenario.model_dump(exclude_none=True)
    known = [*all_keys(table, Scenario), WRENCH]
    found: list[Parameter | str] = []
    for name in dict.fromkeys([names] if isinstance(names, str) else names):
        if name == WRENCH:
            found.append(WRENCH)
            continue
        key = _key(name, table, known)
        whole = _value(key, table)
        if whole is None and key == "object.mass":
            model = situation.plant.world.model
            whole = float(model.inertias[situation.plant.world.object_joint].mass)
            scenario = scenario.with_values({key: whole})
        found += _numbers(key, whole, _unit(scenario, situation.slides, key))
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
    if _is_number(whole):
        value = float(whole)
        return [Parameter(key, key, None, value, _SHARE * abs(value) or _LEAST, unit, whole)]
    if isinstance(whole, list | tuple) and whole and all(map(_is_number, whole)):
        step = _SHARE * max(abs(float(value)) for value in whole) or _LEAST
        return [Parameter(f"{key}[{k}]", key, k, float(value), step, unit, whole) for k, value in enumerate(whole)]
    what = "is not set" if whole is None else f"is {show(whole)}"
    remedy = "set it in the scenario" if whole is None else "choose a key whose value is a number"
    raise ScenarioError(f"parameters: {key} {what}, which is no number; {remedy}.", key="parameters", value=key)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
