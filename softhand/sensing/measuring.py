"""Kernels of the instruments: what becomes of a true value before a controller has it.

In this order: the bias and the noise of a sample, its rounding, the hold until the next sample, the delay, the low-pass
filter. Before the run all stood as it stands at its first sample, with noise of its own.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.philox import normal
from softhand.numerics.quaternions import quaternion_of, rotation_by
from softhand.numerics.rotations import log_of_turn, turn_rotation, turn_vector
from softhand.sensing.quantities import NORMAL, PLAIN, ROTATION, TURNING


class Chain(NamedTuple):
    """What the instruments measure, and what they remember."""

    items: NDArray[np.void]
    """Table `quantities.ITEM`."""
    truth: Array
    """What is, all quantities one behind the other."""
    measured: Array
    """What arrives, likewise."""
    memory: Array
    """After the last measurement; the first number is 0 before the first one."""
    before: Array
    """Before it."""
    last: NDArray[np.int64]
    """Control period of the last measurement, -1 for none, shape (1,)."""
    seed: NDArray[np.int64]
    """Shape (1,)."""
    room: Array
    """Scratch, shape (2, 3, 3)."""


@compiled
def measure(chain, period):
    """Measure in a control period; twice in the same gives the same.

    Args:
        chain: `Chain`.
        period: number of the control period.
    """
    memory = chain.memory
    if chain.last[0] == period:
        _copy(chain.before, memory)
    else:
        _copy(memory, chain.before)
    chain.last[0] = period
    is_new = memory[0] == 0.0
    memory[0] = 1.0
    _copy(chain.truth, chain.measured)
    for i in range(chain.items.shape[0]):
        _measure_item(chain.items[i], chain, period, is_new)


@compiled
def _measure_item(item, chain, period, is_new):
    size, delay, memory = item.size, item.delay, chain.memory
    held = memory[item.memory : item.memory + size]
    filtered = memory[item.memory + size : item.memory + 2 * size]
    line = item.memory + 2 * size
    out = chain.measured[item.place : item.place + size]
    if is_new:
        for k in range(period - delay, period):
            place = line + size * (k % delay)
            _take(item, chain, k - k % item.stride, memory[place : place + size])
    if is_new or period % item.stride == 0:
        _take(item, chain, period - period % item.stride, held)
    if delay:
        place = line + size * (period % delay)
        for k in range(size):
            out[k] = memory[place + k]
            memory[place + k] = held[k]
    else:
        _copy(held, out)
    if item.share < 1.0:
        if is_new:
            _copy(out, filtered)
        else:
            _filter(item, chain.room, out, filtered)
        _copy(filtered, out)


@compiled
def _take(item, chain, index, out):
    """One sample, of that index, of what is now."""
    true, seed = chain.truth[item.place : item.place + item.size], chain.seed[0]
    if item.kind == PLAIN or item.kind == TURNING:
        value = true[0] + item.bias[0]
        if item.noise[0] > 0.0:
            value += item.noise[0] * normal(seed, item.stream, item.part, index)
        if item.quantum > 0.0:
            value = item.quantum * np.rint(value / item.quantum)
        out[0] = _wrapped(value) if item.kind == TURNING else value
        return
    b, n = item.bias, item.noise
    x = n[0] * normal(seed, item.stream, item.part, index)
    y = n[1] * normal(seed, item.stream, item.part + 1, index)
    z = n[2] * normal(seed, item.stream, item.part + 2, index)
    if item.kind == ROTATION:
        first = chain.room[0]
        turned = out.reshape((3, 3))
        turn_rotation(b[0], b[1], b[2], true.reshape((3, 3)), first)
        turn_rotation(x, y, z, first, turned)
        if item.quantum > 0.0:
            _round_rotation(0.5 * item.quantum, turned)
        return
    _copy(true, out)
    turn_vector(b[0], b[1], b[2], out)
    turn_vector(x, y, z, out)
    if item.quantum > 0.0:
        for k in range(3):
            out[k] = item.quantum * np.rint(out[k] / item.quantum)
        _normalize(out)


@compiled
def _filter(item, room, new, kept):
    """kept += share (new - kept): for rotations along the turn from one to the other, for unit vectors on the arc."""
    if item.kind == PLAIN:
        kept[0] += item.share * (new[0] - kept[0])
    elif item.kind == TURNING:
        kept[0] = _wrapped(kept[0] + item.share * _wrapped(new[0] - kept[0]))
    elif item.kind == ROTATION:
        before, w = room[0], room[1, 0]
        _copy(kept, before.reshape(9))
        log_of_turn(before, new.reshape((3, 3)), w)  # in axes of `before`
        s, R = item.share, before
        x = s * (R[0, 0] * w[0] + R[0, 1] * w[1] + R[0, 2] * w[2])
        y = s * (R[1, 0] * w[0] + R[1, 1] * w[1] + R[1, 2] * w[2])
        z = s * (R[2, 0] * w[0] + R[2, 1] * w[1] + R[2, 2] * w[2])
        turn_rotation(x, y, z, before, kept.reshape((3, 3)))
    elif item.kind == NORMAL:
        for k in range(3):
            kept[k] += item.share * (new[k] - kept[k])
        _normalize(kept)


@compiled
def _copy(source, target):
    for k in range(target.shape[0]):
        target[k] = source[k]


@compiled
def _wrapped(angle):
    """In [-pi, pi]."""
    return angle - 2.0 * math.pi * np.rint(angle / (2.0 * math.pi))


@compiled
def _normalize(u):
    length = math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    for k in range(3):
        u[k] /= length


@compiled
def _round_rotation(quantum, R):
    """The rotation whose quaternion is rounded to whole multiples: of either sign alike, so there is no seam."""
    x, y, z, w = quaternion_of(R)
    rotation_by(np.rint(x / quantum), np.rint(y / quantum), np.rint(z / quantum), np.rint(w / quantum), R)
