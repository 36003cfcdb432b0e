"""Numbers of a scenario that a log may tell: keys, bounds, scales, and the scenario with others of them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from softhand.derivatives.parameters import WRENCH, find_parameters
from softhand.errors import ScenarioError
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.scenario.scenario import Scenario
from softhand.sensing.quantities import components

PLANT, BIAS, DELAY = "plant", "bias", "delay"

_FACTOR = 30.0  # by which a positive number may go up or down
_WORTH = {
    "joint_position": 0.02, "joint_velocity": 0.1, "object_position": 2e-3, "object_orientation": 0.02,
    "contact_force": 0.5, "contact_torsion": 5e-3,
}  # fmt: skip
_LENGTH = 3e-3  # [m], by which a place is worth to be known
_ENDLESS = -math.inf, math.inf
_TURN = 0.03  # [rad], likewise an orientation
_LATEST, _DELAY_WORTH = 0.01, 5e-3  # [s]
_STEP = 1e-6  # of the worth, for differences


class Parameter(NamedTuple):
    """A number that is fitted, as x = log(value) if it is positive, as x = value / worth if not.

    An error of x by 1 is the most that one may be content with: a factor of e, or the `worth`.
    """

    name: str
    key: str
    """Of the scenario."""
    kind: str
    """`PLANT`, or `BIAS` or `DELAY` of an instrument."""
    place: tuple[int | str, ...]
    """In the lists and tables that the key has."""
    value: float
    """Where the fit begins."""
    lower: float
    upper: float
    unit: str
    worth: float
    """0 for a positive number."""
    whole: Any
    """What the key has."""

    def to_x(self, value: float) -> float:
        """x of a value."""
        return math.log(value) if self.worth == 0.0 else value / self.worth

    def to_value(self, x: float) -> float:
        """The value of an x."""
        return math.exp(x) if self.worth == 0.0 else x * self.worth

    @property
    def quantity(self) -> str:
        """What the instrument measures, of `BIAS` and `DELAY`."""
        return self.key.split(".")[1]

    @property
    def component(self) -> int:
        """Of what the instrument measures, of `BIAS`."""
        return int(self.place[0])

    @property
    def step(self) -> float:
        """Of x, for differences."""
        return _STEP if self.kind != DELAY else 0.01


def choose(
    scenario: Scenario, world: World, names: Iterable[str], bounds: Mapping[str, tuple[float, float]]
) -> list[Parameter]:
    """The parameters of these names.

    Args:
        scenario: with the defaults of all plugins written out.
        world: that it makes.
        names: dotted keys or their last part; biases and delays of instruments as `sensing.QUANTITY.bias`, `.delay`.
        bounds: lowest and highest value by name or key, in place of those that are usual.

    Raises:
        ScenarioError: a key is unknown or no number, or a bound is none.
    """
    found: list[Parameter] = []
    for name in dict.fromkeys(names):
        parts = name.split(".")
        if len(parts) == 3 and parts[0] == "sensing" and parts[2].partition("[")[0] in (BIAS, DELAY):
            found += _of_instrument(scenario, world, name, parts)
            continue
        if name.startswith("hand.tips["):
            found += _of_tip(scenario, name)
            continue
        for one in find_parameters(scenario, world, [name]):
            if one == WRENCH or isinstance(one, str) or one.key.split(".")[0] in _OF_THE_RUN:
                what = WRENCH if isinstance(one, str) else one.key
                raise ScenarioError(
                    f"--fit {what}: is not of the hand, the tips, the object or an instrument, and the torques of a "
                    "log do without it; leave it out.",
                    key="fit", value=what,
                )  # fmt: skip
            found.append(_of_plant(one))
    for given in bounds:
        if not any(_is_named(one, given) for one in found):
            raise ScenarioError(
                f"bounds: {given} is not fitted; bounds are of {', '.join(one.name for one in found)}.",
                key="bounds", value=given,
            )  # fmt: skip
    return [_bounded(one, next((bounds[name] for name in bounds if _is_named(one, name)), None)) for one in found]


def _is_named(one: Parameter, name: str) -> bool:
    """By its name, its key, or the last part of one."""
    return any(name == own or own.endswith(f".{name}") for own in (one.name, one.key))


_OF_THE_RUN = ("controller", "reference", "grasp", "duration", "control_period", "stepper", "record", "push", "sensing")


def _of_plant(one: Any) -> Parameter:
    is_place = one.unit == "m" and one.place
    worth = 0.0 if one.value > 0.0 and not is_place else _LENGTH if one.unit == "m" else max(abs(one.value), 1.0)
    lower, upper = (one.value / _FACTOR, one.value * _FACTOR) if worth == 0.0 else (-math.inf, math.inf)
    if one.key.endswith((".nu", ".poisson")):
        upper = 0.5
    return Parameter(one.name, one.key, PLANT, one.place, one.value, lower, upper, one.unit, worth, one.whole)


def _of_tip(scenario: Scenario, name: str) -> list[Parameter]:
    """Place or orientation of a tip on its link, `hand.tips[0].position` or one number of it."""
    tips = scenario.model_dump()["hand"]["tips"]
    said = re.fullmatch(r"hand\.tips\[(\d+)\]\.(position|rpy)(?:\[([012])\])?", name)
    if said is None or int(said[1]) >= len(tips):
        raise ScenarioError(
            f"--fit {name}: there are hand.tips[0] to hand.tips[{len(tips) - 1}], each with position and rpy, of which "
            "[0] to [2] are the numbers.",
            key="fit", value=name,
        )  # fmt: skip
    tip, what = int(said[1]), said[2]
    if isinstance(tips[tip], str):
        raise ScenarioError(
            f"--fit {name}: the tip is a frame of the URDF, {tips[tip]!r}; to fit its place write it as a table in "
            "hand.tips, { frame = LINK, position = [0, 0, 0] }.",
            key="fit", value=name,
        )  # fmt: skip
    whole = [{key: one for key, one in each.items() if one is not None} if isinstance(each, dict) else each
             for each in tips]  # fmt: skip
    unit, worth = ("m", _LENGTH) if what == "position" else ("rad", _TURN)
    start = [float(number) for number in whole[tip][what]]
    every = [
        Parameter(
            f"hand.tips[{tip}].{what}[{k}]", "hand.tips", PLANT, (tip, what, k), one, *_ENDLESS, unit, worth, whole
        )
        for k, one in enumerate(start)
    ]
    return [one for one in every if said[3] is None or one.place[-1] == int(said[3])]


def _of_instrument(scenario: Scenario, world: World, name: str, parts: Sequence[str]) -> list[Parameter]:
    quantity, (what, _, place) = parts[1], parts[2].partition("[")
    if quantity not in _WORTH:
        raise ScenarioError(
            f"--fit {name}: a log holds no {quantity}; it may hold {', '.join(_WORTH)}.", key="fit", value=name
        )
    section = getattr(scenario.sensing, quantity, None) if scenario.sensing is not None else None
    key = f"sensing.{quantity}.{what}"
    if what == DELAY:
        value = section.delay if section is not None else 0.0
        return [Parameter(key, key, DELAY, (), value, 0.0, _LATEST, "s", _DELAY_WORTH, value)]
    size = components(world.n_joints, world.n_tips)[quantity]
    given = section.bias if section is not None else 0.0
    whole = bias_of(given, size)
    unit = "N m" if quantity == "contact_torsion" else "N" if quantity == "contact_force" else (
        "m" if quantity == "object_position" else "rad/s" if quantity == "joint_velocity" else "rad")  # fmt: skip
    every = [
        Parameter(
            f"{key}[{k}]", key, BIAS, (k,), float(whole[k]), -math.inf, math.inf, unit, _WORTH[quantity], list(whole)
        )
        for k in range(size)
    ]
    chosen = [one for one in every if not place or one.name == name]
    if not chosen:
        raise ScenarioError(f"--fit {name}: there are {every[0].name} to {every[-1].name}.", key="fit", value=name)
    return chosen


def bias_of(given: Any, size: int) -> Array:
    """A bias as a number each: one for all, or a list that is repeated, as three for all tips."""
    return np.resize(np.asarray(given, dtype=float), size)


def _bounded(one: Parameter, bounds: tuple[float, float] | None) -> Parameter:
    if bounds is None:
        return one
    lower, upper = bounds
    if not lower <= one.value <= upper or not lower < upper or (one.worth == 0.0 and not lower > 0.0):
        raise ScenarioError(
            f"bounds of {one.name}: got {lower:g} to {upper:g}; the lower must be below the upper"
            f"{', above 0' * (one.worth == 0.0)}, and {one.value:g}, which the scenario has, between.",
            key="bounds", value=bounds,
        )  # fmt: skip
    return one._replace(lower=float(lower), upper=float(upper))


def values_of(parameters: Sequence[Parameter], x: Array) -> Array:
    """Values of parameters at some x."""
    return np.array([one.to_value(value) for one, value in zip(parameters, x, strict=True)])


def keyed(parameters: Sequence[Parameter], values: Sequence[float] | Array) -> dict[str, Any]:
    """Values by key, those of a list put together, for `Scenario.with_values`."""
    table: dict[str, Any] = {}
    for one, value in zip(parameters, values, strict=True):
        table[one.key] = _put(table.get(one.key, one.whole), one.place, float(value))
    return table


def _put(whole: Any, place: tuple[int | str, ...], value: float) -> Any:
    if not place:
        return value
    if isinstance(whole, Mapping):
        return {key: _put(part, place[1:], value) if key == place[0] else part for key, part in whole.items()}
    return [_put(part, place[1:], value) if k == place[0] else part for k, part in enumerate(whole)]
