"""Friction with a limit: what a tip stores of shear and torsion is cut back to what the contact can hold."""

from __future__ import annotations

import math

from softhand.numerics.compiled import compiled

MOST_ROUNDS = 60
"""Of the search for the share of the deformation that stays."""

GUESSES = 6
"""How many of them first take the law for linear."""

CLOSE = 1e-13
"""How near to 1 the use of the limit surface must then be."""

MOST_NEWTON = 8
"""Steps of the search for the displacement without shear force."""

_SHALLOW = 0.005  # dr / r below which the closed form of `spin_length` would lose digits


@compiled
def spin_length(pad, distance):
    """tau_max / (mu f_z) [m]: how far out the pressure acts against a spin of the contact about its normal.

    With c = R / r, s = a / r and the pressure of columns that are compressed one by one, the paper's Fig. 4,

        tau_max = pi mu k_r r^3 c {arccos c + c s - 2 c artanh s} = kappa mu f_z a,   f_z = pi k_r dr^2

    kappa goes to 8/15 as dr goes to 0. Elastic half-spaces touch over a^2 = r dr, where kappa is a constant of the law;
    and a length can be given outright.

    Args:
        pad: one row of `records.PAD`.
        distance: R [m].
    """
    if pad.torsion_length > 0.0:
        return pad.torsion_length
    r = pad.radius
    e = 1.0 - distance / r
    if not 0.0 < e < 1.0:
        return 0.0
    c = 1.0 - e
    if pad.torsion_share > 0.0:
        return pad.torsion_share * math.sqrt(e) * r
    s = math.sqrt(e * (1.0 + c))
    if e < _SHALLOW:
        kappa = 8.0 / 15.0 - e * (8.0 / 35.0 + e * (0.1206349206 + e * (0.0669552673 + e * 0.0388)))
        return kappa * s * r
    return r * c * (math.acos(c) + c * s - 2.0 * c * math.atanh(s)) / (e * e)


@compiled
def face_of(axes, normal):
    """Which of the faces +x, -x, +y, -y, +z, -z of a box a normal is nearest to.

    Args:
        axes: of the box, in its columns, shape (3, 3).
        normal: outward, in the same frame as the axes, shape (3,).
    """
    face, largest = 0, 0.0
    for axis in range(3):
        along = axes[0, axis] * normal[0] + axes[1, axis] * normal[1] + axes[2, axis] * normal[2]
        if abs(along) > largest:
            face, largest = 2 * axis + (1 if along < 0.0 else 0), abs(along)
    return face


@compiled
def set_friction(pad, contact):
    """Coefficients of a contact: those of the tip, or on a face with its own mu that mu and the tip's ratio of both."""
    contact.friction, contact.static_friction = pad.friction, pad.static_friction
    if pad.has_faces:
        own = pad.face_friction[face_of(pad.box_rotation, contact.normal)]
        if own > 0.0:
            contact.friction, contact.static_friction = own, own * (pad.static_friction / pad.friction)


@compiled
def limit_surface_use(force, mu, length):
    """sqrt{(|f_t| / (mu f_z))^2 + (tau / tau_max)^2}, tau_max = mu f_z length; 1 on the limit surface, 0 without load.

    The ellipse is the usual approximation of the coupled limit; the exact curve lies up to 6 % inside.
    """
    tangential = math.hypot(force[0], force[1])
    torsion = abs(force[3]) / length if length > 0.0 else (math.inf if force[3] != 0.0 else 0.0)
    load = math.hypot(tangential, torsion)
    if load == 0.0:
        return 0.0
    return load / (mu * force[2]) if force[2] > 0.0 else math.inf


@compiled
def note_slip(pads, contacts, z):
    """Make the slip of the last evaluation final: z is what stays, travel, twist and loss grow.

    The loss is the slip times the mean of the forces of the law before and after the step, so that it is of second
    order. What a tip had stored when it lets go is lost with it, though it did not slip.

    Args:
        pads: table `records.PAD`, shape (nc,).
        contacts: table `records.CONTACT`, evaluated at z, or z at a lead that the step is now done with.
        z: memory of each contact, see `State`.
    """
    for i in range(contacts.shape[0]):
        pad, contact = pads[i], contacts[i]
        if not pad.can_slip:
            continue
        slip, force, before = contact.slip, contact.deformation_force, contact.force_before
        for k in range(3):
            z[i, k] = contact.deformation[1 + k]
        moved = slip[0] != 0.0 or slip[1] != 0.0 or slip[2] != 0.0
        touches = contact.force[2] > 0.0
        contact.is_slipping = 1 if moved and touches else 0
        if pad.slip_column >= 0:
            z[i, pad.slip_column] = contact.is_slipping
        if contact.is_slipping:
            along_x = slip[0] / contact.theta_per_x
            contact.slip_travel += math.hypot(along_x, slip[1] / contact.phi_per_y)
            contact.slip_twist += abs(slip[2] - contact.psi_per_x * along_x)
        for k in range(3):
            if moved:
                contact.slip_loss += 0.5 * (before[k] + force[1 + k]) * slip[k]
            slip[k] = 0.0
            before[k] = force[1 + k]
