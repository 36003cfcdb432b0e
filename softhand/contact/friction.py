"""Friction of a contact: its coefficients, and what slip costs."""

from __future__ import annotations

import math

from softhand.contact.elements import BEFORE, DISPLACEMENT, FORCE, RATE, SLIP, rows_at
from softhand.numerics.branches import seldom, usually
from softhand.numerics.compiled import compiled


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
def has_slid(pad, memory):
    """Whether the tip slipped in the step before, where that makes a difference."""
    return pad.slip_column >= 0 and seldom(memory[max(pad.slip_column, 0)] > 0.0)


@compiled
def note_slip(pads, contacts, z, step):
    """Make the slip of the last evaluation final: z is what stays, travel, twist and loss grow.

    The loss is the slip times the mean of the forces before and after the step, so that it is of second order. What a
    tip had stored when it lets go is lost with it, though it did not slip.

    Args:
        pads: table `records.PAD`, shape (nc,).
        contacts: table `records.CONTACT`, evaluated at z, or z at a lead that the step is now done with.
        z: memory of each contact, see `State`.
        step: in which it slipped so [s]; 0 if that is not known, and its rate stays what it was.
    """
    for i in range(contacts.shape[0]):
        note_slip_of(pads[i], contacts[i], z[i], step)


@compiled
def note_slip_of(pad, contact, memory, step):
    """One row of `note_slip`, likewise."""
    if not pad.can_slip:
        return
    if pad.elements > 1:
        _note_slip_of_elements(pad, contact, memory, step)
        return
    slip, rate, f, before = contact.slip, contact.slip_rate, contact.force, contact.force_before
    for k in range(3):
        memory[k] = contact.deformation[1 + k]
    moved = seldom((slip[0] != 0.0) | (slip[1] != 0.0) | (slip[2] != 0.0))
    slides = moved or seldom((rate[0] != 0.0) | (rate[1] != 0.0) | (rate[2] != 0.0))
    contact.is_slipping = 1 if slides and f[2] > 0.0 else 0
    if pad.slip_column >= 0:
        memory[pad.slip_column] = contact.is_slipping
    # J_delta^T of the whole force, and J_delta of the slip
    now = 0.0, 0.0, 0.0
    if usually(f[2] > 0.0):
        now = (f[0] - contact.psi_per_x * f[3]) / contact.theta_per_x, f[1] / contact.phi_per_y, f[3]
    if moved:
        along_x = slip[0] / contact.theta_per_x
        contact.slip_loss += 0.5 * ((before[0] + now[0]) * slip[0] + (before[1] + now[1]) * slip[1])
        contact.slip_loss += 0.5 * (before[2] + now[2]) * slip[2]
        if contact.is_slipping:
            contact.slip_travel += math.hypot(along_x, slip[1] / contact.phi_per_y)
            contact.slip_twist += abs(slip[2] - contact.psi_per_x * along_x)
    for k in range(3):
        if usually(step > 0.0):
            contact.slip_speed[k] = slip[k] / step
        slip[k], before[k] = 0.0, now[k]


@compiled
def _note_slip_of_elements(pad, contact, memory, step):
    """`note_slip_of` for each element, which loses 1/n of what a contact like it would; all that slip are a slip."""
    n = pad.elements
    rows = rows_at(pad.element_rows, n)
    lost, sliding = 0.0, 0
    for element in range(n):
        row, first = rows[element], element * pad.block
        now = _force_in_law(contact, row[FORCE], row[FORCE + 1], row[FORCE + 2], row[FORCE + 3])
        moves = False
        for k in range(3):
            slip = row[SLIP + k]
            moves = moves or slip != 0.0 or row[RATE + k] != 0.0
            lost += 0.5 * (row[BEFORE + k] + now[k]) * slip
            memory[first + k] = row[DISPLACEMENT + k]
            row[SLIP + k], row[BEFORE + k] = 0.0, now[k]
        if moves:
            sliding += 1
    f, slip = contact.force, contact.slip
    contact.slip_loss += lost / n
    contact.is_slipping = 1 if sliding == n and f[2] > 0.0 else 0
    if pad.slip_column >= 0:
        memory[pad.slip_column] = contact.is_slipping
    if contact.is_slipping:
        along_x = slip[0] / contact.theta_per_x
        contact.slip_travel += math.hypot(along_x, slip[1] / contact.phi_per_y)
        contact.slip_twist += abs(slip[2] - contact.psi_per_x * along_x)
    now = _force_in_law(contact, f[0], f[1], f[2], f[3])
    for k in range(3):
        if step > 0.0:
            contact.slip_speed[k] = slip[k] / step
        slip[k], contact.force_before[k] = 0.0, now[k]


@compiled
def _force_in_law(contact, x, y, z, torsion):
    """J_delta^T of a force, without dr; nothing of one that does not press."""
    if not z > 0.0:
        return 0.0, 0.0, 0.0
    return (x - contact.psi_per_x * torsion) / contact.theta_per_x, y / contact.phi_per_y, torsion
