"""All contacts of one snapshot in one compiled call: deformation, force and stiffness."""

from __future__ import annotations

import math

from softhand.contact.address import call
from softhand.contact.damping import damp
from softhand.contact.friction import (
    CLOSE,
    GUESSES,
    MOST_NEWTON,
    MOST_ROUNDS,
    limit_surface_use,
    set_friction,
    spin_length,
)
from softhand.contact.geometry import find_nearest, place_contact
from softhand.contact.kinematics import contact_force, contact_jacobian, deformation_rate, relative_velocity
from softhand.numerics.compiled import compiled


@compiled
def evaluate_contacts(pads, columns, poses, J, v, z, lead, with_stiffness, contacts, jacobian):
    """Geometry, relative velocity, deformation, force and, if asked, stiffness of every contact.

    (R, Theta, Phi) follow from the poses, so dr = r - R cannot drift; only z has a memory: (dtheta, dphi, dpsi), or
    (s1, s2, psi) under a law in surface coordinates, and behind them what a damping remembers.

    Args:
        pads: table `records.PAD`, shape (nc,).
        columns: velocities that move each pad, then its base, padded with -1, shape (nc, width).
        poses: `Snapshot.poses`, shape (joints, 12).
        J: `Snapshot.J`, shape (6, nv).
        v: velocity, shape (nv,).
        z: memory of each contact, see `State`, shape (nc, 3 or more).
        lead: the deformation is taken at z + lead * z'(v) [s]; 0 for z itself.
        with_stiffness: also d force / d displacement.
        contacts: table `records.CONTACT`, set, shape (nc,).
        jacobian: columns of [J_CF, -J_O], see `contact_jacobian`, set, shape (nc, width, 4).
    """
    for i in range(pads.shape[0]):
        pad, contact = pads[i], contacts[i]
        pose, base_pose = poses[pad.joint], poses[pad.base]
        find_nearest(pad, pose, base_pose, contact)
        if pad.is_support:
            if pad.radius - contact.distance <= 0.0:
                _rest(contact, jacobian[i])
                continue
            contact.is_idle = 0
        place_contact(pad, pose, base_pose, contact)
        set_friction(pad, contact)
        contact_jacobian(pad, contact, columns[i], J, jacobian[i])
        relative_velocity(columns[i], jacobian[i], v, contact.velocity)
        deformation_rate(contact, contact.velocity, contact.deformation_rate)
        contact.deformation[0] = pad.radius - contact.distance
        for k in range(3):
            contact.deformation[1 + k] = z[i, k] + lead * contact.deformation_rate[1 + k]
        if pad.can_slip and contact.deformation[0] <= 0.0:
            _let_go(contact)
            continue
        _answer(pad, contact)
        slips = pad.can_slip and _cut_back(pad, contact, z[i])
        if not math.isfinite(contact.force[0] + contact.force[1] + contact.force[2] + contact.force[3]):
            _blame_law(pad, contact)
        if with_stiffness:
            call(pad.stiffness_function, pad.law_arguments, contact.derivatives)  # type: ignore[call-arg]
            _contact_stiffness(contact, contact.derivatives, contact.stiffness)
            if slips:
                _release(contact.stiffness)
        if pad.is_damped:
            damp(pad, contact, z[i], lead, slips)
            if pad.can_slip:
                _limit_damped(pad, contact, slips or _has_slid(pad, z[i]))


@compiled
def _answer(pad, contact):
    """The force of the law at the deformation."""
    for k in range(4):
        pad.law_arguments[k] = contact.deformation[k]
    if pad.is_surface:
        pad.law_arguments[4], pad.law_arguments[5] = contact.lean[0], contact.lean[1]
    else:
        pad.law_arguments[4] = contact.angles[1] + contact.deformation[2]
    call(pad.force_function, pad.law_arguments, contact.deformation_force)  # type: ignore[call-arg]
    contact_force(contact, contact.deformation_force, contact.force)


@compiled
def _let_go(contact):
    """A tip with a limit that does not touch: nothing is stored, no force, no stiffness."""
    for k in range(3):
        contact.slip[k] = contact.deformation[1 + k]
        contact.deformation[1 + k] = 0.0
    contact.deformation_force[:] = 0.0
    contact.force[:] = 0.0
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


@compiled
def _cut_back(pad, contact, memory):
    """Cut shear and torsion back to the limit surface if they are beyond it; `slip` is what was cut off.

    All three in proportion, counted from where the law has neither shear force nor torsion, so that the force comes
    back along the ray on which it lies. The share that stays is 1 / use where the law is linear in them at a normal
    force of its own; else it is enclosed: by the same guess a few times, then by false position (Illinois).
    """
    slip, length = contact.slip, spin_length(pad, contact.distance)
    slip[0], slip[1], slip[2] = 0.0, 0.0, 0.0
    mu = contact.friction if _has_slid(pad, memory) else contact.static_friction
    contact.limit_surface_use = limit_surface_use(contact.force, mu, length)
    if contact.limit_surface_use <= 1.0 + 10.0 * CLOSE:
        return False
    a, b, c = contact.deformation[1], contact.deformation[2], contact.deformation[3]
    use = limit_surface_use(contact.force, contact.friction, length)
    a0, b0, c0 = _force_free(pad, contact, length)
    a, b, c = a - a0, b - b0, c - c0
    kept, low, high, below, above, last = 1.0, 0.0, 1.0, math.nan, use - 1.0, 0
    for k in range(MOST_ROUNDS):
        if k < GUESSES and use < math.inf:
            kept = kept / use
        elif below < 0.0 and above < math.inf:
            kept = (low * above - high * below) / (above - below)
        else:
            kept = 0.5 * (low + high)
        if not low < kept < high:
            kept = 0.5 * (low + high)
        use = _use_at(pad, contact, a0 + kept * a, b0 + kept * b, c0 + kept * c, length)
        if abs(use - 1.0) < CLOSE:
            break
        if use > 1.0:
            high, above = kept, use - 1.0
            below = 0.5 * below if last > 0 else below
            last = 1
        else:
            low, below = kept, use - 1.0
            above = 0.5 * above if last < 0 else above
            last = -1
    if use > 1.0 + 10.0 * CLOSE:
        kept = low
        use = _use_at(pad, contact, a0 + kept * a, b0 + kept * b, c0 + kept * c, length)
    slip[0], slip[1], slip[2] = (1.0 - kept) * a, (1.0 - kept) * b, (1.0 - kept) * c
    contact.limit_surface_use = use
    return True


@compiled
def _force_free(pad, contact, length):
    """The displacement at which the law has neither shear force nor torsion: zero, but for some laws of leaning tips.

    By Newton's method from zero, torsion by itself. Zero where that does not come within the limit.
    """
    a, b, c = 0.0, 0.0, 0.0
    force, K = contact.deformation_force, contact.derivatives
    for _ in range(MOST_NEWTON):
        use = _use_at(pad, contact, a, b, c, length)
        if (force[1] == 0.0 and force[2] == 0.0 and force[3] == 0.0) or (use < CLOSE):
            return a, b, c
        call(pad.stiffness_function, pad.law_arguments, K)  # type: ignore[call-arg]
        determinant = K[5] * K[10] - K[6] * K[9]
        if not determinant > 0.0:
            break
        a -= (K[10] * force[1] - K[6] * force[2]) / determinant
        b -= (K[5] * force[2] - K[9] * force[1]) / determinant
        if K[15] > 0.0:
            c -= force[3] / K[15]
    if _use_at(pad, contact, a, b, c, length) < 1.0:
        return a, b, c
    return 0.0, 0.0, 0.0


@compiled
def _use_at(pad, contact, first, second, third, length):
    """Use of the limit surface with so much stored; the contact is then there."""
    contact.deformation[1], contact.deformation[2], contact.deformation[3] = first, second, third
    _answer(pad, contact)
    return limit_surface_use(contact.force, contact.friction, length)


@compiled
def _has_slid(pad, memory):
    """Whether the tip slipped in the step before, where that makes a difference."""
    return pad.slip_column >= 0 and memory[max(pad.slip_column, 0)] > 0.0


@compiled
def _limit_damped(pad, contact, slides):
    """The limit holds for the whole force: viscosity fills what shear and torsion of the material leave, no more."""
    force, damping, velocity = contact.force, contact.damping, contact.velocity
    length, mu = spin_length(pad, contact.distance), contact.friction if slides else contact.static_friction
    use = limit_surface_use(force, mu, length)
    contact.limit_surface_use = min(use, 1.0)
    if use <= 1.0:
        return
    square, product, room = 0.0, 0.0, (mu * force[2]) ** 2  # |elastic + share viscous|^2 = (mu f_z)^2, in forces
    for k in (0, 1, 3):
        unit = 1.0 if k < 2 else 1.0 / length
        viscous = damping[k] * velocity[k] * unit
        elastic = force[k] * unit - viscous
        square += viscous * viscous
        product += elastic * viscous
        room -= elastic * elastic
    share = 0.0
    if room > 0.0:
        share = room / (product + math.sqrt(product * product + square * room))
    for k in (0, 1, 3):
        force[k] -= (1.0 - share) * damping[k] * velocity[k]
        damping[k] *= share
    use = limit_surface_use(force, mu, length)
    if use > 1.0:  # the normal force is less than that of the law
        for k in (0, 1, 3):
            force[k] = force[k] / use if use < math.inf else 0.0


@compiled
def _release(stiffness):
    """A contact that slips holds its normal direction only."""
    normal = stiffness[2, 2]
    stiffness[:] = 0.0
    stiffness[2, 2] = normal


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


@compiled
def _contact_stiffness(contact, derivatives, stiffness):
    """J_delta^-T (d dF / d delta) J_delta^-1; rows and columns (x, y, z, rotation about z)."""
    to_theta, to_phi, twist = contact.theta_per_x, contact.phi_per_y, contact.psi_per_x
    for row in range(4):  # columns of D J_delta^-1, with J_delta^-1 sparse
        dr, dtheta = derivatives[4 * row], derivatives[4 * row + 1]
        dphi, dpsi = derivatives[4 * row + 2], derivatives[4 * row + 3]
        derivatives[4 * row] = dtheta * to_theta + dpsi * twist
        derivatives[4 * row + 1] = dphi * to_phi
        derivatives[4 * row + 2] = dr
        derivatives[4 * row + 3] = dpsi
    for column in range(4):
        dr, dtheta = derivatives[column], derivatives[4 + column]
        dphi, dpsi = derivatives[8 + column], derivatives[12 + column]
        stiffness[0, column] = dtheta * to_theta + dpsi * twist
        stiffness[1, column] = dphi * to_phi
        stiffness[2, column] = dr
        stiffness[3, column] = dpsi
