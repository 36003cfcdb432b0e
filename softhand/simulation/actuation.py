"""What becomes of a command before the joints have a torque: delay, servo, limits, lag, noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled
from softhand.numerics.philox import normal
from softhand.plant.state import StateArrays
from softhand.simulation.servo import TORQUE, Servos, ServoTable, serve, servo_table
from softhand.simulation.servo import become as become_servos

STREAM = 1 << 16
"""Of the random numbers; those of the instruments lie below."""


@dataclass(frozen=True, eq=False)
class Actuation:
    """The drives of the joints, all for each joint, shape (n,) where they are arrays.

    Attributes:
        delay: control periods until a command arrives.
        rate_limit: largest change of the torque in a control period [N m, N]; infinite for none.
        decay: exp(-T / lag) of a first-order lag, T the control period; 0 for none.
        mean: mean over a control period of what a lag has left of a step at its begin, (1 - decay) lag / T.
        noise: standard deviation of the torque of a control period [N m, N].
        seed: of the noise.
        velocity_limit: speed at which a motor has no torque left, infinite for none [rad/s or m/s].
        servos: where the commands are set points, or torques beside them.
    """

    delay: int
    rate_limit: Array
    decay: Array
    mean: Array
    noise: Array
    seed: int = 0
    velocity_limit: Array | None = None
    servos: Servos | None = None


class Drive(NamedTuple):
    """The drives at work."""

    command: Array
    """[N m, N], or set points under servos, shape (n,)."""
    commanded: Array
    """Copy of the command, for a recording, shape (n,)."""
    effort_limit: Array
    """[N m, N], shape (n,)."""
    torque: Array
    """Mean over the control period, as the joints have it, set, shape (n,)."""
    limited: NDArray[np.int8]
    """1 where an effort limit cut the command that arrives, set, shape (n,)."""
    rate_limit: Array
    decay: Array
    mean: Array
    noise: Array
    velocity_limit: Array
    servos: ServoTable
    seed: NDArray[np.int64]
    """Shape (1,)."""
    line: Array
    """Commands on their way, shape (delay, n)."""
    state: Array
    """Whether there is one, then the torque behind the rate limit and that behind the lag; of each servo its set point
    and its torque. Shape (1 + 2 n,), or with servos (1 + 4 n,)."""
    line_before: Array
    state_before: Array
    """Before the last control period."""
    last: NDArray[np.int64]
    """Number of the last control period, -1 for none, shape (1,)."""


def drive_of(
    actuation: Actuation,
    command: Array,
    effort_limit: Array,
    torque: Array,
    limited: AnyArray,
    joints: NDArray[np.int64],
    moving: StateArrays,
    commanded: Array | None = None,
) -> Drive:
    """Drives at rest: before the run they have held the first command for long.

    Args:
        actuation: what they do.
        command: as that of `Drive`, like the next three.
        effort_limit: likewise.
        torque: likewise.
        limited: likewise.
        joints: `World.joints`.
        moving: of the joints, live.
        commanded: as that of `Drive`; room of its own if not given.
    """
    n = len(command)
    line, state = np.zeros((actuation.delay, n)), np.zeros(1 + (2 if actuation.servos is None else 4) * n)
    return Drive(
        command, np.zeros(n) if commanded is None else commanded, effort_limit, torque, limited,
        actuation.rate_limit.copy(), actuation.decay.copy(), actuation.mean.copy(), actuation.noise.copy(),
        _speeds(actuation, n), servo_table(actuation.servos, joints, moving.q, moving.v), np.array([actuation.seed]),
        line, state, line.copy(), state.copy(), np.full(1, -1),
    )  # fmt: skip


def become(drive: Drive, actuation: Actuation) -> bool:
    """Be the drives of other numbers, at rest, in the same memory; False where the delay differs."""
    if actuation.delay != len(drive.line) or not become_servos(drive.servos, actuation.servos):
        return False
    drive.velocity_limit[:] = _speeds(actuation, len(drive.torque))
    for name in ("rate_limit", "decay", "mean", "noise"):
        getattr(drive, name)[:] = getattr(actuation, name)
    drive.seed[:] = actuation.seed
    forget(drive)
    return True


def forget(drive: Drive) -> None:
    """Be at rest."""
    drive.line[:], drive.state[:], drive.last[:] = 0.0, 0.0, -1


def _speeds(actuation: Actuation, n: int) -> Array:
    return np.full(n, np.inf) if actuation.velocity_limit is None else actuation.velocity_limit.copy()


@compiled
def act(drive, period):
    """The torques of one control period; twice in the same gives the same.

        u = limited(servo(command a delay ago)),   y' = (u - y) / lag,   torque = mean of y over the period + noise

    A motor has its effort limit less the share that its speed has of its velocity limit where it drives, all of it
    where it brakes, at the speed with which the period begins.

    Args:
        drive: `Drive`.
        period: number of the control period, its first number.
    """
    k, d, state = period[0], drive.line.shape[0], drive.state
    if drive.last[0] == k:
        _copy(drive.state_before, state)
        _copy_rows(drive.line_before, drive.line)
    else:
        _copy(state, drive.state_before)
        _copy_rows(drive.line, drive.line_before)
    drive.last[0] = k
    is_new = state[0] == 0.0
    state[0] = 1.0
    for j in range(drive.torque.shape[0]):
        asked = drive.command[j]
        drive.commanded[j] = asked
        if d:
            before = asked if is_new else drive.line[k % d, j]
            if is_new:
                for i in range(d):
                    drive.line[i, j] = asked
            drive.line[k % d, j] = asked
            asked = before
        if drive.servos.whole[0] != TORQUE:
            own = 1 + 2 * drive.torque.shape[0] + 2 * j
            asked = serve(drive.servos, j, asked, k, d, is_new, state[own : own + 2])
        most, speed = drive.effort_limit[j], drive.servos.v[j] / drive.velocity_limit[j]
        upper = most * min(max(1.0 - speed, 0.0), 1.0)
        lower = -most * min(max(1.0 + speed, 0.0), 1.0)
        u = min(max(asked, lower), upper)
        drive.limited[j] = u != asked
        slewed, lagged = 1 + 2 * j, 2 + 2 * j
        if is_new:
            state[slewed] = state[lagged] = u
        step = drive.rate_limit[j]
        u = min(max(u, state[slewed] - step), state[slewed] + step)
        left = state[lagged] - u
        state[slewed], state[lagged] = u, u + drive.decay[j] * left
        drive.torque[j] = u + drive.mean[j] * left
        if drive.noise[j] > 0.0:
            drive.torque[j] += drive.noise[j] * normal(drive.seed[0], STREAM, j, k)


@compiled
def _copy(source, target):
    for k in range(target.shape[0]):
        target[k] = source[k]


@compiled
def _copy_rows(source, target):
    for k in range(target.shape[0]):
        _copy(source[k], target[k])


def lag_shares(lag: Array, period: float) -> tuple[Array, Array]:
    """`decay` and `mean` of lags [s] under a control period [s]."""
    decay, mean = np.zeros_like(lag), np.zeros_like(lag)
    slow = lag > 0.0
    decay[slow] = np.exp(-period / lag[slow])
    mean[slow] = -np.expm1(-period / lag[slow]) * lag[slow] / period
    return decay, mean
