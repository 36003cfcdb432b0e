"""Low-level servos of the joints: from set points, or torques beside a set point, to torques.

    position    tau = K (q_d - q) - D q'              the command is q_d, which moves no faster than its rate limit
    velocity    tau = D (v_d - q')                    the command is v_d, likewise
    impedance   tau = u + K (q_d - q) - D q'          the command is u; q_d is where the joint was when it came

A servo sees its own joints, exactly and at once, and K (q_d - q) - D q' is held between two of its samples. Before the
run it has held the first command for long.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.model.configuration import CONTINUOUS
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled

TORQUE, POSITION, VELOCITY, IMPEDANCE = range(4)
"""Kinds of servos; `TORQUE` is none."""

KINDS = {"position": POSITION, "velocity": VELOCITY, "impedance": IMPEDANCE}
COMMANDS = {"position": "position", "velocity": "velocity", "impedance": "torque"}
"""What a controller has to command to each."""


@dataclass(frozen=True, eq=False)
class Servos:
    """The servos of all joints, arrays of shape (n,).

    Attributes:
        kind: of `KINDS`.
        stiffness: K [N m/rad].
        damping: D [N m s/rad].
        rate_limit: largest change of a set point in a control period, infinite for none.
        torque_limit: largest torque of a servo, infinite for none [N m].
        stride: control periods between two samples of the servos.
        command_stride: between two commands of the controller.
    """

    kind: str
    stiffness: Array
    damping: Array
    rate_limit: Array
    torque_limit: Array
    stride: int
    command_stride: int


class ServoTable(NamedTuple):
    """For kernels."""

    whole: NDArray[np.int64]
    """Kind, stride, stride of commands, shape (3,)."""
    stiffness: Array
    damping: Array
    rate_limit: Array
    torque_limit: Array
    joints: NDArray[np.int64]
    """`World.joints`, shape (joints, 3)."""
    q: Array
    """Live, shape (nq,)."""
    v: Array
    """Live, shape (nv,)."""


def servo_table(servos: Servos | None, joints: NDArray[np.int64], q: Array, v: Array) -> ServoTable:
    """Those at work on a state that stays where it is."""
    if servos is None:
        none = np.zeros(0)
        return ServoTable(np.array([TORQUE, 1, 1]), none, none, none, none, joints, q, v)
    whole = np.array([KINDS[servos.kind], servos.stride, servos.command_stride])
    K, D, rate, most = (
        array.copy() for array in (servos.stiffness, servos.damping, servos.rate_limit, servos.torque_limit)
    )
    return ServoTable(whole, K, D, rate, most, joints, q, v)


def become(table: ServoTable, servos: Servos | None) -> bool:
    """Be servos of other numbers, in the same memory; False where the kind or a stride differs."""
    other = servo_table(servos, table.joints, table.q, table.v)
    if np.any(other.whole != table.whole):
        return False
    for own, new in zip(table[1:5], other[1:5], strict=True):
        own[...] = new
    return True


@compiled
def serve(table, j, asked, k, delay, is_new, memory):
    """The torque of one servo in a control period.

    Args:
        table: `ServoTable`.
        j: which joint.
        asked: the command that has arrived.
        k: number of the control period.
        delay: control periods that a command needs.
        is_new: whether it is the first one.
        memory: set point and torque, shape (2,); changed.
    """
    kind = table.whole[0]
    position, velocity = _position(table, j), table.v[j]
    if is_new:
        memory[0] = asked
    if kind == IMPEDANCE:
        if (k - delay) % table.whole[2] == 0:
            memory[0] = position
    else:
        away = _away(table, j, asked, memory[0]) if kind == POSITION else asked - memory[0]
        most = table.rate_limit[j]
        memory[0] = asked if abs(away) <= most else memory[0] + min(max(away, -most), most)
    if is_new or k % table.whole[1] == 0:
        torque = table.damping[j] * ((memory[0] if kind == VELOCITY else 0.0) - velocity)
        if kind != VELOCITY:
            torque += table.stiffness[j] * _away(table, j, memory[0], position)
        memory[1] = torque
    torque = memory[1] + (asked if kind == IMPEDANCE else 0.0)
    return min(max(torque, -table.torque_limit[j]), table.torque_limit[j])


@compiled
def _position(table, j):
    """Of one joint [rad or m]; they lie in the order of the velocities."""
    i = table.joints[j, 1]
    return math.atan2(table.q[i + 1], table.q[i]) if table.joints[j, 0] == CONTINUOUS else table.q[i]


@compiled
def _away(table, j, target, position):
    """target - position, the short way round of a joint without end."""
    away = target - position
    return math.atan2(math.sin(away), math.cos(away)) if table.joints[j, 0] == CONTINUOUS else away
