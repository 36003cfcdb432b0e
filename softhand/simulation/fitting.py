"""Whether a state is one that a simulation can go on from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from softhand.errors import ScenarioError
from softhand.numerics.arrays import AnyArray
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.simulation.touched import CARRIED
from softhand.steppers.stepper import Integration

_OF_INSTRUMENTS = ("instruments", "command", "drive line", "drive state", *CARRIED)


def must_fit(state: State, mine: State, plant: Plant, integration: Integration, loop: Mapping[str, AnyArray]) -> None:
    """Refuse a state of another plant, or one that another stepper or other instruments left.

    Args:
        state: given.
        mine: a state of this plant.
        plant: where it shall go on.
        integration: the stepper that shall go on from it.
        loop: what its instruments and drives remember.

    Raises:
        ScenarioError: naming what does not fit.
    """
    for name, ours, given in zip("qvz", mine.arrays, state.arrays, strict=True):
        if ours.shape != given.shape:
            raise _misfit(name, given.shape, f"it has shape {given.shape}, but that of this plant is {ours.shape}")
        if not np.all(np.isfinite(given)):
            raise _misfit(name, given, f"it has NaN or infinity, {given.tolist()}")
    if state.carried is None:
        return
    if state.carried.names != plant.names:
        saved, here = ", ".join(state.carried.names), ", ".join(plant.names)
        raise _misfit("carried", saved, f"its joints and contacts are {saved}, but those of this plant are {here}")
    remembered = {name: array for name, array in state.carried.loop.items() if name in _OF_INSTRUMENTS}
    for what, carried, own in (
        ("plant", state.carried.plant, plant.carry()),
        ("stepper", state.carried.stepper, integration.carry()),
        ("[sensing], [actuation] or [tactile]", remembered, loop),
    ):
        if _layout(carried) != _layout(own):
            again = "State(state.q, state.v, state.z, state.time) starts afresh from it"
            raise _misfit("carried", what, f"it was saved with another {what}; {again}")


def periods_until(time: float, period: float) -> int:
    """Control periods before a time [s].

    Raises:
        ScenarioError: it is no whole number of them.
    """
    periods = round(time / period) if np.isfinite(time) else -1
    if periods < 0 or abs(periods * period - time) > 1e-9 * max(1.0, time):
        raise _misfit("time", time, f"{time:g} s is no whole number of control periods of {period:g} s")
    return periods


def _layout(carried: Mapping[str, AnyArray]) -> dict[str, tuple[tuple[int, ...], np.dtype]]:
    return {name: (array.shape, array.dtype) for name, array in carried.items()}


def _misfit(name: str, value: Any, why: str) -> ScenarioError:
    return ScenarioError(f"state.{name}: {why}.", key=f"state.{name}", value=value)
