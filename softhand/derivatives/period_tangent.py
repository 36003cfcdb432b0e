"""A and B of a control period of one midpoint step by the derivatives of its own sums, in one compiled call."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softhand.derivatives.assembling import Ways
from softhand.derivatives.families import (
    BEGIN,
    DRIFT,
    END,
    FIRST,
    ROOM_FOR_SWITCHES,
    Part,
    Setting,
    Wanted,
    families_of,
    places_of,
)
from softhand.derivatives.following import has_obstacles, meanings_of, solvers_of
from softhand.derivatives.model import PeriodModel
from softhand.derivatives.period_columns import Room, Rows, differentiate
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
from softhand.derivatives.seeds import put_seeds
from softhand.derivatives.tangent import NoTangentError, Tangent
from softhand.model.tree import FLOATS
from softhand.numerics.addressed import Addressed, addressed
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.followed import Followed
from softhand.numerics.straight import pattern_of
from softhand.numerics.symbols import Place
from softhand.steppers.kernels import MIDPOINT
from softhand.steppers.midpoint_terms import add_stiffness
from softhand.steppers.straight_steps import rows_alike

REACH = 2.0
"""How many steps of its difference an entry may be from a switch, to first order, for the switch to be looked at."""


class PeriodTangent:
    """The derivatives of the period of a model.

    Args:
        model: with joints that are neither coupled nor resist, no obstacles, midpoint, one step a period.
        with_wrench: whether the wrench is among the seeds.

    Raises:
        NoTangentError: it is not so.
    """

    def __init__(self, model: PeriodModel, with_wrench: bool) -> None:
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
        )
        self._q, self._external = np.zeros(nq), np.zeros(nv)
        self._put_seeds(n)
        families = families_of(self._kinds(with_wrench), self._common())
        self._tangent = Tangent(families, D, self._room.spans, self._room.columns, self._call_of)

    @property
    def columns(self) -> Array:
        """[A, B], and what the wrench does, of the last call, shape (s, seeds)."""
        return self._room.columns

    @property
    def is_lost(self) -> bool:
        """Whether a way could not be followed; there are no derivatives any more."""
        return self._tangent.is_lost

    def find(self) -> bool:
        """Compute the period and its derivatives, beside the state of the model.

        Returns:
            False if a way cannot be followed; then there are none.
        """
        return self._tangent.find()

    def near(self, steps: Array) -> NDArray[np.int64]:
        """Entries that may cross a switch within `REACH` steps of their differences, in ascending order.

        Args:
            steps: of (q, v, z), u, and the wrench if it is among the seeds.
        """
        return self._tangent.near(steps, REACH)

    def _call_of(self, ways: Ways, place: NDArray[np.int64], told: NDArray[np.int64]) -> Addressed:
        m, moves = self._model.mechanics, self._model.moves
        return addressed(differentiate, m, moves, self._rows, self._room, ways, place, told, layouts=self._layouts)

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
        return places_of(array, self._layouts)

    def _put_seeds(self, n: int) -> None:
        """What does not depend on the state: of v, z and the wrench; and which seeds each row may depend on."""
        D, spans, rows = self._room.D, self._room.spans, self._rows
        m, model = self._model.mechanics, self._model
        put_seeds(m.joints, model.remembered, m.state.z.shape[1], (rows.q, rows.v, rows.z, rows.lag), D, spans)
        spans[rows.wrench : rows.wrench + 6] = 0
        first = self._model.n_states + n
        for k in range(self._seeds - first):
            D[rows.wrench + k, first + k], spans[rows.wrench + k] = 1.0, (first + k, first + k + 1)

    def _kinds(self, with_wrench: bool) -> Iterable[list[Part]]:
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
        return kinds.values()

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
