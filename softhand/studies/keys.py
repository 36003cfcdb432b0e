"""Keys of a study: those of a scenario, and single numbers of its lists, `object.position[0]`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from softhand.errors import ScenarioError
from softhand.scenario.keywords import full_keys
from softhand.scenario.scenario import Scenario
from softhand.settings.wording import show

_KEY = re.compile(r"([^\[\]]+)((?:\[\d{1,6}\])*)")


def split_key(key: str) -> tuple[str, tuple[int, ...]]:
    """The key of a scenario, and the places in its list, counted from 0: `grasp.contact_points[1][0]` has two.

    Raises:
        ScenarioError: brackets that hold no whole number.
    """
    found = _KEY.fullmatch(key)
    if not found:
        raise ScenarioError(
            f"{show(key)} is no key; a key is like object.mass, a number of a list like object.position[0].",
            key=key, value=key,
        )  # fmt: skip
    return found[1], tuple(map(int, re.findall(r"\d+", found[2])))


def full_key(key: str, table: Mapping[str, Any]) -> str:
    """The key with its section: `mass` is `object.mass`.

    Args:
        key: dotted, or the last part of one, with places or without.
        table: the scenario as tables.

    Raises:
        ScenarioError: no key of the scenario ends so, or several do, or its value has no such place.
    """
    word, places = split_key(key)
    if "." not in word and word not in table:
        word = next(iter(full_keys({word: None}, table, Scenario)))
    if places:
        _put(_look_up(word, table), places, 0.0, word)
    return word + "".join(f"[{place}]" for place in places)


def values_at(values: Iterable[tuple[str, Any]], table: Mapping[str, Any]) -> dict[str, Any]:
    """Values by keys of the scenario alone; numbers at a place of a list are put into the list that is there.

    Args:
        values: full keys and values; whole lists before numbers in them.
        table: the scenario as tables.
    """
    found: dict[str, Any] = {}
    for key, value in values:
        word, places = split_key(key)
        if places:
            found[word] = _put(found[word] if word in found else _look_up(word, table), places, value, word)
        else:
            found[word] = value
    return found


def _look_up(word: str, table: Any) -> Any:
    for part in word.split("."):
        table = table.get(part) if isinstance(table, Mapping) else None
    return table


def _put(values: Any, places: tuple[int, ...], value: Any, word: str) -> Any:
    """The list with another value at a place."""
    if not places:
        return value
    if not isinstance(values, list | tuple):
        raise ScenarioError(f"{word} is {show(values)} in the scenario, which is no list.", key=word, value=values)
    place, *rest = places
    if place >= len(values):
        raise ScenarioError(
            f"{word} has {len(values)} entries, counted from 0; there is none at [{place}].", key=word, value=place
        )
    changed = list(values)
    changed[place] = _put(changed[place], tuple(rest), value, word)
    return tuple(changed)
