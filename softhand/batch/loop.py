"""Control periods without Python: observe, control, record, step, one after the other in one compiled call."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.contact.address import call, done
from softhand.model.rigid import rigid_poses
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.branches import usually
from softhand.numerics.compiled import compiled
from softhand.numerics.inlined import inlined
from softhand.sensing.sensor import Body, Wanted, observe
from softhand.simulation.asking import limit
from softhand.simulation.faults import HEALTHY, find_fault
from softhand.simulation.pushes import PushTable, add_pushes
from softhand.steppers.kernels import advance

NEXT, LIMIT, LAST, FAULT, FINGER, SAMPLES = range(6)
"""Numbers of `Plan.progress`: the period that comes next, that before which the call returns, the last of the run; what
ended it, of `simulation.faults` or `BAD_TORQUE`, and at which contact; how many samples are recorded."""

RECORDED, BETWEEN, LAW = range(3)
"""Rows of `Plan.straight`: `look` where a sample is recorded, where none is, and the control law."""

SEE, ACT, FEEL, FEEL_BETWEEN = range(4)
"""Rows of `Plan.between`; taxels feel where a sample is recorded, and, if they must, where none is."""

BAD_TORQUE = 100
"""The law answered with NaN or infinity."""


class Senses(NamedTuple):
    """What `sensor.observe` takes beside the mechanics."""

    body: Body
    wanted: Wanted
    groups: tuple[Any, ...]


class Plan(NamedTuple):
    """What a run asks for, and what it keeps."""

    kind: int
    """Of the stepper, see `steppers.kernels`."""
    step: float
    """[s]"""
    steps: int
    """In a control period."""
    stride: int
    """Control periods between two calls of the law."""
    every: int
    """Control periods between two samples that are recorded."""
    law: NDArray[np.int64]
    """Address of the control law, 0 for none, and of what it is called with, shape (2,)."""
    command: Array
    """What the law answers with [N m, N], shape (n,)."""
    effort_limit: Array
    """[N m, N], shape (n,)."""
    limited: NDArray[np.int8]
    """1 where a limit cut the command, shape (n,)."""
    clock: Array
    """Time, as the law reads it [s], shape (1,)."""
    desired: Array
    """Rows of time [s] and what is asked for then, one a period of this call, shape (periods, 1 + numbers)."""
    now: Array
    """Room for one of them without its time: what `Senses.wanted` are views of."""
    pushes: PushTable
    """See `simulation.pushes.push_table`."""
    parts: AnyArray
    """Of an observation that are needed where a sample is recorded, see `sensing.groups`."""
    parts_between: AnyArray
    """Where none is."""
    segments: NDArray[np.int64]
    """Of the block that are recorded: begin and size of each, shape (segments, 2)."""
    block: Array
    """Of the observation; behind it, where there are instruments and drives, as much of what the controller sees, and
    the commanded torques."""
    rows: Array
    """Samples: time, segments of the block, torque, whether it was cut, push; shape (samples, numbers)."""
    Theta: Array
    """For `faults.find_fault`, shape (tips,)."""
    progress: NDArray[np.int64]
    """See `NEXT`, shape (6,)."""
    straight: NDArray[np.int64]
    """Addresses of straight code and of its words, see `RECORDED`; zeros where there is none, shape (3, 2)."""
    between: NDArray[np.int64]
    """Addresses of the code of the instruments, of the drives and of the taxels, and of what it is called with, see
    `SEE`; zeros where there are none, shape (4, 2)."""


@compiled
def run_periods(mechanics, senses, plan):
    """Control periods until `progress[LIMIT]`, or the end of the run, the last sample of which is followed by no step.

    Args:
        mechanics: `kernels.Mechanics`, the state at the period that comes next.
        senses: `Senses`.
        plan: `Plan`.
    """
    progress, first = plan.progress, plan.progress[NEXT]
    while progress[NEXT] < progress[LIMIT] and progress[NEXT] <= progress[LAST] and progress[FAULT] == HEALTHY:
        k = progress[NEXT]
        row = plan.desired[k - first]
        time = row[0]
        for i in range(plan.now.shape[0]):
            plan.now[i] = row[1 + i]
        is_recorded = k % plan.every == 0
        _sample(mechanics, senses, plan, is_recorded, k, time)
        if progress[FAULT] != HEALTHY:
            return
        if plan.pushes.rows.shape[0]:
            _push(mechanics, plan, time)
        if is_recorded:
            _record(mechanics, plan, time)
        if k < progress[LAST]:
            for i in range(plan.steps):
                if i and plan.pushes.rows.shape[0]:
                    rigid_poses(mechanics.tree, mechanics.state.q, mechanics.terms)
                    _push(mechanics, plan, time + i * plan.step)
                advance(plan.kind, mechanics, plan.step)
        progress[NEXT] = k + 1


@inlined
def _sample(mechanics, senses, plan, is_recorded, k, time):
    """Observe, look for faults, ask the law."""
    m, progress = mechanics, plan.progress
    fault, finger = HEALTHY, 0
    if not done(plan.straight, RECORDED if is_recorded else BETWEEN):  # type: ignore[call-arg]
        parts = plan.parts if is_recorded else plan.parts_between
        fault, finger = look(m.tree, m.touch, m.terms, m.state, m.at, senses, parts, plan.Theta)
    touch = FEEL if is_recorded else FEEL_BETWEEN
    if fault == HEALTHY and plan.between[touch, 0] != 0:
        call(plan.between[touch, 0], plan.between[touch, 1], plan.between[touch, 1])
    if fault == HEALTHY and plan.between[SEE, 0] != 0:
        call(plan.between[SEE, 0], plan.between[SEE, 1], plan.between[SEE, 1])
    if fault == HEALTHY and plan.law[0] != 0 and k % plan.stride == 0:
        plan.clock[0] = time
        if not done(plan.straight, LAW):
            call(plan.law[0], plan.law[1], plan.law[1])
        if not limit(plan.command, plan.effort_limit, m.torque, plan.limited):
            fault = BAD_TORQUE
    if fault == HEALTHY and plan.between[ACT, 0] != 0:
        call(plan.between[ACT, 0], plan.between[ACT, 1], plan.between[ACT, 1])
    progress[FAULT], progress[FINGER] = fault, finger


@compiled
def look(tree, touch, terms, state, at, senses, parts, Theta):
    """Observe, where the stepper has left the contacts evaluated at this state or not; then `find_fault`."""
    evaluated = usually(at[0] == at[0])  # no NaN
    if not evaluated:
        rigid_poses(tree, state.q, terms)
    observe(senses.body, touch, terms, senses.wanted, state, at, senses.groups, parts, evaluated)
    return find_fault(state.v, touch.pads, touch.contacts, Theta)


@inlined
def _push(m, plan, time):
    """The pushes of the step that begins at a time; poses and J are those of its begin."""
    for k in range(m.external.shape[0]):
        m.external[k] = 0.0
    add_pushes(plan.pushes, time, m.terms.poses, m.terms.J, m.external)


@inlined
def _record(m, plan, time):
    """One more row."""
    row, end = plan.rows[plan.progress[SAMPLES]], 1
    row[0] = time
    for s in range(plan.segments.shape[0]):
        begin = plan.segments[s, 0]
        for k in range(plan.segments[s, 1]):
            row[end + k] = plan.block[begin + k]
        end += plan.segments[s, 1]
    n, nv = m.torque.shape[0], m.external.shape[0]
    for k in range(n):
        row[end + k], row[end + n + k] = m.torque[k], plan.limited[k]
    for k in range(nv):
        row[end + 2 * n + k] = m.external[k]
    plan.progress[SAMPLES] += 1
