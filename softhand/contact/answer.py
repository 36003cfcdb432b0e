"""What the material of a tip answers to a deformation: its law, relaxed, with the dashpots beside it."""

from __future__ import annotations

from softhand.contact.address import call
from softhand.contact.leaning import answer_lean
from softhand.numerics.branches import seldom, usually
from softhand.numerics.compiled import compiled


@compiled
def answer(pad, contact):
    """Sets `deformation_force`, `elastic` and `dashpot` at the deformation, and moments; after `damping.recall`.

    Relaxed, the material has kept F - recalled in place of the force F of its law. Its dashpots are
    c_k + lambda_k f_n, f_n the normal force of the law, at least 0.

    Args:
        pad: one row of `records.PAD`.
        contact: one row of `records.CONTACT`.
    """
    # F of the law
    for k in range(4):
        pad.law_arguments[k] = contact.deformation[k]
    if pad.is_surface:
        pad.law_arguments[4], pad.law_arguments[5] = contact.lean[0], contact.lean[1]
    else:
        pad.law_arguments[4] = contact.angles[1] + contact.deformation[2]
    call(pad.force_function, pad.law_arguments, contact.deformation_force)  # type: ignore[call-arg]
    # Eq. (48)
    elastic = contact.elastic
    contact_force(contact, contact.deformation_force, elastic)
    if pad.slope_function != 0:
        answer_lean(pad, contact)
    if not (pad.is_damped and usually(contact.is_damped > 0)):
        return
    # relaxation and viscosity
    pressing = max(contact.deformation_force[0], 0.0)
    for k in range(4):
        channel = 1 if k < 2 else (0 if k == 2 else 2)
        elastic[k] = contact.kept * elastic[k] - contact.recalled[k]
        contact.dashpot[k] = pad.viscosity[channel] + pad.viscosity_per_force[channel] * pressing


@compiled
def normal_force(pad, contact):
    """f_z of material and dashpot together, without pull, for the limit of friction [N]; after `answer`.

    Of an element that of the whole contact, of which its limit is a share.
    """
    if pad.elements > 1:
        return contact.pressed
    normal = contact.elastic[2] + contact.dashpot[2] * contact.pressing_rate
    return 0.0 if seldom(normal < 0.0) else normal


@compiled
def answer_stiffness(pad, contact):
    """`stiffness`, the derivative of `elastic`: J_delta^-T (d dF / d delta) J_delta^-1 of what has not relaxed.

    Rows and columns are x, y, z and the rotation about z. After `answer`, at the same deformation.
    """
    derivatives, stiffness = contact.derivatives, contact.stiffness
    call(pad.stiffness_function, pad.law_arguments, derivatives)  # type: ignore[call-arg]
    share = contact.kept if pad.is_damped and usually(contact.is_damped > 0) else 1.0
    to_theta, to_phi, twist = contact.theta_per_x, contact.phi_per_y, contact.psi_per_x
    for row in range(4):  # columns of D J_delta^-1, with J_delta^-1 sparse
        dr, dtheta = derivatives[4 * row], derivatives[4 * row + 1]
        dphi, dpsi = derivatives[4 * row + 2], derivatives[4 * row + 3]
        derivatives[4 * row] = share * (dtheta * to_theta + dpsi * twist)
        derivatives[4 * row + 1] = share * dphi * to_phi
        derivatives[4 * row + 2] = share * dr
        derivatives[4 * row + 3] = share * dpsi
    for column in range(4):
        dr, dtheta = derivatives[column], derivatives[4 + column]
        dphi, dpsi = derivatives[8 + column], derivatives[12 + column]
        stiffness[0, column] = dtheta * to_theta + dpsi * twist
        stiffness[1, column] = dphi * to_phi
        stiffness[2, column] = dr
        stiffness[3, column] = dpsi


@compiled
def contact_force(contact, dF, force):
    """force = J_delta^-T dF, Eq. (48): f_x, f_y, f_z [N] and tau [N m] on the object, in C_F."""
    force[0] = contact.theta_per_x * dF[1] + contact.psi_per_x * dF[3]
    force[1] = contact.phi_per_y * dF[2]
    force[2] = dF[0]
    force[3] = dF[3]
