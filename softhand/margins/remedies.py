"""What keeps small motions from growing: single changes of a scenario, each tried on the linear loop."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from softhand.dampings.damping import Damping
from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.margins.gains import is_gain, times
from softhand.margins.loop import NEUTRAL, close_loop
from softhand.margins.place import Place

_SMALL, _LARGE = (0.5, 2.0), (0.25, 4.0, 0.125, 8.0, 16.0)  # factors on a gain
_SHORTER = (2, 4, 5, 10)
_SURE = -0.05  # [1/s] a rate that is below zero beyond doubt; one may also be zero, that of an estimate say
_ENOUGH = 2


@dataclass(frozen=True)
class Remedy:
    """A change of one setting.

    Attributes:
        setting: as a line of TOML with its dotted key.
        rate: of the fastest growing, or slowest dying, motion with it [1/s].
    """

    setting: str
    rate: float


def find_remedies(poses: Sequence[Place]) -> list[Remedy]:
    """At most two single changes with which no small motion about some poses grows, the gentler ones first.

    A gain of the controller halved or doubled, tips that damp, a control period down to a tenth, other factors.
    """
    gains = {name: value for name, value in dict(poses[0].controller).items() if name != "period" and is_gain(value)}
    found: dict[str, Remedy] = {}
    for name, setting, changed in _changes(poses, gains):
        rate = math.inf if name in found else _slowest(changed)
        if _holds(rate):
            found[name] = Remedy(setting, rate)
        if len(found) == _ENOUGH:
            break
    return list(found.values())


def _changes(poses: Sequence[Place], gains: Mapping[str, Any]) -> Iterator[tuple[str, str, Sequence[Place]]]:
    """What is changed, the setting, and the poses with it."""
    yield from _other_gains(poses, gains, _SMALL)
    if all(type(tip.damping) is Damping for tip in poses[0].setup.fingertips):
        yield "damping", 'fingertip.damping = {name = "kelvin-voigt"}', [_damped(pose) for pose in poses]
    key = "control_period" if poses[0].controller.period is None else "controller.period"
    for share in _SHORTER:
        period = poses[0].period / share
        setting = f"{key} = {period:g} and stepper.step = {period:g}"
        yield key, setting, [replace(pose, held=period) for pose in poses]
    yield from _other_gains(poses, gains, _LARGE)


def _other_gains(
    poses: Sequence[Place], gains: Mapping[str, Any], factors: Sequence[float]
) -> Iterator[tuple[str, str, Sequence[Place]]]:
    for factor in factors:
        for name, value in gains.items():
            other = times(factor, value)
            changed = poses[0].controller.model_copy(update={name: other})
            yield name, f"controller.{name} = {_shown(other)}", [pose.with_controller(changed) for pose in poses]


def _slowest(poses: Sequence[Place]) -> float:
    """Largest rate at any of the poses, or the first that is not below zero [1/s]."""
    slowest = -math.inf
    for pose in poses:
        try:
            slowest = max(slowest, close_loop(pose).growth)
        except Exception:  # the controller cannot be asked with such a value
            return math.inf
        if not _holds(slowest):
            break
    return slowest


def _holds(rate: float) -> bool:
    return rate < _SURE or abs(rate) < NEUTRAL


def _shown(value: Any) -> str:
    return f"[{', '.join(f'{one:g}' for one in value)}]" if isinstance(value, tuple) else f"{value:g}"


def _damped(pose: Place) -> Place:
    """The pose with tips that damp; at rest they press as before."""
    tips = [replace(tip, damping=KelvinVoigt()) for tip in pose.setup.fingertips]
    return replace(pose, setup=replace(pose.setup, fingertips=tips))
