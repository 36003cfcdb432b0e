"""References in plain Python: asked anew at each time, with rates from differences, and checked."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from softhand.errors import ScenarioError, SimulationStopped, SofthandError
from softhand.numerics.arrays import Array
from softhand.numerics.rotations import rotation_vector, turning_to_rates
from softhand.numerics.spatial import rotation_of
from softhand.references.goal import Goal
from softhand.references.legs import complete
from softhand.settings.failures import failure

_APART = 1e-4  # [s] between the times of a difference


def sample(name: str, at: Callable[[float], Goal], now: Array, twist: Array) -> Callable[[float], None]:
    """What fills `now` and `twist` for a time.

    Args:
        name: of the reference, for messages.
        at: gives the goal at a time [s].
        now: values, rates, accelerations, each in the order of `Goal.row`, shape (3, 11 + pairs).
        twist: of the object, world axes, and its rate, shape (2, 6).

    Raises:
        ScenarioError: it fails at the start. Later it ends the run as `SimulationStopped`.
    """

    def move(time: float) -> None:
        try:
            _fill(at, time, now, twist)
        except SofthandError:
            raise
        except (Exception, SystemExit) as error:
            what = f"fails: {error}" if isinstance(error, _Refused) else f"raised {failure(error)}"
            message = f"reference '{name}' {what} (at t = {time:g} s)."
            raise SimulationStopped(message, reason="reference", time=time) from error

    try:
        move(0.0)
    except SimulationStopped as stop:
        raise ScenarioError(str(stop), key="reference.kind", value=name) from stop
    return move


def _fill(at: Callable[[float], Goal], time: float, now: Array, twist: Array) -> None:
    goal = at(time)
    if not isinstance(goal, Goal):
        raise _Refused(f"it returned {goal!r}, but a Goal is needed")
    now[0], now[1:] = _row(goal, now), 0.0
    if goal.rate is None or goal.acceleration is None or np.any(goal.standoff):
        _difference(_row(at(time - _APART), now), _row(at(time + _APART), now), now, twist)
    if goal.rate is not None:
        now[1, :6] = goal.rate
    if goal.acceleration is not None:
        now[2, :6] = goal.acceleration
    if goal.rate is not None or goal.acceleration is not None:
        complete(now, twist)
    if not np.isfinite(now).all():
        raise _Refused("NaN or infinity is asked for")


def _difference(before: Array, after: Array, now: Array, twist: Array) -> None:
    """Rates from what is asked for shortly before and after; of the orientation from the turns between."""
    rate, bend = (after - before) / (2.0 * _APART), (after - 2.0 * now[0] + before) / _APART**2
    twist[0, :3], twist[1, :3] = rate[:3], bend[:3]
    now[1, -3:], now[2, -3:] = rate[-3:], bend[-3:]
    first, middle, last = (rotation_of(row[3:6]) for row in (before, now[0], after))
    one, two = rotation_vector(first, middle), rotation_vector(middle, last)
    twist[0, 3:], twist[1, 3:] = (one + two) / (2.0 * _APART), (two - one) / _APART**2
    now[1, :3], now[2, :3] = twist[:, :3]
    turning_to_rates(now[0, 3:6], twist[0, 3:], twist[1, 3:], now[1, 3:6], now[2, 3:6])


def _row(goal: Goal, now: Array) -> Array:
    row, pairs = goal.row(), now.shape[1] - 11
    if row.shape != now.shape[1:] or np.size(goal.coordinates) != 6 or np.size(goal.standoff) != 3:
        raise _Refused(
            f"{np.size(goal.coordinates)} coordinates and {np.size(goal.internal_force)} internal forces are asked "
            f"for; 6 and {pairs} are needed"
        )
    return row


class _Refused(ValueError):
    """A goal that cannot be asked for."""
