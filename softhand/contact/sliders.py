"""How the elements of a contact slip: each to its share of the limit of the whole, whose normal force all share."""

from __future__ import annotations

from softhand.contact.answer import answer
from softhand.contact.damping import press, react, recall
from softhand.contact.elements import (
    DASHPOT,
    ELASTIC,
    MULTIPLIER,
    RATE,
    SLIPS,
    TRIAL,
    get_element,
    put_element,
    rows_at,
    share_of,
    sum_elements,
)
from softhand.contact.slip import slip_to_limit
from softhand.numerics.branches import usually
from softhand.numerics.compiled import compiled

_CLOSE = 1e-14  # of the normal force: change in the last turn
_MOST_TURNS = 30


@compiled
def try_elements(pad, contact, memory, lead):
    """The material of each element as if nothing slipped, and the normal force of all.

    Args:
        pad: one row of `records.PAD`.
        contact: one row of `records.CONTACT`, after `deformation_rate`, with dr.
        memory: row of z.
        lead: as in `layer.evaluate_contacts`.
    """
    rows = rows_at(pad.element_rows, pad.elements)
    for element in range(pad.elements):
        first = element * pad.block
        for k in range(3):
            contact.deformation[1 + k] = memory[first + k] + lead * contact.deformation_rate[1 + k]
        if pad.is_damped:
            recall(pad, contact, memory[first:], lead)
        _try(pad, contact, rows[element])
    press_elements(pad, contact)


@compiled
def _try(pad, contact, row):
    """An element at the deformation of the contact, if nothing slips."""
    answer(pad, contact)
    for k in range(3):
        row[TRIAL + k] = contact.deformation[1 + k]
        contact.slip[k], contact.slip_rate[k] = 0.0, 0.0
    put_element(contact, row)


@compiled
def press_elements(pad, contact):
    """`pressed`: the mean of what the elements press with, dashpots included, none of which pulls [N]."""
    rows, total = rows_at(pad.element_rows, pad.elements), 0.0
    for element in range(pad.elements):
        total += max(rows[element, ELASTIC + 2] + rows[element, DASHPOT + 2] * contact.pressing_rate, 0.0)
    contact.pressed = total / pad.elements


@compiled
def all_slip(pad, contact, mu):
    """Whether all elements would be beyond their limits, after `try_elements`."""
    rows = rows_at(pad.element_rows, pad.elements)
    for element in range(pad.elements):
        get_element(contact, rows[element])
        contact.grip = mu * share_of(element, pad.elements)
        if not press(pad, contact):
            return False
    return True


@compiled
def slip_elements(pad, contact, mu, duration):
    """Let each element slip that is beyond its limit mu_b P, after `try_elements`.

    P is the normal force of the whole contact after that, so that all elements together have its limit: where the law
    presses more as it is sheared, it is found by the secant method.

    Args:
        pad: one row of `records.PAD`.
        contact: one row of `records.CONTACT`; `pressed` is set, and the rows of the elements are.
        mu: of the contact.
        duration: as in `slip_to_limit` [s].
    """
    first, begin, before, off_before = True, contact.pressed, 0.0, 0.0
    for turn in range(_MOST_TURNS):
        P = begin
        if not _slip_each(pad, contact, mu, duration, first):
            return
        press_elements(pad, contact)
        off = contact.pressed - P
        if abs(off) <= _CLOSE * P or turn == _MOST_TURNS - 1:
            contact.pressed = P
            return
        step = off
        if not first and off != off_before:
            step = -off * (P - before) / (off - off_before)
        first, before, off_before = False, P, off
        begin = max(P + step, 0.0)
        contact.pressed = begin


@compiled
def _slip_each(pad, contact, mu, duration, is_tried):
    """One turn of `slip_elements` at a given `pressed`: whether any slips."""
    rows, slide = rows_at(pad.element_rows, pad.elements), False
    for element in range(pad.elements):
        row = rows[element]
        get_element(contact, row)
        if not is_tried:
            for k in range(3):
                contact.deformation[1 + k], contact.slip[k] = row[TRIAL + k], 0.0
            answer(pad, contact)
        contact.grip, row[MULTIPLIER] = mu * share_of(element, pad.elements), 0.0
        slips = press(pad, contact)
        if slips:
            row[MULTIPLIER] = slip_to_limit(pad, contact, duration)
            react(pad, contact)
            slide = True
        row[SLIPS] = 1.0 if slips else 0.0
        put_element(contact, row)
    return slide


@compiled
def react_again(pad, contact):
    """`react` at another velocity, for what was evaluated; with elements for each of them."""
    if pad.elements == 1:
        react(pad, contact)
    elif pad.is_damped and usually(contact.is_damped > 0):
        rows, grip = rows_at(pad.element_rows, pad.elements), contact.grip
        press_elements(pad, contact)
        for element in range(pad.elements):
            get_element(contact, rows[element])
            contact.grip = grip * share_of(element, pad.elements)
            react(pad, contact)
            put_element(contact, rows[element])
        sum_elements(pad, contact, grip)


@compiled
def slide(pads, contacts, step):
    """Slip with dashpots over a step that ends at the last evaluation, for steppers that evaluate without a lead.

    Such an evaluation finds the force after what slips at once. Over a step the dashpots have a say in it.
    """
    if not step > 0.0:
        return
    for i in range(contacts.shape[0]):
        pad, contact, dashpot = pads[i], contacts[i], contacts[i].dashpot
        if not dashpot[0] + dashpot[1] + dashpot[3] > 0.0:
            continue
        if pad.elements > 1:
            _slide_elements(pad, contact, step)
            continue
        slip, rate = contact.slip, contact.slip_rate
        if rate[0] == 0.0 and rate[1] == 0.0 and rate[2] == 0.0:
            continue
        for k in range(3):
            contact.deformation[1 + k] += slip[k]
            slip[k] = 0.0
        answer(pad, contact)
        slip_to_limit(pad, contact, step)
        react(pad, contact)


@compiled
def _slide_elements(pad, contact, step):
    """One contact of `slide`, with elements."""
    rows, grip, yields = rows_at(pad.element_rows, pad.elements), contact.grip, False
    for element in range(pad.elements):
        for k in range(3):
            yields = yields or rows[element, RATE + k] != 0.0
    if not yields:
        return
    for element in range(pad.elements):
        row = rows[element]
        get_element(contact, row)
        for k in range(3):
            contact.deformation[1 + k] = row[TRIAL + k]
        _try(pad, contact, row)
    press_elements(pad, contact)
    slip_elements(pad, contact, grip, step)
    sum_elements(pad, contact, grip)
