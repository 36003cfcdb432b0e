"""References in plain Python: asked anew at each time, with rates from differences, and checked."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from softhand.errors import ScenarioError, SimulationStopped, SofthandError
from softhand.numerics.arrays import Array
from softhand.references.goal import Goal

_APART = 1e-4  # [s] between the times of a difference


def sample(name: str, at: Callable[[float], Goal], now: Array) -> Callable[[float], None]:
    """What fills `now` for a time.

    Args:
        name: of the reference, for messages.
        at: gives the goal at a time [s].
        now: values, rates, accelerations, each in the order of `Goal.row`, shape (3, 6 + pairs + 2).

    Raises:
        ScenarioError: it fails at the start. Later it ends the run as `SimulationStopped`.
    """

    def move(time: float) -> None:
        try:
            _fill(at, time, now)
        except SofthandError:
            raise
        except Exception as error:
            what = f"fails: {error}" if isinstance(error, _Refused) else f"raised {type(error).__name__}: {error}"
            message = f"reference '{name}' {what} (at t = {time:g} s)."
            raise SimulationStopped(message, reason="reference", time=time) from error

    try:
        move(0.0)
    except SimulationStopped as stop:
        raise ScenarioError(str(stop), key="reference.kind", value=name) from stop
    return move


def _fill(at: Callable[[float], Goal], time: float, now: Array) -> None:
    goal = at(time)
    if not isinstance(goal, Goal):
        raise _Refused(f"it returned {goal!r}, but a Goal is needed")
    now[0], now[1:] = _row(goal, now), 0.0
    if goal.rate is not None and goal.acceleration is not None:
        now[1, :6], now[2, :6] = goal.rate, goal.acceleration
    else:
        before, after = (_row(at(time + step), now) for step in (-_APART, _APART))
        rate, bend = (after - before) / (2.0 * _APART), (after - 2.0 * now[0] + before) / _APART**2
        now[1, :6] = rate[:6] if goal.rate is None else goal.rate
        now[2, :6] = bend[:6] if goal.acceleration is None else goal.acceleration
    if not np.isfinite(now).all():
        raise _Refused("NaN or infinity is asked for")


def _row(goal: Goal, now: Array) -> Array:
    row, pairs = goal.row(), now.shape[1] - 8
    if row.shape != now.shape[1:] or np.size(goal.coordinates) != 6:
        raise _Refused(
            f"{np.size(goal.coordinates)} coordinates and {np.size(goal.internal_force)} internal forces are asked "
            f"for; 6 and {pairs} are needed"
        )
    return row


class _Refused(ValueError):
    """A goal that cannot be asked for."""
