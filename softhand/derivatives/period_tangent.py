"""A and B of a control period of one midpoint step by the derivatives of its own sums, in one compiled call."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.derivatives.assembling import add_phase, find_derivatives, find_near, ways_of
from softhand.derivatives.families import (
    BEGIN,
    DRIFT,
    END,
    FIRST,
    LARGEST,
    ROOM_FOR_SWITCHES,
    Family,
    Part,
    Setting,
    Wanted,
)
from softhand.derivatives.following import has_obstacles, meanings_of, solvers_of
from softhand.derivatives.model import PeriodModel
from softhand.derivatives.period import begin, end, note_moved, note_sides, start
from softhand.derivatives.period_parts import (
    SWITCHES,
    Found,
    branch_part,
    clear,
    cleared,
    contact_part,
    drift_part,
    product_in_place_of_matrix,
    push_part,
)
from softhand.derivatives.row_sums import BLOCK
from softhand.derivatives.seeds import put_seeds, seed_configuration
from softhand.errors import SofthandError
from softhand.model.configuration import ADDITIVE, CONTINUOUS
from softhand.model.tree import FLOATS
from softhand.numerics.addressed import addressed
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled
from softhand.numerics.followed import Followed, offsets_of
from softhand.numerics.straight import pattern_of
from softhand.numerics.symbols import Place
from softhand.simulation.pushes import add_pushes
from softhand.steppers.kernels import MIDPOINT, advance
from softhand.steppers.midpoint_terms import acceleration_of, add_stiffness, undamped_ahead
from softhand.steppers.straight_steps import rows_alike

REACH = 2.0
"""How many steps of its difference an entry may be from a switch, to first order, for the switch to be looked at."""


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
    steps: Array
    """Of the seeds, as far as they count."""
    near: NDArray[np.int64]
    """See `find_near`."""
    told: NDArray[np.int64]
    """Whether it came to its end, and how many are near, shape (2,)."""
    place: NDArray[np.int64]
    """Address of `Ways.numbers`, shape (1,)."""


class NoTangentError(Exception):
    """The period is not one that can be followed."""


class PeriodTangent:
    """The derivatives of the period of a model.

    Args:
        model: with joints that are neither coupled nor resist, no obstacles, midpoint, one step a period.
        steps: of the differences of (q, v, z), by which it is told how near a switch is.
        with_wrench: whether the wrench is among the seeds.

    Raises:
        NoTangentError: it is not so.
    """

    def __init__(self, model: PeriodModel, steps: Array, with_wrench: bool) -> None:
        m, moves = model.mechanics, model.moves
        world = model.plant.world
        own = (getattr(world.mechanics, name) for name in ("armature", "damping", "friction", "stop_stiffness"))
        if moves.kind != MIDPOINT or moves.steps != 1 or world.coupling is not None or any(map(np.any, own)):
            raise NoTangentError
        if has_obstacles(model.plant):
            raise NoTangentError
        self._model, self._layouts = model, model.layouts
        nq, nv, n, nc = len(m.state.q), len(m.state.v), len(m.torque), len(m.touch.contacts)
        cells, parts = m.state.z.size, nc + len(m.branches) + 2
        sizes = [nq, nv, cells, nv, nv, nv, nv, nv, nv, nq, cells, nv, 6, parts * ROOM_FOR_SWITCHES]
        begins = np.cumsum([0, *sizes]).tolist()
        self._rows = Rows(*begins[:-1])
        s = model.n_states
        self._seeds = seeds = s + n + (6 if with_wrench else 0)
        self._room = Room(
            found=Found(
                lag=np.zeros(nv),
                first=np.zeros(nv),
                begun=np.zeros(nv),
                change=np.zeros(nv),
                middle=np.zeros(nv),
                ahead=np.zeros(nv),
                q=np.zeros(nq),
                second=np.zeros(nv),
            ),
            scratch=np.zeros(nv),
            rate=np.zeros(nq),
            factors=np.zeros((2, nv, nv)),
            D=(D := np.zeros((begins[-1], -(-seeds // BLOCK) * BLOCK))),
            flat=D.reshape(-1),
            spans=np.full((begins[-1], 2), (0, seeds), dtype=np.int64),
            columns=np.zeros((s, seeds)),
            steps=np.concatenate([steps, np.zeros(seeds - len(steps))]),
            near=np.zeros((64, 2), np.int64),
            told=np.zeros(2, np.int64),
            place=np.zeros(1, np.int64),
        )
        self._q, self._external = np.zeros(nq), np.zeros(nv)
        self._put_seeds(n)
        self._setting = self._common()
        self._families = [Family(alike, self._setting) for alike in self._alike(with_wrench)]
        self._call: Any = None
        self._is_lost = False
        self._prepare()

    @property
    def columns(self) -> Array:
        """[A, B], and what the wrench does, of the last call, shape (s, seeds)."""
        return self._room.columns

    @property
    def near(self) -> NDArray[np.int64]:
        """Entries that may cross a switch within their step, and the sign, shape (k, 2)."""
        return self._room.near[: self._room.told[1]]

    def find(self, steps_of_torques: Array) -> bool:
        """Compute the period and its derivatives, beside the state of the model.

        Args:
            steps_of_torques: of the differences of u and the wrench.

        Returns:
            False if a way cannot be followed; then there are none.
        """
        room = self._room
        if self._is_lost:
            return False
        room.steps[len(room.steps) - len(steps_of_torques) :] = steps_of_torques
        for _ in range(_MOST_WAYS):
            self._call()
            if room.told[0]:
                return bool(np.isfinite(room.columns).all())
            family, lanes = self._ways.missing.tolist()
            try:
                for lane in range(LARGEST):
                    if lanes >> lane & 1:
                        self._families[family].follow(lane)
            except SofthandError:
                raise
            except Exception:  # whatever a law or a shape does that cannot be followed
                self._is_lost = True
                return False
            self._prepare()
        return False

    def _prepare(self) -> None:
        """Call with the ways that there are."""
        self._ways = ways = ways_of(self._families, self._room.spans, self._room.D.shape[1])
        self._room.place[0] = ways.numbers.ctypes.data
        m, moves = self._model.mechanics, self._model.moves
        self._call = addressed(differentiate, m, moves, self._rows, self._room, ways, layouts=self._layouts)

    def _common(self) -> Setting:
        """What the parts have in common."""
        m, moves, found, rows = self._model.mechanics, self._model.moves, self._room.found, self._rows
        columns: dict[Place, int] = {}
        last = moves.pushes.rows[-1:]
        named = [(moves.base.q, rows.q), (moves.base.v, rows.v), (moves.base.z, rows.z), (found.begun, rows.first),
                 (found.middle, rows.middle), (found.ahead, rows.ahead), (found.q, rows.q_end),
                 (last["force"], rows.wrench), (last["moment"], rows.wrench + 3)]  # fmt: skip
        for array, first in named:
            columns |= {place: first + k for k, place in enumerate(self._places(array))}
        self._solvers = solvers_of(self._model.plant, self._layouts)
        meanings = {
            **meanings_of(self._model.plant, self._solvers),
            add_stiffness: product_in_place_of_matrix,
            clear: cleared,
            **SWITCHES,
        }
        pads, joints = m.touch.pads, m.tree.joints
        alike = [np.flatnonzero(pads["is_support"] == kind).tolist() for kind in (0, 1)]
        tables = m.joints, pads, m.touch.columns, m.envelope, joints, moves.pushes.moves
        patterns = (m.joints, pattern_of(pads, alike), m.touch.columns, m.envelope,
                    pattern_of(joints, rows_alike(m)), moves.pushes.moves)  # fmt: skip
        return Setting(tables, patterns, meanings, self._layouts, columns)

    def _places(self, array: AnyArray) -> list[Place]:
        number, begin = self._layouts.number_of(array)
        return [(number, begin + int(offset)) for offset in offsets_of(array).ravel()]

    def _put_seeds(self, n: int) -> None:
        """What does not depend on the state: of v, z and the wrench; and which seeds each row may depend on."""
        D, spans, rows = self._room.D, self._room.spans, self._rows
        m, model = self._model.mechanics, self._model
        put_seeds(m.joints, model.remembered, m.state.z.shape[1], (rows.q, rows.v, rows.z, rows.lag), D, spans)
        spans[rows.wrench : rows.wrench + 6] = 0
        first = self._model.n_states + n
        for k in range(self._seeds - first):
            D[rows.wrench + k, first + k], spans[rows.wrench + k] = 1.0, (first + k, first + k + 1)

    def _alike(self, with_wrench: bool) -> list[list[Part]]:
        """All parts, those of one kind together."""
        m, moves, rows, found = self._model.mechanics, self._model.moves, self._rows, self._room.found
        base, step, joints = moves.base, float(moves.step), m.tree.joints
        whole = [(int(first), int(last)) for first, last in m.branches]
        kinds: dict[Any, list[Part]] = {}
        switches = iter(range(rows.switches, len(self._room.D), ROOM_FOR_SWITCHES))
        for first, last in whole:
            own = joints[first : last + 1]
            v = [int(j) + k for j, kind in zip(own["column"], own["kind"], strict=True)
                 for k in range(6 if kind == FLOATS else 1)]  # fmt: skip
            part = Part(branch_part, (m.tree, first, last, tuple(v), m.envelope, m.terms, base, found),
                        partial(self._rest_of, v, None), next(switches))  # fmt: skip
            kinds.setdefault(("branch", tuple(own["kind"])), []).append(part)
        for i, pad in enumerate(m.touch.pads):
            carry = [
                branch for branch in whole if any(branch[0] <= pad[name] <= branch[1] for name in ("joint", "base"))
            ]
            v = [int(k) for k in m.touch.columns[i] if k >= 0]
            arguments = i, m.tree, tuple(carry), m.touch, m.terms, m.kicks, step, base, found
            part = Part(contact_part, arguments, partial(self._rest_of, v, i), next(switches))
            kinds.setdefault(("contact", int(pad["is_support"]), len(carry)), []).append(part)
        kinds["drift"] = [Part(drift_part, (m.joints, base, found, step, self._q), self._q_end, next(switches))]
        if with_wrench or len(moves.pushes.rows) > 1:
            push = m.tree, tuple(whole), m.terms, base, moves.pushes, moves.time, self._external
            kinds["push"] = [Part(push_part, push, self._push, next(switches))]
        return [parts[k : k + LARGEST] for parts in kinds.values() for k in range(0, len(parts), LARGEST)]

    def _rest_of(self, velocities: Sequence[int], contact: int | None, followed: Followed) -> Wanted:
        rows, rest, nv = self._rows, followed.result, len(self._external)
        wanted = [(phase, rows.lag + n * nv + k, getattr(rest, name)[k])
                  for n, (name, phase) in enumerate(zip(rest._fields, (BEGIN, BEGIN, FIRST, END), strict=True))
                  for k in velocities]  # fmt: skip
        if contact is not None:
            z = self._model.moves.base.z
            for k, place in enumerate(self._places(z[contact])):
                if place in followed.sums.memory:
                    wanted.append((END, rows.z_end + contact * z.shape[1] + k, followed.sums.memory[place]))
        return wanted

    def _q_end(self, followed: Followed) -> Wanted:
        memory = followed.sums.memory
        return [(DRIFT, self._rows.q_end + k, memory[place]) for k, place in enumerate(self._places(self._q))]

    def _push(self, followed: Followed) -> Wanted:
        memory = followed.sums.memory
        return [(BEGIN, self._rows.external + k, memory[place]) for k, place in enumerate(self._places(self._external))]


_MOST_WAYS = 200


@compiled
def differentiate(m, moves, rows, room, ways):
    """The period from its begin, and its derivatives by all seeds.

    Args:
        m: `kernels.Mechanics`.
        moves: `Moves`; what `run_moves` would write of a move of nothing is in its first row.
        rows: `Rows`.
        room: `Room`; columns, near and told are set.
        ways: `Ways`.
    """
    _run(m, moves, room.found, room.factors)
    room.told[0] = 0
    if not find_derivatives(ways, room.place):
        return
    room.told[0] = 1
    D, flat = room.D, room.flat
    nv, n = m.state.v.shape[0], m.torque.shape[0]
    nz = moves.remembered.shape[0]
    D[rows.lag : rows.wrench] = 0.0
    seed_configuration(m.joints, moves.base.q, rows.q, D, room.spans, room.scratch, room.rate)
    # lag and first acceleration
    add_phase(ways, 0, D, flat)
    _drive(rows.first, rows, 2 * nv + nz, nv, n, D)
    solve_rows(room.factors[0], m.envelope, D[rows.lag : rows.lag + nv])
    solve_rows(room.factors[0], m.envelope, D[rows.first : rows.first + nv])
    add_phase(ways, 1, D, flat)
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
    add_phase(ways, 2, D, flat)
    # second acceleration
    add_phase(ways, 3, D, flat)
    _drive(rows.second, rows, 2 * nv + nz, nv, n, D)
    solve_rows(room.factors[1], m.envelope, D[rows.second : rows.second + nv])
    _note_columns(m, moves, rows, half, room)
    add_phase(ways, 4, D, flat)
    room.told[1] = find_near(ways, D, room.steps, REACH, room.near)


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
