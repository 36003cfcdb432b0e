"""How far the gains of a controller, and the torques of its joints, may go before the loop is lost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from softhand.errors import SofthandError
from softhand.margins.loop import Loop, close_loop, growth_of, is_stable
from softhand.margins.place import Place
from softhand.margins.search import Range, stable_range
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record

_AFFINE = 1e-6
"""Off a straight line by that share of its change, a feedback counts as on it."""
_FREQUENCIES, _SLOWEST = 400, 1e-5
"""At which a disk margin is looked for, and the slowest [rad] a period."""


@dataclass(frozen=True)
class GainMargin(Record):
    """How far one setting of a controller may go.

    Attributes:
        name: of the setting.
        value: now, in its unit.
        factors: on it, with which no motion grows.
    """

    units: ClassVar = {"value": "SI, of the setting", "factors": "1"}

    name: str
    value: Any
    factors: Range


@dataclass(frozen=True)
class JointMargin(Record):
    """How far the torque that a controller gives one joint may be off, what is held at rest left as it is.

    Attributes:
        joint: its name, or `all joints` for all at once.
        factors: on the torque, with which no motion grows; the loops of the other joints are as they are.
        disk: alpha = 1 / max |S - 1/2| of the sensitivity S at the joint; NaN for a loop that is not stable,
            for one whose periods are not alike, and for all joints at once.
        gain: a factor on the torque, or its inverse, with which a loop of that disk margin is stable whatever the phase
            within `phase` is: (2 + alpha) / (2 - alpha), infinite from alpha = 2 on.
        phase: the angle by which it may be late, whatever the factor within `gain` is: 2 atan(alpha / 2).
    """

    units: ClassVar = {"factors": "1", "disk": "1", "gain": "1", "phase": "deg"}

    joint: str
    factors: Range
    disk: float = np.nan
    gain: float = np.nan
    phase: float = np.nan


def numeric_settings(place: Place) -> dict[str, Any]:
    """Those of the controller that are numbers, or lists of numbers, other than its period, zeros and whole numbers."""
    values = dict(place.controller)
    return {name: value for name, value in values.items() if name != "period" and is_gain(value)}


def is_gain(value: Any) -> bool:
    """Whether a setting is a number with a fraction, or a list of such, and not zero."""
    if isinstance(value, tuple | list):
        return bool(value) and all(isinstance(one, float) for one in value) and any(value)
    return isinstance(value, float) and value != 0.0


def times(factor: float, value: Any) -> Any:
    """A number, or each of a list, multiplied."""
    return type(value)(factor * one for one in value) if isinstance(value, tuple | list) else factor * value


def gain_margin(loop: Loop, place: Place, name: str) -> GainMargin:
    """Factors on one setting of the controller with which no motion grows."""
    value = getattr(place.controller, name)

    def at(factor: float) -> Loop:
        controller = place.controller.model_copy(update={name: times(factor, value)})
        return close_loop(place, controller=controller)

    affine = _affine(loop, at)

    def growth(factor: float) -> float:
        if affine is not None:
            return growth_of(affine(factor), loop.cycle)
        try:
            return at(factor).growth
        except SofthandError:  # the controller does not work with such a value
            return np.nan

    return GainMargin(name, value, stable_range(growth))


def _affine(loop: Loop, at: Callable[[float], Loop]) -> Callable[[float], Array] | None:
    """The loop with any factor, where it is straight in it: to be asked twice in place of a hundred times."""
    try:
        none, half, double = at(0.0).step, at(0.5).step, at(2.0).step
    except SofthandError:
        return None
    if not none.shape == half.shape == double.shape == loop.step.shape:
        return None
    rise = loop.step - none
    scale = np.max(np.abs(rise))
    off = max(np.max(np.abs(half - none - 0.5 * rise)), np.max(np.abs(double - none - 2.0 * rise)))
    return (lambda factor: none + factor * rise) if off <= _AFFINE * scale else None


def joint_margins(loop: Loop) -> tuple[JointMargin, ...]:
    """Of all joints at once, then of each."""
    ones = np.ones(len(loop.inputs))
    found = [JointMargin("all joints", _torque_range(loop, ones))]
    for joint, row, disk in zip(loop.inputs, np.diag(ones), _disks(loop), strict=True):
        gain = (2.0 + disk) / (2.0 - disk) if not disk >= 2.0 else np.inf
        phase = np.degrees(2.0 * np.arctan(0.5 * disk))
        found.append(JointMargin(joint, _torque_range(loop, row), float(disk), float(gain), float(phase)))
    return tuple(found)


def _torque_range(loop: Loop, row: Array) -> Range:
    return stable_range(lambda factor: growth_of(loop.with_torque(1.0 + (factor - 1.0) * row), loop.cycle))


def _disks(loop: Loop) -> Array:
    """alpha of each joint, over frequencies up to half that of sampling, those of the poles among them."""
    n, size = len(loop.inputs), len(loop.step)
    poles = np.linalg.eigvals(loop.step)
    if not is_stable(loop.growth) or loop.later:
        return np.full(n, np.nan)
    angles = np.abs(np.angle(poles[np.abs(poles) > 1e-9]))
    angles = np.concatenate([np.geomspace(_SLOWEST, np.pi, _FREQUENCIES), angles[angles > _SLOWEST]])
    push = np.vstack([loop.B, np.zeros((size - len(loop.A), n))])
    largest = np.zeros(n)
    for angle in angles:
        answer = np.linalg.solve(np.exp(1j * angle) * np.eye(size) - loop.step, push)
        largest = np.maximum(largest, np.abs(0.5 + np.einsum("ij,ji->i", loop.K, answer)))
    return 1.0 / largest
