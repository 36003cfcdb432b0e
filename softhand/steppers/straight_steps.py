"""Straight code for the steps of the midpoint rule."""

from __future__ import annotations

from softhand.model.rigid import branch_terms
from softhand.numerics.addressed import Addressed
from softhand.numerics.arrays import AnyArray
from softhand.numerics.layouts import Layouts
from softhand.numerics.straight import Fixed, pattern_of, put, straight
from softhand.steppers.kernels import BEGIN, CONTACTS, KICK, KICK_DRIFT, Mechanics
from softhand.steppers.midpoint import begin_kick, kick, kick_drift, meet_contact, start_step


def straight_steps(m: Mechanics, step: float, layouts: Layouts) -> list[Addressed | None]:
    """Puts straight code into its place; what is returned must live as long.

    Args:
        m: of a plant with compiled terms.
        step: [s].
        layouts: of all arrays of the run.
    """
    touch, terms, kicks, state = m.touch, m.terms, m.kicks, m.state
    tables = _tables(m)
    fixed = Fixed(tables, tables)
    drive = m.torque, m.external
    whole = {
        KICK_DRIFT: straight(
            kick_drift, [(m.joints, *drive, touch, terms, m.envelope, kicks, step, state)], fixed, layouts
        ),
        BEGIN: straight(begin_kick, [(*drive, terms, m.envelope, kicks, step, state.v)], fixed, layouts),
        KICK: straight(kick, [(m.envelope, kicks, step, state.v)], fixed, layouts),
    }
    contacts = range(len(touch.contacts))
    alike = [[i for i in contacts if touch.pads["is_support"][i] == kind] for kind in (0, 1)]
    own = Fixed((touch.pads, touch.columns), (pattern_of(touch.pads, alike), touch.columns))
    each = straight(meet_contact, [(i, touch, terms, kicks, step, state.z) for i in contacts], own, layouts)
    tree = Fixed((m.tree.joints,), (pattern_of(m.tree.joints, rows_alike(m)),), (m.tree.work,))
    branches = [(m.tree, int(first), int(last), state.q, kicks.ahead, terms) for first, last in m.branches]
    found = [(row, code) for row, (code,) in whole.items()]
    found += enumerate([*each, *straight(branch_terms, branches, tree, layouts)], CONTACTS)
    return [put(code, m.straight[row]) for row, code in found]


def straight_start(m: Mechanics, step: float, layouts: Layouts) -> Addressed | None:
    """Straight code for what the first step from a state does before; args as those of `straight_steps`."""
    tables = _tables(m)
    arguments = m.touch, m.terms, m.envelope, m.kicks, m.at, step, m.state
    return straight(start_step, [arguments], Fixed(tables, tables), layouts)[0]


def _tables(m: Mechanics) -> tuple[AnyArray, ...]:
    """What is fixed of a hand and its contacts."""
    tables = m.joints, m.touch.pads, m.touch.columns, m.envelope
    stops = m.touch.resistance.places
    return (*tables, stops) if len(stops) else tables


def rows_alike(m: Mechanics) -> list[list[int]]:
    """Joints at the same place of branches of the same kinds of joints."""
    found: dict[object, list[int]] = {}
    for first, last in m.branches.tolist():
        kinds = tuple(m.tree.joints["kind"][first : last + 1])
        for b in range(first, last + 1):
            found.setdefault((kinds, b - first), []).append(b)
    return list(found.values())
