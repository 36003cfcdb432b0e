"""How far the gains of a controller, and the torques of its joints, may go before the loop is lost."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from softhand.errors import SofthandError
from softhand.margins.loop import Loop, close_loop, growth_of
from softhand.margins.place import Place
from softhand.margins.search import Range, stable_range
from softhand.numerics.arrays import Array

_AFFINE = 1e-6
"""Off a straight line by that share of its change, a feedback counts as on it."""
_FREQUENCIES = 400


class GainMargin(NamedTuple):
    """How far one gain may go."""

    name: str
    """A numeric setting of the controller, or `torque of JOINT`."""
    factors: Range
    """On its value."""


class DiskMargin(NamedTuple):
    """How far gain and phase of the torque of one joint may change at once, with the other loops closed."""

    joint: str
    margin: float
    """alpha = 1 / max |S - 1/2| of the sensitivity S at the joint; NaN for a loop that is not stable."""
    gain: float
    """Factor on the torque, or its inverse, (2 + alpha) / (2 - alpha); infinite from alpha = 2 on."""
    phase: float
    """Angle of the torque [deg], 2 atan(alpha / 2)."""


def numeric_settings(place: Place) -> dict[str, Any]:
    """Those of the controller that are numbers, or lists of numbers, other than its period, zeros and whole numbers."""
    values = dict(place.controller)
    return {name: value for name, value in values.items() if name != "period" and _is_gain(value)}


def _is_gain(value: Any) -> bool:
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
            return growth_of(affine(factor), loop.period)
        try:
            return at(factor).growth
        except SofthandError:  # the controller does not work with such a value
            return np.nan

    return GainMargin(name, stable_range(growth))


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


def joint_margins(loop: Loop) -> list[GainMargin]:
    """Factors on the torque that the controller gives one joint, and all of them, with which no motion grows."""
    names = ("all joints", *loop.inputs)
    rows = np.vstack([np.ones(len(loop.inputs)), np.eye(len(loop.inputs))])
    return [
        GainMargin(
            f"torque of {name}",
            stable_range(lambda factor, row=row: growth_of(loop.with_torque(1.0 + (factor - 1.0) * row), loop.period)),
        )
        for name, row in zip(names, rows, strict=True)
    ]


def disk_margins(loop: Loop) -> list[DiskMargin]:
    """Of each joint, at frequencies up to half that of sampling, those of the poles among them."""
    n, size = len(loop.inputs), len(loop.step)
    poles = np.linalg.eigvals(loop.step)
    angles = np.abs(np.angle(poles[np.abs(poles) > 1e-9]))
    angles = np.concatenate([np.geomspace(1e-5, np.pi, _FREQUENCIES), angles[angles > 1e-9]])
    push = np.vstack([loop.B, np.zeros((size - len(loop.A), n))])
    largest = np.zeros(n)
    for angle in angles:
        answer = np.linalg.solve(np.exp(1j * angle) * np.eye(size) - loop.step, push)
        S = 1.0 + np.einsum("ij,ji->i", loop.K, answer)
        largest = np.maximum(largest, np.abs(S - 0.5))
    found = []
    for joint, size_ in zip(loop.inputs, largest, strict=True):
        alpha = 1.0 / size_ if np.max(np.abs(poles)) < 1.0 + 1e-7 else np.nan
        gain = (2.0 + alpha) / (2.0 - alpha) if alpha < 2.0 else np.inf
        found.append(DiskMargin(joint, float(alpha), float(gain), float(np.degrees(2.0 * np.arctan(0.5 * alpha)))))
    return found
