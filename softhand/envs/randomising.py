"""Worlds that differ: masses, friction and stiffness drawn about those of a scenario."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from softhand.assembly.resolve import Setup
from softhand.assembly.variations import Variations
from softhand.errors import GraspError, ScenarioError
from softhand.scenario.scenario import Scenario
from softhand.settings.guesses import did_you_mean

SHORT = ("mass", "friction", "stiffness")
"""Names for what is varied most: mass of the object, friction of the tips, all their stiffnesses by one factor."""

_STIFFNESSES = ("E", "K", "c_d")
"""Of fingertip laws, beside all that begin with k."""
_TRIES = 100  # draws until one has a grasp at rest


class Draw:
    """Draws values about those of a scenario: value * (1 + x u) with u uniform in [-1, 1].

    Args:
        scenario: about which.
        mass: of its object [kg], which the URDF may have told.
        spread: x by `SHORT` or by dotted keys of the scenario, each in [0, 1).

    Raises:
        ScenarioError: there is no such number in the scenario, or x is none.
    """

    def __init__(self, scenario: Scenario, mass: float, spread: Mapping[str, float]) -> None:
        table = scenario.model_dump(exclude_none=True)
        table["object"]["mass"] = mass
        self._groups: list[tuple[float, dict[str, float]]] = []
        for name in sorted(spread):
            x = spread[name]
            if not 0.0 <= x < 1.0:
                raise ScenarioError(
                    f"randomise.{name}: got {x!r}; give the largest share by which it changes, at least 0, below 1.",
                    key=f"randomise.{name}", value=x,
                )  # fmt: skip
            self._groups.append((float(x), _numbers(name, table)))

    @property
    def draws(self) -> bool:
        """Whether worlds differ at all."""
        return bool(self._groups)

    def values(self, rng: np.random.Generator) -> dict[str, float]:
        """Values by dotted key."""
        found: dict[str, float] = {}
        for spread, numbers in self._groups:
            factor = 1.0 + spread * rng.uniform(-1.0, 1.0)
            found.update({key: value * factor for key, value in numbers.items()})
        return found

    def setup(self, rng: np.random.Generator, variations: Variations) -> tuple[Setup, dict[str, float]]:
        """A world that has a start, and its values; what has none is drawn again.

        Raises:
            GraspError: a hundred had none.
        """
        for last in range(_TRIES - 1, -1, -1):
            values = self.values(rng)
            try:
                return variations.at(values), values
            except GraspError as error:
                if not last or not values:
                    raise GraspError(
                        f"randomise: no world of {_TRIES} that were drawn has a grasp at rest; the last: {error}"
                        if values else str(error),
                        finger=error.finger, quantity=error.quantity, value=error.value,
                    ) from error  # fmt: skip
        raise AssertionError


def _numbers(name: str, table: Mapping[str, Any]) -> dict[str, float]:
    """What is varied under a name, by dotted key."""
    tip = table["fingertip"]
    known = {
        "mass": {"object.mass": table["object"]["mass"]},
        "friction": {f"fingertip.{key}": tip.get(key) for key in ("friction", "static_friction")},
        "stiffness": {f"fingertip.{key}": tip[key] for key in tip if key[0] == "k" or key in _STIFFNESSES},
    }
    numbers = {key: value for key, value in known.get(name, {name: _value(name, table)}).items() if _is_number(value)}
    if not numbers:
        near = did_you_mean(name, [*SHORT, *_keys(table)])
        raise ScenarioError(
            f"randomise.{name}: there is no such number in the scenario{near}; give {', '.join(SHORT)} or a dotted key "
            "whose value it has, such as object.mass.",
            key=f"randomise.{name}", value=name,
        )  # fmt: skip
    return numbers


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _value(key: str, table: Any) -> Any:
    for part in key.split("."):
        table = table.get(part) if isinstance(table, Mapping) else None
    return table


def _keys(table: Mapping[str, Any], above: str = "") -> list[str]:
    """Dotted keys of all numbers."""
    found = []
    for key, value in table.items():
        if isinstance(value, Mapping):
            found += _keys(value, f"{above}{key}.")
        elif _is_number(value):
            found.append(above + key)
    return found
