"""The derivatives of a period put together in one compiled call: the period as it runs, then A, B and the wrench."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.derivatives.assembling import add_phase, find_derivatives
from softhand.derivatives.families import BEGIN, DRIFT, END, FIRST, SWITCHES
from softhand.derivatives.period import begin, end, note_moved, note_sides, start
from softhand.derivatives.period_parts import Found
from softhand.derivatives.seeds import seed_configuration
from softhand.model.configuration import ADDITIVE, CONTINUOUS
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.simulation.pushes import add_pushes
from softhand.steppers.kernels import advance
from softhand.steppers.midpoint_terms import acceleration_of, undamped_ahead


class Rows(NamedTuple):
    """Where the derivatives of what stand: by all seeds, which are (q, v, z, u, wrench)."""

    q: int
    v: int
    z: int
    lag: int
    """The four of `period_parts.Rest`, until they are solved for; one behind the other."""
    first: int
    change: int
    second: int
    middle: int
    ahead: int
    q_end: int
    z_end: int
    external: int
    wrench: int
    switches: int


class Room(NamedTuple):
    """What the tangent works with."""

    found: Found
    scratch: Array
    """Shape (nv,)."""
    rate: Array
    """Shape (nq,)."""
    factors: Array
    """Of the matrices of both kicks, shape (2, nv, nv)."""
    D: Array
    """Derivatives of all numbers by the seeds, and nothing, shape (rows, width)."""
    flat: Array
    """The same, shape (rows * width,)."""
    spans: NDArray[np.int64]
    columns: Array
    """[A, B], and what the wrench does, shape (s, seeds)."""


@compiled
def differentiate(m, moves, rows, room, ways, place, told):
    """The period from its begin, and its derivatives by all seeds.

    Args:
        m: `kernels.Mechanics`.
        moves: `Moves`; what `run_moves` would write of a move of nothing is in its first row.
        rows: `Rows`.
        room: `Room`; columns are set.
        ways: `Ways`.
        place: address of their numbers, shape (1,).
        told: set to 1, or 0 where a way is missing, shape (1,).
    """
    _run(m, moves, room.found, room.factors)
    told[0] = 0
    if not find_derivatives(ways, place):
        return
    told[0] = 1
    D, flat = room.D, room.flat
    nv, n = m.state.v.shape[0], m.torque.shape[0]
    nz = moves.remembered.shape[0]
    D[rows.lag : rows.wrench] = 0.0
    seed_configuration(m.joints, moves.base.q, rows.q, D, room.spans, room.scratch, room.rate)
    # lag and first acceleration
    add_phase(ways, BEGIN, D, flat)
    _drive(rows.first, rows, 2 * nv + nz, nv, n, D)
    solve_rows(room.factors[0], m.envelope, D[rows.lag : rows.lag + nv])
    solve_rows(room.factors[0], m.envelope, D[rows.first : rows.first + nv])
    add_phase(ways, FIRST, D, flat)
    solve_rows(room.factors[0], m.envelope, D[rows.change : rows.change + nv])
    # velocities of the drift, configuration at the end
    half = 0.5 * moves.step
    for k in range(nv):
        lag, first, change, middle, ahead = (
            D[rows.lag + k], D[rows.first + k], D[rows.change + k], D[rows.middle + k], D[rows.ahead + k],
        )  # fmt: skip
        for j in range(D.shape[1]):
            middle[j] = lag[j] + half * (first[j] + change[j])
            ahead[j] = middle[j] + half * (first[j] + change[j])
        middle[nv + k] += 1.0
        ahead[nv + k] += 1.0
    add_phase(ways, DRIFT, D, flat)
    # second acceleration
    add_phase(ways, END, D, flat)
    _drive(rows.second, rows, 2 * nv + nz, nv, n, D)
    solve_rows(room.factors[1], m.envelope, D[rows.second : rows.second + nv])
    _note_columns(m, moves, rows, half, room)
    add_phase(ways, SWITCHES, D, flat)


@compiled
def _run(m, moves, found, factors):
    """The period, as `run_moves` has it; what it finds on its way is kept."""
    begin(m, moves, -1, 0.0)
    start(m, moves)
    note_sides(m, moves.sides[0, 0])
    note_moved(m, moves, -1, 0.0, moves.sides[0, 0])
    m.external[:] = 0.0
    add_pushes(moves.pushes, moves.time[0], m.terms.poses, m.terms.J, m.external)
    for k in range(found.lag.shape[0]):
        found.lag[k] = -m.kicks.above[k]
    acceleration_of(m.touch, m.terms.nle, m.envelope, m.torque, m.external, m.kicks.pull, m.kicks.matrix, found.first)
    _copy(found.first, found.second)
    _copy(found.first, found.begun)
    undamped_ahead(m.touch, m.envelope, moves.step, m.kicks.matrix, found.change, found.second)
    _copy_all(m.kicks.matrix, factors[0])
    advance(moves.kind, m, moves.step)
    note_sides(m, moves.sides[0, 1])
    end(m, moves, moves.ends[0])
    _copy(m.kicks.middle, found.middle)
    _copy(m.kicks.ahead, found.ahead)
    _copy(m.kicks.acceleration, found.second)
    _copy(m.state.q, found.q)
    _copy_all(m.kicks.matrix, factors[1])


@compiled
def _copy(numbers, to):
    for k in range(to.shape[0]):
        to[k] = numbers[k]


@compiled
def _copy_all(rows, to):
    for i in range(to.shape[0]):
        _copy(rows[i], to[i])


@compiled
def _drive(into, rows, torques, nv, n, D):
    """What torques and pushes do to the right-hand side of a kick."""
    for k in range(nv):
        row, external = D[into + k], D[rows.external + k]
        for j in range(D.shape[1]):
            row[j] += external[j]
        if k < n:
            row[torques + k] += 1.0


@compiled
def solve_rows(L, first, B):
    """L L^T X = B in place for all columns of B, as `linear.solve`."""
    n, width = B.shape
    for i in range(n):
        row = B[i]
        for k in range(first[i], i):
            share, other = L[i, k], B[k]
            if share != 0.0:
                for j in range(width):
                    row[j] -= share * other[j]
        for j in range(width):
            row[j] *= L[i, i]
    for i in range(n - 1, -1, -1):
        row = B[i]
        for j in range(width):
            row[j] *= L[i, i]
        for k in range(first[i], i):
            share, other = L[i, k], B[k]
            if share != 0.0:
                for j in range(width):
                    other[j] -= share * row[j]


@compiled
def _note_columns(m, moves, rows, half, room):
    """x' by the seeds: q in its tangent space, v, the numbers of z that belong to x."""
    D, out = room.D, room.columns
    nv = m.state.v.shape[0]
    for joint in range(m.joints.shape[0]):
        kind, i, j = m.joints[joint, 0], m.joints[joint, 1], m.joints[joint, 2]
        if kind == ADDITIVE:
            _copy(D[rows.q_end + i], out[j])
        elif kind == CONTINUOUS:
            c, s = m.state.q[i], m.state.q[i + 1]
            for k in range(out.shape[1]):
                out[j, k] = c * D[rows.q_end + i + 1, k] - s * D[rows.q_end + i, k]
        else:
            _note_pose(m.state.q[i : i + 7], D[rows.q_end + i : rows.q_end + i + 7], out[j : j + 6])
    for k in range(nv):
        row, first, change, last = out[nv + k], D[rows.first + k], D[rows.change + k], D[rows.second + k]
        for j in range(row.shape[0]):
            row[j] = half * (first[j] + change[j] + last[j])
        row[nv + k] += 1.0
    width = m.state.z.shape[1]
    for k in range(moves.remembered.shape[0]):
        _copy(D[rows.z_end + moves.remembered[k, 0] * width + moves.remembered[k, 1]], out[2 * nv + k])


@compiled
def _note_pose(q, D, out):
    """R^T dp, and the vector of twice q^-1 dq."""
    x, y, z, w = q[3], q[4], q[5], q[6]
    for k in range(out.shape[1]):
        a, b, c = D[0, k], D[1, k], D[2, k]
        tx, ty, tz = 2.0 * (z * b - y * c), 2.0 * (x * c - z * a), 2.0 * (y * a - x * b)
        out[0, k] = a + w * tx + z * ty - y * tz
        out[1, k] = b + w * ty + x * tz - z * tx
        out[2, k] = c + w * tz + y * tx - x * ty
        dx, dy, dz, dw = D[3, k], D[4, k], D[5, k], D[6, k]
        out[3, k] = 2.0 * (w * dx - x * dw - y * dz + z * dy)
        out[4, k] = 2.0 * (w * dy - y * dw - z * dx + x * dz)
        out[5, k] = 2.0 * (w * dz - z * dw - x * dy + y * dx)
