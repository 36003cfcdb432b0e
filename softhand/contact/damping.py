"""What the material of a tip adds to the force of its law when it moves: viscosity and relaxation."""

from __future__ import annotations

import math

from softhand.numerics.compiled import compiled


@compiled
def damp(pad, contact, memory, lead, slips):
    """Change force and stiffness of a contact for its damping, and set d force / d velocity.

    First relaxation, in the coordinates of the law, so that no frame turns under what it remembers, with w_k a memory
    of the force F of the law that follows it at the rate nu_k:

        F <- F - sum_k c_k w_k,   w_k' = nu_k (F - w_k)

    Then viscosity in the contact frame, f <- f + D velocity, D = diag(c_k + lambda_k f_n), f_n the normal force of the
    law. The total normal force is never tensile. A tip that does not touch is not damped.

    Args:
        pad: one row of `records.PAD`.
        contact: one row of `records.CONTACT`, with the force (and the stiffness) of the law.
        memory: row of z; w of each relaxation, four numbers each, from the fourth on.
        lead: w is taken so much later [s].
        slips: whether shear and torsion are at the limit of friction, where viscosity has no part in them.
    """
    contact.damping[:] = 0.0
    if contact.deformation[0] <= 0.0:
        return
    force, velocity, damping = contact.force, contact.velocity, contact.damping
    elastic = max(force[2], 0.0)
    if memory.shape[0] > 6:
        _remember(pad, contact, memory, lead)
    for k, channel in ((0, 1), (1, 1), (2, 0), (3, 2)):
        if slips and k != 2:
            continue
        damping[k] = pad.viscosity[channel] + pad.viscosity_per_force[channel] * elastic
        force[k] += damping[k] * velocity[k]
    if force[2] < 0.0:
        force[2], damping[2] = 0.0, 0.0
        contact.stiffness[2, :] = 0.0


@compiled
def _remember(pad, contact, memory, lead):
    """F - sum c_k w_k at z + lead z', in place of F."""
    force, law = contact.force, contact.deformation_force
    kept = 1.0
    for k in range((memory.shape[0] - 3) // 4):
        share, rate = pad.relaxation[k, 0], pad.relaxation[k, 1]
        step = -math.expm1(-rate * lead)
        first = 3 + 4 * k
        w0 = share * (memory[first] + step * (law[0] - memory[first]))
        w1 = share * (memory[first + 1] + step * (law[1] - memory[first + 1]))
        w2 = share * (memory[first + 2] + step * (law[2] - memory[first + 2]))
        w3 = share * (memory[first + 3] + step * (law[3] - memory[first + 3]))
        force[0] -= contact.theta_per_x * w1 + contact.psi_per_x * w3
        force[1] -= contact.phi_per_y * w2
        force[2] -= w0
        force[3] -= w3
        kept -= share * step
    for row in range(4):
        for column in range(4):
            contact.stiffness[row, column] *= kept


@compiled
def forbid_pull(pads, contacts):
    """Viscosity pulls nowhere, after `move_contacts` to another velocity."""
    for i in range(contacts.shape[0]):
        force = contacts[i].force
        if pads[i].is_damped and force[2] <= 0.0:
            force[2] = 0.0
            if pads[i].can_slip:
                force[0], force[1], force[3] = 0.0, 0.0, 0.0


@compiled
def relax(pads, contacts, step, z):
    """w of each relaxation for h on, towards the forces of the last evaluation; exact if these are constant."""
    for i in range(contacts.shape[0]):
        for k in range((z.shape[1] - 3) // 4):
            share = -math.expm1(-pads[i].relaxation[k, 1] * step)
            for j in range(4):
                z[i, 3 + 4 * k + j] += share * (contacts[i].deformation_force[j] - z[i, 3 + 4 * k + j])


@compiled
def relaxation_rate(pads, contacts, z, z_rate):
    """w_k' = nu_k (F - w_k), into the columns of z_rate from the fourth on."""
    for i in range(contacts.shape[0]):
        for k in range((z.shape[1] - 3) // 4):
            for j in range(4):
                column = 3 + 4 * k + j
                rate = pads[i].relaxation[k, 1]
                z_rate[i, column] = rate * (contacts[i].deformation_force[j] - z[i, column])
