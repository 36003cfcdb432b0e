"""Force and displacement of a contact as three numbers of one unit each, for the kernels of slip.

In the contact frame, the spin scaled by the lever l of the limit surface, so that force times displacement is work:

    s = (f_x, f_y, tau / l) [N],   x = (x, y, l w) [m],   v = (v_x, v_y, l w_z) [m/s]
"""

from __future__ import annotations

from softhand.numerics.compiled import compiled


@compiled
def traction(contact):
    """s = (f_x, f_y, tau / lever) of the force on the object [N]."""
    return contact.force[0], contact.force[1], contact.force[3] / contact.lever


@compiled
def displacement_of(contact):
    """x of the deformation, the tangential part of J_delta times it."""
    along_x = contact.deformation[1] / contact.theta_per_x
    twist = contact.deformation[3] - contact.psi_per_x * along_x
    return along_x, contact.deformation[2] / contact.phi_per_y, contact.lever * twist


@compiled
def material_force(contact):
    """s of `elastic`."""
    return contact.elastic[0], contact.elastic[1], contact.elastic[3] / contact.lever


@compiled
def stiffness_of(contact):
    """ds/dx of `elastic`, after `answer_stiffness`."""
    K, lever = contact.stiffness, contact.lever
    return (
        K[0, 0], K[0, 1], K[0, 3] / lever,
        K[1, 0], K[1, 1], K[1, 3] / lever,
        K[3, 0] / lever, K[3, 1] / lever, K[3, 3] / (lever * lever),
    )  # fmt: skip


@compiled
def normal_stiffness_of(contact):
    """df_z/dx of `elastic`."""
    K = contact.stiffness
    return K[2, 0], K[2, 1], K[2, 3] / contact.lever
