"""C, what is observed by the state, by the derivatives of the sums of contacts, and of the sensor behind them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softhand.batch.loop import Senses
from softhand.contact.layer import evaluate_contact
from softhand.derivatives.assembling import add_phase, find_derivatives
from softhand.derivatives.families import BEGIN, END, Part, Setting, Wanted, families_of, places_of
from softhand.derivatives.following import meanings_of, solvers_of
from softhand.derivatives.model import PeriodModel
from softhand.derivatives.period_parts import clear, cleared
from softhand.derivatives.row_sums import BLOCK
from softhand.derivatives.seeds import put_seeds, seed_configuration
from softhand.derivatives.tangent import NoTangentError, Tangent
from softhand.errors import SofthandError
from softhand.model.rigid import branch_terms
from softhand.numerics.addressed import Addressed, addressed
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled
from softhand.numerics.followed import Followed
from softhand.numerics.straight import pattern_of
from softhand.numerics.symbols import REAL, NotStraightError, Place
from softhand.sensing.sensor import describe
from softhand.steppers.straight_steps import rows_alike


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

    Attributes:
        columns: C of the last call, shape (y, s).

    Raises:
        NoTangentError: what the sensor does with the state cannot be followed.
    """

    def __init__(
        self, model: PeriodModel, senses: Senses, parts: AnyArray, block: Array, kept: NDArray[np.int64]
    ) -> None:
        self._layouts, self._block, self._kept = model.layouts, block, kept
        self._solvers = solvers_of(model.plant, self._layouts)
        m, base = model.mechanics, model.moves.base
        body, pads, joints = senses.body, m.touch.pads, m.tree.joints
        alike = [np.flatnonzero(pads["is_support"] == kind).tolist() for kind in (0, 1)]
        tables = (m.joints, pads, m.touch.columns, m.envelope, joints, parts, body.joints, body.tip_joints,
                  body.tip_views, body.pairs, body.bodies)  # fmt: skip
        patterns = (m.joints, pattern_of(pads, alike), m.touch.columns, m.envelope, pattern_of(joints, rows_alike(m)),
                    *tables[5:])  # fmt: skip
        meanings = {**meanings_of(model.plant, self._solvers), clear: cleared}
        whole = tuple((int(first), int(last)) for first, last in m.branches)
        arguments = m.tree, whole, senses, m.touch, m.terms, base, parts
        try:
            followed = Followed(described, arguments, tables, frozenset(), meanings, self._layouts, None, patterns)
        except SofthandError:
            raise
        except Exception as error:  # whatever a shape does that cannot be followed
            raise NoTangentError from error
        self._contacts = {place for array in (m.touch.contacts, m.touch.jacobian) for place in self._places(array)}
        read = list(dict.fromkeys(rest[1] for word, *rest in followed.sums.steps if self._is_of_contacts(word, rest)))
        nq, nv, cells, s = len(base.q), len(base.v), base.z.size, model.n_states
        begins = np.cumsum([0, nq, nv, cells, len(read), len(kept), 1]).tolist()
        self._first = begins[4]
        D = np.zeros((begins[-1], -(-s // BLOCK) * BLOCK))
        spans = np.full((begins[-1], 2), (0, s), dtype=np.int64)
        put_seeds(m.joints, model.remembered, base.z.shape[1], tuple(begins[:4]), D, spans)
        columns: dict[Place, int] = {}
        for array, begin in zip((base.q, base.v, base.z), begins, strict=False):
            columns |= {place: begin + k for k, place in enumerate(self._places(array))}
        self._columns = columns = columns | {place: begins[3] + k for k, place in enumerate(read)}
        switch = begins[-1] - 1  # of nothing: there are none
        kinds: dict[Any, list[Part]] = {}
        for i, pad in enumerate(pads):
            carry = tuple(one for one in whole if any(one[0] <= pad[name] <= one[1] for name in ("joint", "base")))
            own = {*self._places(m.touch.contacts[i : i + 1]), *self._places(m.touch.jacobian[i])}
            rows = [(columns[place], place) for place in read if place in own]
            part = Part(seen_contact, (i, m.tree, carry, m.touch, m.terms, base), partial(_seen, rows), switch)
            kinds.setdefault((int(pad["is_support"]), len(carry)), []).append(part)
        kinds["observation"] = [Part(described, arguments, self._observed, switch)]
        families = families_of(kinds.values(), Setting(tables, patterns, meanings, self._layouts, columns))
        self.columns = D[self._first : self._first + len(kept), :s]
        work = m.joints, base.q, np.array(begins), D, D.reshape(-1), spans, np.zeros(nv), np.zeros(nq)

        def call_of(*ways: Any) -> Addressed:
            return addressed(differentiate_look, *work, *ways, layouts=self._layouts)

        self._tangent = Tangent(families, D, spans, self.columns, call_of)

    @property
    def is_lost(self) -> bool:
        """Whether a way could not be followed; there are no derivatives any more."""
        return self._tangent.is_lost

    def find(self) -> bool:
        """Compute the derivatives; the plant is evaluated where the period begins.

        Returns:
            False if a way cannot be followed; then there are none.
        """
        return self._tangent.find()

    def _is_of_contacts(self, word: str, rest: list[Any]) -> bool:
        return word == "load" and rest[0] == REAL and rest[1] in self._contacts

    def _observed(self, followed: Followed) -> Wanted:
        for word, *rest in followed.sums.steps:
            if self._is_of_contacts(word, rest) and rest[1] not in self._columns:
                raise NotStraightError("a number of a contact that the sensor does not read elsewhere")
        places, memory = self._places(self._block), followed.sums.memory
        return [(END, self._first + k, memory.get(places[n], 0.0)) for k, n in enumerate(self._kept.tolist())]

    def _places(self, array: AnyArray) -> list[Place]:
        return places_of(array, self._layouts)


def _seen(rows: Sequence[tuple[int, Place]], followed: Followed) -> Wanted:
    return [(BEGIN, row, followed.sums.memory.get(place, 0.0)) for row, place in rows]


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
