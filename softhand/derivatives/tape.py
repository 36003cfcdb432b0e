"""A run with a tape, and over the tape its tangent and its adjoint, as loops over codes at addresses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled

BEGIN, TAKE, KEEP, AFTER, ASK = -1, -2, -3, -4, -5
"""Entries of `Play.order` beside codes: a control period begins; a command from the table of torques; a sample is kept;
a step is done; a controller in plain Python is asked."""

GOES_ON, NO_WAY, FULL, ASKED = range(4)
"""Why a loop returned: it is done; no code takes the way of these numbers; the tape is full; a controller is to be
asked."""

NEXT, WHY, END, STEP, SAMPLE = range(5)
"""Numbers of `Play.progress`: the entry of `order` that comes next, why the loop returned, words on the tape, steps
that are done, samples that are kept."""


class Play(NamedTuple):
    """What a run is made of, in the order of time."""

    order: NDArray[np.int64]
    """Which code, or one of `BEGIN` ..., shape (entries,)."""
    period: NDArray[np.int64]
    """Control period of each, shape (entries,)."""
    ways: NDArray[np.int64]
    """Codes that there are for each, one a way, shape (codes,)."""
    table: NDArray[np.int64]
    """Address of each and of its words, shape (codes, ways, 2)."""
    sizes: NDArray[np.int64]
    """Words that each puts on the tape, shape (codes, ways)."""
    taken: NDArray[np.int64]
    """Which way was taken, shape (entries,)."""
    where: NDArray[np.int64]
    """Where its words begin on the tape, shape (entries,)."""
    tape: Array
    progress: NDArray[np.int64]
    """See `NEXT`, shape (5,)."""
    desired: Array
    """Rows of time and what is asked for, one a control period."""
    now: Array
    """Room for one of them without its time."""
    clock: Array
    commands: Array
    """Rows of torques, for a run without a controller."""
    command: Array
    q: Array
    at: Array
    segments: NDArray[np.int64]
    block: Array
    torque: Array
    limited: NDArray[np.int8]
    external: Array
    rows: Array
    """Samples, as `batch.loop.Plan.rows`."""
    contacts: NDArray[np.void]
    is_support: NDArray[np.int64]
    sides: NDArray[np.int64]
    """Of each contact after each step, and at the begin: 1 touches, 2 slips, 4 times the feature; (1 + steps, nc)."""
    limits: NDArray[np.int64]
    """Of each joint in each control period: which limit cuts its command, -1, 0 or 1; shape (periods + 1, n)."""


class Shadows(NamedTuple):
    """Derivatives of what `Play` has, those of all lanes behind one another for each number; or adjoints."""

    table: NDArray[np.int64]
    """Addresses, likewise."""
    desired: Array
    now: Array
    commands: Array
    command: Array
    block: Array
    torque: Array
    external: Array
    rows: Array


@intrinsic
def _go(typing_context, code, words, tape):
    """Call i64 f(words, tape) at an address; all are addresses."""

    def generate(context, builder, signature, values):
        word, number = ir.IntType(64).as_pointer(), ir.DoubleType().as_pointer()
        kind = ir.FunctionType(ir.IntType(64), [word, number])
        function = builder.inttoptr(values[0], kind.as_pointer())
        return builder.call(function, [builder.inttoptr(values[1], word), builder.inttoptr(values[2], number)])

    return types.int64(code, words, tape), generate


@compiled
def go(row, place):
    """Call a code, an address and that of its words, with the tape from a place on."""
    return _go(row[0], row[1], place)  # type: ignore[call-arg]


@compiled
def record(play, place):
    """Go on with the run until its end, or until something is missing.

    Args:
        play: `Play`.
        place: address of the tape, shape (1,).
    """
    progress = play.progress
    while progress[NEXT] < play.order.shape[0]:
        e = progress[NEXT]
        code, k = play.order[e], play.period[e]
        if code >= 0:
            found = -1
            for way in range(play.ways[code]):
                if progress[END] + play.sizes[code, way] > play.tape.shape[0]:
                    progress[WHY] = FULL
                    return
                if go(play.table[code, way], place[0] + 8 * progress[END]):
                    found = way
                    break
            if found < 0:
                progress[WHY] = NO_WAY
                return
            play.taken[e], play.where[e] = found, progress[END]
            progress[END] += play.sizes[code, found]
        elif code == BEGIN:
            play.clock[0] = play.desired[k, 0]
            for i in range(play.now.shape[0]):
                play.now[i] = play.desired[k, 1 + i]
        elif code == TAKE:
            for i in range(play.command.shape[0]):
                play.command[i] = play.commands[k, i]
        elif code == KEEP:
            _keep(play, k)
        elif code == AFTER:
            play.at[0] = play.q[0]
            progress[STEP] += 1
            note(play, progress[STEP])
            for i in range(play.limited.shape[0]):
                play.limits[k, i] = 0 if play.limited[i] == 0 else (1 if play.command[i] > 0.0 else -1)
        else:
            progress[WHY] = ASKED
            return
        progress[NEXT] = e + 1
    progress[WHY] = GOES_ON


@compiled
def note(play, row):
    """On which side of its switches each contact is."""
    for i in range(play.contacts.shape[0]):
        contact = play.contacts[i]
        touches = contact.is_idle == 0 if play.is_support[i] else contact.deformation[0] > 0.0
        play.sides[row, i] = 0
        if touches:
            play.sides[row, i] = 1 + 4 * contact.feature + (2 if contact.is_slipping > 0 else 0)


@compiled
def _keep(play, k):
    row, end = play.rows[play.progress[SAMPLE]], 1
    row[0] = play.clock[0]
    for s in range(play.segments.shape[0]):
        begin = play.segments[s, 0]
        for i in range(play.segments[s, 1]):
            row[end + i] = play.block[begin + i]
        end += play.segments[s, 1]
    n = play.torque.shape[0]
    for i in range(n):
        row[end + i], row[end + n + i] = play.torque[i], play.limited[i]
    for i in range(play.external.shape[0]):
        row[end + 2 * n + i] = play.external[i]
    play.progress[SAMPLE] += 1


@compiled
def push(play, shadows, place, lanes):
    """The tangent, from the begin of the run to its end or to a controller in plain Python, `progress` likewise."""
    progress = play.progress
    while progress[NEXT] < play.order.shape[0]:
        e = progress[NEXT]
        code, k = play.order[e], play.period[e]
        if code >= 0:
            way = play.taken[e]
            go(shadows.table[code, way], place[0] + 8 * play.where[e])
        elif code == BEGIN:
            for i in range(shadows.now.shape[0]):
                shadows.now[i] = shadows.desired[k, i]
        elif code == TAKE:
            for i in range(shadows.command.shape[0]):
                shadows.command[i] = shadows.commands[k, i]
        elif code == KEEP:
            _keep_shadow(play, shadows, shadows.rows[progress[SAMPLE]], lanes)
            progress[SAMPLE] += 1
        elif code == ASK:
            progress[WHY] = ASKED
            return
        progress[NEXT] = e + 1
    progress[WHY] = GOES_ON


@compiled
def _keep_shadow(play, shadows, row, lanes):
    """`_keep` of the tangent."""
    end = lanes
    for s in range(play.segments.shape[0]):
        begin = play.segments[s, 0] * lanes
        for i in range(play.segments[s, 1] * lanes):
            row[end + i] = shadows.block[begin + i]
        end += play.segments[s, 1] * lanes
    n = shadows.torque.shape[0]
    for i in range(n):
        row[end + i] = shadows.torque[i]
    for i in range(shadows.external.shape[0]):
        row[end + 2 * n + i] = shadows.external[i]


@compiled
def pull(play, shadows, place):
    """The adjoint, from the end of the run to its begin; `progress` counts down."""
    progress = play.progress
    while progress[NEXT] > 0:
        e = progress[NEXT] - 1
        code, k = play.order[e], play.period[e]
        if code >= 0:
            way = play.taken[e]
            go(shadows.table[code, way], place[0] + 8 * play.where[e])
        elif code == BEGIN:
            for i in range(shadows.now.shape[0]):
                shadows.desired[k, i] += shadows.now[i]
                shadows.now[i] = 0.0
        elif code == TAKE:
            for i in range(shadows.command.shape[0]):
                shadows.commands[k, i] += shadows.command[i]
                shadows.command[i] = 0.0
        elif code == KEEP:
            progress[SAMPLE] -= 1
            row, end = shadows.rows[progress[SAMPLE]], 1
            for s in range(play.segments.shape[0]):
                begin = play.segments[s, 0]
                for i in range(play.segments[s, 1]):
                    shadows.block[begin + i] += row[end + i]
                end += play.segments[s, 1]
            n = shadows.torque.shape[0]
            for i in range(n):
                shadows.torque[i] += row[end + i]
            for i in range(shadows.external.shape[0]):
                shadows.external[i] += row[end + 2 * n + i]
        elif code == ASK:
            progress[WHY] = ASKED
            return
        progress[NEXT] = e
    progress[WHY] = GOES_ON
