"""All contacts of one snapshot in one compiled call: deformation, force and stiffness."""

from __future__ import annotations

import math

from softhand.contact.answer import answer, answer_stiffness
from softhand.contact.damping import press, react, recall
from softhand.contact.elements import (
    DAMPING,
    LEAN_ELASTIC,
    LEANING,
    MULTIPLIER,
    ROLLING,
    SLIPS,
    STIFFNESS,
    SUMS,
    get_element,
    let_go_of_elements,
    rows_at,
    sum_elements,
)
from softhand.contact.friction import has_slid, set_friction
from softhand.contact.geometry import find_nearest, place_contact, roll_stiffness
from softhand.contact.kinematics import contact_jacobian, deformation_rate, relative_velocity
from softhand.contact.leaning import bend_stiffness, let_lean, set_turning
from softhand.contact.limit import set_limit
from softhand.contact.sliders import all_slip, slip_elements, try_elements
from softhand.contact.slip import slip_to_limit
from softhand.contact.tangent import stiffness_while_slipping
from softhand.numerics.branches import seldom, usually
from softhand.numerics.compiled import compiled


@compiled
def evaluate_contacts(pads, columns, poses, J, v, z, lead, depths, with_stiffness, contacts, jacobian):
    """Geometry, relative velocity, deformation, force and, if asked, stiffness of every contact.

    (R, Theta, Phi) follow from the poses, so dr = r - R cannot drift; only z has a memory: (dtheta, dphi, dpsi), or
    (s1, s2, psi) under a law in surface coordinates, and behind them what a damping remembers.

    With a lead, v is that of the middle of the step, and the frames are those of its end. On a body that turns the
    normal velocity of the two together is off by half of a step, and with it the force of a dashpot and friction; so
    both take the mean rate of the depth over the step.

    Args:
        pads: table `records.PAD`, shape (nc,).
        columns: velocities that move each pad, then its base, padded with -1, shape (nc, width).
        poses: `Snapshot.poses`, shape (joints, 12).
        J: `Snapshot.J`.
        v: velocity, shape (nv,).
        z: memory of each contact, see `State`, shape (nc, 3 or more).
        lead: the deformation is taken at z + lead * z'(v) [s]; 0 for z itself.
        depths: dr of each contact where the step began [m], NaN of one that did not touch; read with a lead, (nc,).
        with_stiffness: also d force / d displacement.
        contacts: table `records.CONTACT`, set, shape (nc,).
        jacobian: columns of [J_CF, -J_O], see `contact_jacobian`, set, shape (nc, width, 4 or 6).
    """
    for i in range(pads.shape[0]):
        evaluate_contact(
            pads[i], columns[i], poses, J, v, z[i], lead, depths[i], with_stiffness, contacts[i], jacobian[i]
        )


@compiled
def evaluate_contact(pad, columns, poses, J, v, memory, lead, depth, with_stiffness, contact, jacobian):
    """One row of `evaluate_contacts`, likewise."""
    pose, base_pose = poses[pad.joint], poses[pad.base]
    find_nearest(pad, pose, base_pose, contact)
    if pad.is_support:
        if seldom(pad.radius - contact.distance <= 0.0):
            _rest(contact, jacobian)
            if pad.slope_function != 0:
                let_lean(contact)
            return
        contact.is_idle = 0
    place_contact(pad, pose, base_pose, contact)
    set_friction(pad, contact)
    if pad.slope_function != 0:
        set_turning(pad, base_pose, contact)
    contact_jacobian(pad, contact, columns, J, jacobian)
    relative_velocity(columns, jacobian, v, contact.velocity)
    deformation_rate(contact, contact.velocity, contact.deformation_rate)
    contact.pressing_rate = contact.velocity[2]
    contact.deformation[0] = pad.radius - contact.distance
    if usually(lead > 0.0) and usually(depth == depth):  # no NaN
        contact.pressing_rate = 0.5 * (contact.deformation[0] - depth) / lead
    for k in range(3):
        contact.deformation[1 + k] = memory[k] + lead * contact.deformation_rate[1 + k]
    if pad.can_slip and seldom(contact.deformation[0] <= 0.0):
        _let_go(contact)
        if pad.elements > 1:
            let_go_of_elements(pad, contact, memory, lead)
        if pad.slope_function != 0:
            let_lean(contact)
        return
    if pad.elements > 1:
        respond_by_elements(pad, contact, memory, lead, with_stiffness)
    else:
        _respond(pad, contact, memory, lead, with_stiffness)
    if with_stiffness and pad.semi_axes[0] > 0.0:
        roll_stiffness(pad, pose, contact)


@compiled
def _respond(pad, contact, memory, lead, with_stiffness):
    """Force, slip and stiffness at the deformation and the velocity of a contact that slips as a whole.

    A tip slips when its whole force, viscosity included, is beyond the limit of the whole normal force: for as long as
    the step of a stepper that asks in the middle of it, twice the lead, or at once.
    """
    slip, m = contact.slip, 0.0
    slip[0], slip[1], slip[2] = 0.0, 0.0, 0.0
    # the material, as if nothing slipped
    if pad.is_damped:
        recall(pad, contact, memory, lead)
    answer(pad, contact)
    # slip
    contact.grip, slips = math.inf, False
    if pad.can_slip:
        set_limit(pad, contact)
        contact.grip = contact.friction if has_slid(pad, memory) else contact.static_friction
    slips = press(pad, contact)
    if slips:
        contact.grip = contact.friction
        m = slip_to_limit(pad, contact, 2.0 * lead)
        react(pad, contact)
    _look_ahead(pad, contact, lead, slips, m, with_stiffness)


@compiled
def respond_by_elements(pad, contact, memory, lead, with_stiffness):
    """`_respond` of a contact whose elements slip by themselves.

    The static coefficient holds until all of them slip.
    """
    set_limit(pad, contact)
    try_elements(pad, contact, memory, lead)
    mu = contact.friction
    if pad.slip_column >= 0 and not has_slid(pad, memory) and not all_slip(pad, contact, contact.static_friction):
        mu = contact.static_friction
    slip_elements(pad, contact, mu, 2.0 * lead)
    # d force / d velocity, d force / d displacement
    n = pad.elements
    rows = rows_at(pad.element_rows, n)
    sums = rows[n]
    for k in range(SUMS):
        sums[k] = 0.0
    for element in range(n):
        row = rows[element]
        get_element(contact, row)
        if with_stiffness:
            answer(pad, contact)
        _look_ahead(pad, contact, lead, row[SLIPS] > 0.0, row[MULTIPLIER], with_stiffness)
        for i in range(4):
            sums[DAMPING + i] += contact.damping[i]
            if with_stiffness:
                for j in range(4):
                    sums[STIFFNESS + 4 * i + j] += contact.stiffness[i, j]
        if pad.slope_function != 0:
            for i in range(2):
                row[LEAN_ELASTIC + i] = contact.lean_elastic[i]
            if with_stiffness:
                for i in range(3):
                    sums[ROLLING + i] += contact.rolling[i]
                for i in range(4):
                    for j in range(2):
                        sums[LEANING + 2 * i + j] += contact.leaning[i, j]
    sum_elements(pad, contact, mu)
    for i in range(4):
        contact.damping[i] = sums[DAMPING + i] / n
        if with_stiffness:
            for j in range(4):
                contact.stiffness[i, j] = sums[STIFFNESS + 4 * i + j] / n
    if with_stiffness and pad.slope_function != 0:
        for i in range(3):
            contact.rolling[i] = sums[ROLLING + i] / n
        for i in range(4):
            for j in range(2):
                contact.leaning[i, j] = sums[LEANING + 2 * i + j] / n


@compiled
def _look_ahead(pad, contact, lead, slips, m, with_stiffness):
    """d force / d velocity and, if asked, d force / d displacement, with m of `slip_to_limit` where it slips."""
    stiffness, damping = contact.stiffness, contact.damping
    if not usually(math.isfinite(contact.force[0] + contact.force[1] + contact.force[2] + contact.force[3])):
        _blame_law(pad, contact)
    # d force / d velocity, d force / d displacement; what does not press has no moment either
    for k in range(4):
        damping[k] = contact.dashpot[k]
    pulls = pad.is_damped and usually(contact.is_damped > 0) and seldom(contact.force[2] <= 0.0)
    if pulls:
        damping[2] = 0.0
        if pad.slope_function != 0:
            contact.lean_elastic[:] = 0.0
            contact.moment[:] = 0.0
    if slips:
        damping[0], damping[1], damping[3] = 0.0, 0.0, 0.0
    if not with_stiffness:
        return
    answer_stiffness(pad, contact)
    if pad.slope_function != 0:
        bend_stiffness(pad, contact, slips or pulls)
    if pulls:
        stiffness[2, :] = 0.0
    if slips:
        stiffness_while_slipping(contact, m, 1.0 / lead if lead > 0.0 else 0.0)


@compiled
def _let_go(contact):
    """A tip with a limit that does not touch: nothing is stored, no force, no stiffness."""
    for k in range(3):
        contact.slip[k] = contact.deformation[1 + k]
        contact.deformation[1 + k] = 0.0
    contact.deformation_force[:] = 0.0
    contact.elastic[:] = 0.0
    contact.dashpot[:] = 0.0
    contact.force[:] = 0.0
    contact.slip_rate[:] = 0.0
    contact.grip = math.inf
    contact.limit_surface_use = 0.0
    contact.stiffness[:] = 0.0
    contact.damping[:] = 0.0


@compiled
def _rest(contact, jacobian):
    """A support that does not touch; its depth, negative, is not kept up to date."""
    if contact.is_idle:
        return
    contact.is_idle = 1
    _let_go(contact)
    contact.deformation[0] = 0.0
    contact.deformation_rate[:] = 0.0
    contact.velocity[:] = 0.0
    jacobian[:] = 0.0


_BEYOND_REASON = 10.0  # [rad], or radii: a larger deformation is a run that has diverged, not a matter for a law


@compiled
def _blame_law(pad, contact):
    """Mark the contact if the law, and not the deformation handed to it, is beyond reason."""
    unit = pad.radius if pad.is_surface else 1.0
    dr, a, b, c = contact.deformation[0], contact.deformation[1], contact.deformation[2], contact.deformation[3]
    answer = contact.deformation_force[0] + contact.deformation_force[1]
    answer += contact.deformation_force[2] + contact.deformation_force[3]
    within = abs(dr) < pad.radius and max(abs(a), abs(b)) < _BEYOND_REASON * unit and abs(c) < _BEYOND_REASON
    if within and not math.isfinite(answer):
        contact.is_broken = 1
