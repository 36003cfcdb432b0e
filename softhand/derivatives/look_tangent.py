"""C, what is observed by the state, by the derivatives of the sums of contacts, and of the sensor behind them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from softhand.batch.loop import Senses
from softhand.contact.layer import evaluate_contact
from softhand.derivatives.assembling import Ways, add_phase, find_derivatives, ways_of
from softhand.derivatives.families import BEGIN, END, LARGEST, Family, Part, Setting, Wanted
from softhand.derivatives.following import meanings_of, solvers_of
from softhand.derivatives.model import PeriodModel
from softhand.derivatives.period_parts import clear, cleared
from softhand.derivatives.row_sums import BLOCK
from softhand.derivatives.seeds import put_seeds, seed_configuration
from softhand.errors import SofthandError
from softhand.model.rigid import branch_terms
from softhand.numerics.addressed import addressed
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled
from softhand.numerics.followed import Followed, offsets_of
from softhand.numerics.straight import pattern_of
from softhand.numerics.symbols import REAL, NotStraightError, Place
from softhand.sensing.sensor import describe
from softhand.steppers.straight_steps import rows_alike

_MOST_WAYS = 200


def seen_contact(i, tree, branches, touch, terms, base):
    """One contact as it is observed, and the branches of the tree that it depends on."""
    clear(touch.contacts[i])
    for first, last in branches:
        branch_terms(tree, first, last, base.q, base.v, terms)
    evaluate_contact(touch.pads[i], touch.columns[i], terms.poses, terms.J, base.v, base.z[i], 0.0, touch.depths[i],
                     False, touch.contacts[i], touch.jacobian[i])  # fmt: skip


def described(tree, branches, senses, touch, terms, base, parts):
    """The observation, from contacts as they are."""
    for first, last in branches:
        branch_terms(tree, first, last, base.q, base.v, terms)
    describe(senses.body, touch, terms, senses.wanted, base.q, base.v, senses.groups, parts)


class LookTangent:
    """The derivatives of what is observed where the period of a model begins.

    Args:
        model: with a tree of joints that are not coupled.
        senses: of the plant of the model.
        parts: of an observation that are needed.
        block: of the observation.
        kept: which of its numbers count, shape (y,).
    """

    def __init__(
        self, model: PeriodModel, senses: Senses, parts: AnyArray, block: Array, kept: NDArray[np.int64]
    ) -> None:
        self._model, self._senses, self._parts, self._layouts = model, senses, parts, model.layouts
        self._block, self._kept = block, kept
        self._solvers = solvers_of(model.plant, self._layouts)
        self._is_lost = False
        self._families: list[Family] = []
        self._call: Any = None

    @property
    def columns(self) -> Array:
        """C of the last call, shape (y, s)."""
        return self._D[self._first : self._first + len(self._kept), : self._model.n_states]

    def find(self) -> bool:
        """Compute the derivatives; the plant is evaluated where the period begins.

        Returns:
            False if a way cannot be followed; then there are none.
        """
        try:
            return not self._is_lost and self._found()
        except SofthandError:
            raise
        except Exception:  # whatever a law or a shape does that cannot be followed
            self._is_lost = True
            return False

    def _found(self) -> bool:
        if not self._families:
            self._begin()
        for _ in range(_MOST_WAYS):
            self._call()
            if self._told[0]:
                return bool(np.isfinite(self.columns).all())
            family, lanes = self._ways.missing.tolist()
            for lane in range(LARGEST):
                if lanes >> lane & 1:
                    self._families[family].follow(lane)
            self._prepare()
        return False

    def _begin(self) -> None:
        """Which numbers of the contacts the sensor reads, and a row for each."""
        m, base = self._model.mechanics, self._model.moves.base
        pads, joints, body = m.touch.pads, m.tree.joints, self._senses.body
        alike = [np.flatnonzero(pads["is_support"] == kind).tolist() for kind in (0, 1)]
        tables = (m.joints, pads, m.touch.columns, m.envelope, joints, self._parts, body.joints, body.tip_joints,
                  body.tip_views, body.pairs, body.bodies)  # fmt: skip
        patterns = (m.joints, pattern_of(pads, alike), m.touch.columns, m.envelope, pattern_of(joints, rows_alike(m)),
                    *tables[5:])  # fmt: skip
        meanings = {**meanings_of(self._model.plant, self._solvers), clear: cleared}
        whole = tuple((int(first), int(last)) for first, last in m.branches)
        arguments = m.tree, whole, self._senses, m.touch, m.terms, base, self._parts
        first = Followed(
            described, arguments, tables, frozenset(), meanings, self._layouts, None, patterns
        )  # fmt: skip
        self._contacts = {place for array in (m.touch.contacts, m.touch.jacobian) for place in self._places(array)}
        read = list(dict.fromkeys(rest[1] for word, *rest in first.sums.steps if self._is_of_contacts(word, rest)))
        nq, nv, cells = len(base.q), len(base.v), base.z.size
        begins = np.cumsum([0, nq, nv, cells, len(read), len(self._kept), 1]).tolist()
        self._first, s = begins[4], self._model.n_states
        self._D = np.zeros((begins[-1], -(-s // BLOCK) * BLOCK))
        self._flat, self._spans = self._D.reshape(-1), np.full((begins[-1], 2), (0, s), dtype=np.int64)
        put_seeds(m.joints, self._model.remembered, base.z.shape[1], tuple(begins[:4]), self._D, self._spans)
        columns: dict[Place, int] = {}
        for array, begin in zip((base.q, base.v, base.z), begins, strict=False):
            columns |= {place: begin + k for k, place in enumerate(self._places(array))}
        columns |= {place: begins[3] + k for k, place in enumerate(read)}
        setting = Setting(tables, patterns, meanings, self._layouts, columns)
        switch = begins[-1] - 1  # of nothing: there are none
        kinds: dict[Any, list[Part]] = {}
        for i, pad in enumerate(pads):
            carry = tuple(one for one in whole if any(one[0] <= pad[name] <= one[1] for name in ("joint", "base")))
            own = [place for place in read if place in {*self._places(m.touch.contacts[i : i + 1]),
                                                        *self._places(m.touch.jacobian[i])}]  # fmt: skip
            rows = [columns[place] for place in own]

            def seen(followed: Followed, own: list[Place] = own, rows: list[int] = rows) -> Wanted:
                return [
                    (BEGIN, row, followed.sums.memory.get(place, 0.0)) for row, place in zip(rows, own, strict=True)
                ]

            part = Part(seen_contact, (i, m.tree, carry, m.touch, m.terms, base), seen, switch)
            kinds.setdefault((int(pad["is_support"]), len(carry)), []).append(part)
        groups = [parts[k : k + LARGEST] for parts in kinds.values() for k in range(0, len(parts), LARGEST)]
        groups.append([Part(described, arguments, self._observed, switch)])
        self._families = [Family(parts, setting) for parts in groups]
        self._told, self._place, self._rows = np.zeros(1, np.int64), np.zeros(1, np.int64), np.array(begins)
        self._along, self._rate = np.zeros(nv), np.zeros(nq)
        self._columns = columns
        self._prepare()

    def _is_of_contacts(self, word: str, rest: list[Any]) -> bool:
        return word == "load" and rest[0] == REAL and rest[1] in self._contacts

    def _observed(self, followed: Followed) -> Wanted:
        for word, *rest in followed.sums.steps:
            if self._is_of_contacts(word, rest) and rest[1] not in self._columns:
                raise NotStraightError("a number of a contact that the sensor does not read elsewhere")
        places, memory = self._places(self._block), followed.sums.memory
        return [(END, self._first + k, memory.get(places[n], 0.0)) for k, n in enumerate(self._kept.tolist())]

    def _prepare(self) -> None:
        self._ways: Ways = ways_of(self._families, self._spans, self._D.shape[1])
        self._place[0] = self._ways.numbers.ctypes.data
        m, base = self._model.mechanics, self._model.moves.base
        self._call = addressed(
            differentiate_look, m.joints, base.q, self._rows, self._D, self._flat, self._spans, self._along, self._rate,
            self._ways, self._place, self._told, layouts=self._layouts,
        )  # fmt: skip

    def _places(self, array: AnyArray) -> list[Place]:
        number, begin = self._layouts.number_of(array)
        return [(number, begin + int(offset)) for offset in offsets_of(array).ravel()]


@compiled
def differentiate_look(joints, q, rows, D, flat, spans, along, rate, ways, place, told):
    """C from the derivatives of the contacts and of the sensor; `told` is set to 1, or 0 where a way is missing."""
    told[0] = 0
    if not find_derivatives(ways, place):
        return
    told[0] = 1
    D[rows[3] :] = 0.0
    seed_configuration(joints, q, rows[0], D, spans, along, rate)
    add_phase(ways, BEGIN, D, flat)
    add_phase(ways, END, D, flat)
