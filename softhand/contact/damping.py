"""What the material of a tip adds to the force of its law when it moves: viscosity and relaxation."""

from __future__ import annotations

import math

from softhand.contact.answer import normal_force
from softhand.contact.elements import LAW, rows_at
from softhand.contact.limit import limit_use
from softhand.contact.records import LEANING, REMEMBERED, STORED
from softhand.contact.scaled import traction
from softhand.contact.slip import ROUNDED, slip_velocity
from softhand.numerics.branches import seldom, usually
from softhand.numerics.compiled import compiled


@compiled
def recall(pad, contact, memory, lead):
    """`kept` and `recalled`: relaxation turns the force F of the law into kept F - recalled, while the tip touches.

    With w_k a memory of F, in the coordinates of the law so that no frame turns under what it remembers, which follows
    F at the rate nu_k:

        F - sum_k c_k w_k,   w_k' = nu_k (F - w_k)

    Args:
        pad: one row of `records.PAD`.
        contact: one row of `records.CONTACT`, after `place_contact`.
        memory: row of z, or from the block of an element on; w of each relaxation, `pad.remembered` numbers each,
            behind the displacement.
        lead: w is taken so much later [s], with F as it then is.
    """
    recalled = contact.recalled
    contact.is_damped = 1 if usually(contact.deformation[0] > 0.0) else 0
    contact.dashpot[:] = 0.0
    contact.kept = 1.0
    recalled[:] = 0.0
    if pad.slope_function != 0:
        contact.lean_recalled[:] = 0.0
    for k in range(pad.relaxations):
        share, rate = pad.relaxation[k, 0], pad.relaxation[k, 1]
        left = math.exp(-rate * lead)
        first = STORED + pad.remembered * k
        contact.kept -= share * (1.0 - left)
        torsion = share * left * memory[first + 3]
        recalled[0] += contact.theta_per_x * share * left * memory[first + 1] + contact.psi_per_x * torsion
        recalled[1] += contact.phi_per_y * share * left * memory[first + 2]
        recalled[2] += share * left * memory[first]
        recalled[3] += torsion
        if pad.slope_function != 0:
            for j in range(LEANING):
                contact.lean_recalled[j] += share * left * memory[first + REMEMBERED + j]


@compiled
def press(pad, contact):
    """The whole force at the velocity as if nothing slipped, f = f_el + D velocity, never a pull; after `answer`.

    Args:
        pad: one row of `records.PAD`.
        contact: one row of `records.CONTACT`; force and limit_surface_use are set.

    Returns:
        Whether it is beyond the limit mu f_z, mu the `grip`; also if it is no number, as of a law far out of its range.
    """
    force, elastic, dashpot, velocity = contact.force, contact.elastic, contact.dashpot, contact.velocity
    contact.slip_rate[0], contact.slip_rate[1], contact.slip_rate[2] = 0.0, 0.0, 0.0
    for k in range(4):
        force[k] = elastic[k] + dashpot[k] * (velocity[k] if k != 2 else contact.pressing_rate)
    has_limit = pad.can_slip and usually(contact.grip < math.inf)
    if has_limit or (pad.is_damped and usually(contact.is_damped > 0)):  # noqa: SIM102  seldom stands alone
        if seldom(force[2] < 0.0):
            force[2] = 0.0
    if not has_limit:
        return False
    contact.limit_surface_use = limit_use(contact, traction(contact), contact.grip * normal_force(pad, contact))
    return not usually(contact.limit_surface_use <= 1.0 + ROUNDED)


@compiled
def react(pad, contact):
    """The whole force at the velocity, within the limit of friction; after `answer`.

        f = f_el + D (velocity - slip rate)

    Where f_el + D velocity is beyond the limit mu f_z of the whole normal force, the surfaces slip over each other as
    fast as it takes to bring the whole force to the limit, along its normal. The dashpots see what is left of the
    velocity, so that their power is never negative. A tip that does not press holds nothing.

    Args:
        pad: one row of `records.PAD`.
        contact: one row of `records.CONTACT`; force, slip_rate and limit_surface_use are set.

    Returns:
        Whether the surfaces slip in this way.
    """
    if not press(pad, contact):
        return False
    force, dashpot, lever = contact.force, contact.dashpot, contact.lever
    room = contact.grip * normal_force(pad, contact)
    yields = room > 0.0 and dashpot[0] + dashpot[1] + dashpot[3] > 0.0
    if yields:
        y = slip_velocity(contact, room)
        contact.slip_rate[0], contact.slip_rate[1], contact.slip_rate[2] = y[0], y[1], y[2] / lever
        force[0] -= dashpot[0] * y[0]
        force[1] -= dashpot[1] * y[1]
        force[3] -= dashpot[3] * y[2] / lever
    # what no dashpot can take, where the normal force is not that at which the material came to the limit
    use = limit_use(contact, traction(contact), room)
    if use > 1.0 + ROUNDED:
        for k in (0, 1, 3):
            force[k] = force[k] / use if use < math.inf else 0.0
    contact.limit_surface_use = 1.0
    return yields


@compiled
def relax(pads, contacts, step, z):
    """w of each relaxation for h on, towards the forces of the last evaluation; exact if these are constant."""
    for i in range(contacts.shape[0]):
        relax_contact(pads[i], contacts[i], step, z[i])


@compiled
def relax_contact(pad, contact, step, memory):
    """One row of `relax`, likewise."""
    for k in range(pad.relaxations):
        share, first = -math.expm1(-pad.relaxation[k, 1] * step), STORED + pad.remembered * k
        if pad.elements == 1:
            for j in range(REMEMBERED):
                memory[first + j] += share * (contact.deformation_force[j] - memory[first + j])
            if pad.slope_function != 0:
                for j in range(REMEMBERED, REMEMBERED + LEANING):
                    memory[first + j] += share * (contact.lean_force[j - REMEMBERED] - memory[first + j])
        else:
            rows = rows_at(pad.element_rows, pad.elements)
            for element in range(pad.elements):
                for j in range(pad.remembered):
                    memory[first + j] += share * (rows[element, LAW + j] - memory[first + j])
                first += pad.block


@compiled
def memory_rate(pads, contacts, z, z_rate):
    """z', after an evaluation: the rate of the deformation, if nothing slips, and `relaxation_rate`."""
    for i in range(contacts.shape[0]):
        for k in range(z.shape[1]):
            z_rate[i, k] = 0.0
        for element in range(pads[i].elements):
            for k in range(STORED):
                z_rate[i, element * pads[i].block + k] = contacts[i].deformation_rate[1 + k]
    relaxation_rate(pads, contacts, z, z_rate)


@compiled
def relaxation_rate(pads, contacts, z, z_rate):
    """w_k' = nu_k (F - w_k), into their columns of z_rate."""
    for i in range(contacts.shape[0]):
        pad = pads[i]
        for k in range(pad.relaxations):
            rate, first = pad.relaxation[k, 1], STORED + pad.remembered * k
            if pad.elements == 1:
                for j in range(REMEMBERED):
                    z_rate[i, first + j] = rate * (contacts[i].deformation_force[j] - z[i, first + j])
                if pad.slope_function != 0:
                    for j in range(REMEMBERED, REMEMBERED + LEANING):
                        z_rate[i, first + j] = rate * (contacts[i].lean_force[j - REMEMBERED] - z[i, first + j])
            else:
                rows = rows_at(pad.element_rows, pad.elements)
                for element in range(pad.elements):
                    for j in range(pad.remembered):
                        z_rate[i, first + j] = rate * (rows[element, LAW + j] - z[i, first + j])
                    first += pad.block
