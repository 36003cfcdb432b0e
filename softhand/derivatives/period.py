"""Many control periods from states beside one another, in one compiled call: the stepper that exists, without a law."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.contact.address import done
from softhand.model.configuration import integrate
from softhand.model.rigid import branch_terms, rigid_poses, rigid_terms
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.plant.state import StateArrays
from softhand.simulation.pushes import PushTable, add_pushes
from softhand.steppers.kernels import CONTACTS, MIDPOINT, advance, settle
from softhand.steppers.midpoint import start_step

TOUCHES, SLIPS, MOVED, FEATURE = 1, 2, 4, 8
"""Bits that tell which side of its switches a contact is on: it touches; the step slipped; the start lay beyond the
limit of friction; behind these, whether a face, an edge or a vertex is touched."""


class Moves(NamedTuple):
    """Where the periods begin, and where they end."""

    kind: int
    """Of the stepper, see `steppers.kernels`."""
    step: float
    """[s]"""
    steps: int
    """In a period."""
    time: Array
    """At which it begins [s], shape (1,)."""
    base: StateArrays
    """Where it begins unmoved."""
    torque: Array
    """Held there [N m, N], shape (n,)."""
    contacts: NDArray[np.int64]
    """The contacts at their begin, bit for bit."""
    live: NDArray[np.int64]
    """Those that the plant works with, as a view of the same kind."""
    remembered: NDArray[np.int64]
    """Row and column of the numbers of z that belong to x, shape (nz, 2)."""
    along: Array
    """Room for a displacement, shape (nv,)."""
    pushes: PushTable
    """From outside; the last row is the wrench that belongs to p."""
    start: NDArray[np.int64]
    """Addresses of straight code for `start_step` and of its words, or zeros, shape (1, 2)."""
    entry: NDArray[np.int64]
    """Which entry of (q, v, z, u, wrench) each period begins beside; -1 for none, shape (moves,)."""
    amount: Array
    """By how much, shape (moves,)."""
    ends: Array
    """q, v and the numbers of z at the end, shape (moves, nq + nv + nz)."""
    sides: NDArray[np.int64]
    """Bits of each contact at the begin and after each step, shape (moves, 1 + steps, nc)."""


@compiled
def run_moves(mechanics, moves, count):
    """The periods of the first `count` moves, each afresh from its q, v and z.

    Args:
        mechanics: `kernels.Mechanics`.
        moves: `Moves`.
        count: shape (1,).
    """
    m, state = mechanics, mechanics.state
    for i in range(count[0]):
        begin(m, moves, moves.entry[i], moves.amount[i])
        if moves.kind == MIDPOINT:
            start(m, moves)
        else:
            settle(m, moves.step * 0.0)
            rigid_poses(m.tree, state.q, m.terms)
        note_sides(m, moves.sides[i, 0])
        note_moved(m, moves, moves.entry[i], moves.amount[i], moves.sides[i, 0])
        for k in range(moves.steps):
            if k:
                rigid_poses(m.tree, state.q, m.terms)
            for j in range(m.external.shape[0]):
                m.external[j] = 0.0
            add_pushes(moves.pushes, moves.time[0] + k * moves.step, m.terms.poses, m.terms.J, m.external)
            advance(moves.kind, m, moves.step)
            note_sides(m, moves.sides[i, 1 + k])
        end(m, moves, moves.ends[i])


@compiled
def begin(m, moves, index, amount):
    """Everything as it is at the begin, then one entry moved."""
    base, state = moves.base, m.state
    nv, nz, n = state.v.shape[0], moves.remembered.shape[0], m.torque.shape[0]
    for k in range(state.q.shape[0]):
        state.q[k] = base.q[k]
    for k in range(nv):
        state.v[k] = base.v[k]
    for i in range(state.z.shape[0]):
        for k in range(state.z.shape[1]):
            state.z[i, k] = base.z[i, k]
    for k in range(n):
        m.torque[k] = moves.torque[k]
    for k in range(moves.live.shape[0]):
        moves.live[k] = moves.contacts[k]
    m.at[0] = math.nan
    m.kicks.flags[:] = 0
    last = moves.pushes.rows[moves.pushes.rows.shape[0] - 1]
    for k in range(3):
        last.force[k], last.moment[k] = 0.0, 0.0
    if index < 0:
        return
    if index < nv:
        moves.along[:] = 0.0
        moves.along[index] = amount
        integrate(m.joints, base.q, moves.along, 1.0, state.q)
    elif index < 2 * nv:
        state.v[index - nv] += amount
    elif index < 2 * nv + nz:
        k = index - 2 * nv
        state.z[moves.remembered[k, 0], moves.remembered[k, 1]] += amount
    elif index < 2 * nv + nz + n:
        m.torque[index - 2 * nv - nz] += amount
    elif index < 2 * nv + nz + n + 3:
        last.force[index - 2 * nv - nz - n] = amount
    else:
        last.moment[index - 2 * nv - nz - n - 3] = amount


@compiled
def start(m, moves):
    """`rigid_terms` and `start_step`, as straight code where there is some."""
    state, ahead = m.state, m.kicks.ahead
    for k in range(ahead.shape[0]):
        ahead[k] = state.v[k]
    if m.branches.shape[0] == 0:
        rigid_terms(m.tree, state.q, ahead, m.terms)
    for k in range(m.branches.shape[0]):
        if not done(m.straight, CONTACTS + m.touch.contacts.shape[0] + k):  # type: ignore[call-arg]
            branch_terms(m.tree, m.branches[k, 0], m.branches[k, 1], state.q, ahead, m.terms)
    if not done(moves.start, 0):  # type: ignore[call-arg]
        start_step(m.touch, m.terms, m.envelope, m.kicks, m.at, moves.step, state)


@compiled
def note_sides(m, sides):
    """Which side of its switches each contact is on after an evaluation whose slip is final."""
    for i in range(sides.shape[0]):
        pad, contact = m.touch.pads[i], m.touch.contacts[i]
        touches = contact.is_idle == 0 if pad.is_support else contact.deformation[0] > 0.0
        sides[i] = 0
        if touches:
            sides[i] = TOUCHES + FEATURE * contact.feature + (SLIPS if contact.is_slipping > 0 else 0)


@compiled
def note_moved(m, moves, index, amount, sides):
    """Which contacts began beyond the limit of friction, so that z was brought back at once."""
    first = 2 * m.state.v.shape[0]
    for i in range(sides.shape[0]):
        for k in range(3):
            given = moves.base.z[i, k]
            for j in range(moves.remembered.shape[0]):
                if index == first + j and moves.remembered[j, 0] == i and moves.remembered[j, 1] == k:
                    given += amount
            if sides[i] and m.state.z[i, k] != given:
                sides[i] |= MOVED


@compiled
def end(m, moves, row):
    """q, v and the numbers of z that belong to x, into a row."""
    nq, nv = m.state.q.shape[0], m.state.v.shape[0]
    for k in range(nq):
        row[k] = m.state.q[k]
    for k in range(nv):
        row[nq + k] = m.state.v[k]
    for k in range(moves.remembered.shape[0]):
        row[nq + nv + k] = m.state.z[moves.remembered[k, 0], moves.remembered[k, 1]]
