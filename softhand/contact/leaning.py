"""How a tip leans while it rolls, and what the energy of its law has to say about that.

A law whose energy U depends on the lean of the tip answers with a moment as well, see `laws.rolling`. Here the two
numbers of the lean are coordinates like all others: their rates are linear in the velocity, two more columns of the
Jacobian of the contact, and the generalized force of U is J^T dU/dlean. So rolling takes what U stores, on every shape.
"""

from __future__ import annotations

import math

import numpy as np

from softhand.contact.address import call
from softhand.contact.axes import turned_tangent
from softhand.contact.geometry import meet_ball
from softhand.contact.records import BALL, SOLID
from softhand.contact.solid import meet_solid
from softhand.numerics.branches import seldom, usually
from softhand.numerics.compiled import compiled

_STEP = 1e-5  # of the radius, in differences of the frame
_MOST = 50.0  # times one over the distance: what turns faster jumps, as the normal does between parts of a union
_FACE = 1


@compiled
def answer_lean(pad, contact):
    """Sets `lean_force`, `lean_elastic` and `moment` at the deformation; after the force of the law was asked for.

    The slope relaxes as the force does, see `damping.recall`; dashpots and friction have no part in it.
    """
    call(pad.slope_function, pad.law_arguments, contact.lean_force)  # type: ignore[call-arg]
    first, second = contact.lean_force[0], contact.lean_force[1]
    if pad.is_damped and usually(contact.is_damped > 0):
        first = contact.kept * first - contact.lean_recalled[0]
        second = contact.kept * second - contact.lean_recalled[1]
    contact.lean_elastic[0], contact.lean_elastic[1] = first, second
    set_moment(contact)


@compiled
def set_moment(contact):
    """`moment`, that of `lean_elastic`."""
    first, second = contact.lean_elastic[0], contact.lean_elastic[1]
    contact.moment[0] = -second * contact.sin_Phi
    contact.moment[1] = first * contact.sin_Phi
    contact.moment[2] = second * contact.lean[0] - first * contact.lean[1]


@compiled
def bend_stiffness(pad, contact, is_loose):
    """`rolling`, the derivative D of `lean_elastic` by the lean, and `leaning`, B, that of the force.

    With the stiffness A of the force they are the second derivatives of the energy. A stepper adds these to its matrix,
    as a longer step needs them; D as far as it makes D - B^T A^-1 B, what is left where the force gives way, not
    negative. After `answer_stiffness`.

    Args:
        pad: one row of `records.PAD`.
        contact: one row of `records.CONTACT`.
        is_loose: of a tip that slips or does not press, whose force does not answer to the lean: B is 0.
    """
    bend, rolling, B = contact.derivatives, contact.rolling, contact.leaning
    call(pad.bend_function, pad.law_arguments, bend)  # type: ignore[call-arg]
    share = contact.kept if pad.is_damped and usually(contact.is_damped > 0) else 1.0
    a, b, c = share * bend[0], 0.5 * share * (bend[1] + bend[2]), share * bend[3]
    for i in range(2):
        B[2, i] = share * bend[4 + 4 * i]
        B[0, i], B[1, i] = share * bend[5 + 4 * i], share * bend[6 + 4 * i]
        B[3, i] = share * bend[7 + 4 * i]
    given, mixed, other = 0.0, 0.0, 0.0
    if not is_loose:
        given, mixed, other = _given(contact.stiffness, B)
    if is_loose or not usually(given >= 0.0):
        B[:] = 0.0
        given, mixed, other = 0.0, 0.0, 0.0
    a, b, c = a - given, b - mixed, c - other
    mean, spread = 0.5 * (a + c), math.sqrt((0.5 * (a - c)) ** 2 + b * b)
    least, most = mean - spread, mean + spread
    if least >= 0.0:
        left, least = 1.0, 0.0
    elif most <= 0.0:
        left, least = 0.0, 0.0
    else:
        left = most / (most - least)
    rolling[0], rolling[1], rolling[2] = left * (a - least) + given, left * b + mixed, left * (c - least) + other


@compiled
def _given(K, B):
    """xx, xy, yy of B^T A^-1 B, A the symmetric part of K; -1 if A is not positive definite."""
    rows = np.empty((4, 6))
    for i in range(4):
        for j in range(4):
            rows[i, j] = 0.5 * (K[i, j] + K[j, i])
        rows[i, 4], rows[i, 5] = B[i, 0], B[i, 1]
    xx, xy, yy = 0.0, 0.0, 0.0
    for i in range(4):
        pivot = rows[i, i]
        if not usually(pivot > 0.0):
            return -1.0, 0.0, 0.0
        xx += rows[i, 4] * rows[i, 4] / pivot
        xy += rows[i, 4] * rows[i, 5] / pivot
        yy += rows[i, 5] * rows[i, 5] / pivot
        for k in range(i + 1, 4):
            part = rows[k, i] / pivot
            for j in range(i + 1, 6):
                rows[k, j] -= part * rows[i, j]
    return xx, xy, yy


@compiled
def set_turning(pad, base_pose, contact):
    """`turning`: how the contact frame turns over the object as the middle of the tip moves along it, W.

        w_C = W (u_x, u_y),   z_C' = w_C x z_C,   x_C' = w_C x x_C        relative to the object, in C_F

    Zero on a plane face, and where the frame jumps. Elsewhere, on curved surfaces, edges and vertices, by central
    differences of the nearest point, which any shape has. After `place_contact`.
    """
    turning, R, n = contact.turning, contact.rotation, contact.normal
    turning[:] = 0.0
    if not (pad.shape == SOLID or pad.shape == BALL):
        return
    if pad.shape == SOLID and pad.chart_function == 0 and usually(contact.feature == _FACE):
        return
    # normal and axes of the frame in the object
    normal, z, distance, feature = (n[0], n[1], n[2]), (R[0, 2], R[1, 2], R[2, 2]), contact.distance, contact.feature
    x = _in_base(base_pose, R[0, 0], R[1, 0], R[2, 0])
    y = _in_base(base_pose, R[0, 1], R[1, 1], R[2, 1])
    tip = contact.tip[0], contact.tip[1], contact.tip[2]
    step = _STEP * pad.radius
    for k in range(2):
        ahead = _frame_at(pad, base_pose, contact, tip, k, step)
        behind = _frame_at(pad, base_pose, contact, tip, k, -step)
        for row in range(3):  # z_C = -n turns towards x by w_y, and away from y by w_x; x turns towards y by w_z
            dn, dt = ahead[row] - behind[row], ahead[3 + row] - behind[3 + row]
            turning[0, k] += dn * y[row] / (2.0 * step)
            turning[1, k] -= dn * x[row] / (2.0 * step)
            turning[2, k] += dt * y[row] / (2.0 * step)
        fastest = max(abs(turning[0, k]), abs(turning[1, k]), abs(turning[2, k]))
        if seldom(not fastest * max(abs(distance), 0.1 * pad.radius) <= _MOST):
            turning[0, k], turning[1, k], turning[2, k] = 0.0, 0.0, 0.0
    # as it was
    contact.distance, contact.feature = distance, feature
    for row in range(3):
        contact.tip[row], n[row], R[row, 2] = tip[row], normal[row], z[row]


@compiled
def leaning_columns(pad, contact, J, column, sign, row):
    """Columns 4 and 5 of the Jacobian of a contact: rates of lean1 and lean2, see `contact_jacobian`.

        lean1' = w_y sin Phi - w_z lean2,   lean2' = w_z lean1 - w_x sin Phi,   w = w_tip - w_C

    with the spin w_tip of the tip relative to the object and w_C of `set_turning`. After columns 0 to 3.
    """
    R, W, l1, l2, upright = contact.rotation, contact.turning, contact.lean[0], contact.lean[1], contact.sin_Phi
    wx, wy, wz = sign * J[3, column], sign * J[4, column], sign * J[5, column]
    x = R[0, 0] * wx + R[1, 0] * wy + R[2, 0] * wz
    y = R[0, 1] * wx + R[1, 1] * wy + R[2, 1] * wz
    z = row[3]
    reach = contact.distance + pad.base_share * (pad.radius - contact.distance)
    u_x, u_y = row[0] - reach * y, row[1] + reach * x  # of the middle of the tip
    x -= W[0, 0] * u_x + W[0, 1] * u_y
    y -= W[1, 0] * u_x + W[1, 1] * u_y
    z -= W[2, 0] * u_x + W[2, 1] * u_y
    row[4], row[5] = y * upright - z * l2, z * l1 - x * upright


@compiled
def let_lean(contact):
    """What does not touch leans for nothing."""
    contact.lean_force[:] = 0.0
    contact.lean_elastic[:] = 0.0
    contact.moment[:] = 0.0
    contact.rolling[:] = 0.0
    contact.leaning[:] = 0.0


@compiled
def _frame_at(pad, base_pose, contact, tip, k, step):
    """Normal and tangent in the object with the middle of the tip so far along an axis of the frame; moves the tip."""
    for row in range(3):
        contact.tip[row] = tip[row] + step * contact.rotation[row, k]
    _meet(pad, base_pose, contact)
    t = turned_tangent(pad, contact.normal)
    return contact.normal[0], contact.normal[1], contact.normal[2], t[0], t[1], t[2]


@compiled
def _meet(pad, base_pose, contact):
    if pad.shape == SOLID:
        meet_solid(pad, base_pose, contact)
    else:
        meet_ball(pad, base_pose, contact)


@compiled
def _in_base(pose, x, y, z):
    """A vector of the world in axes of the base."""
    return (
        pose[0] * x + pose[1] * y + pose[2] * z,
        pose[3] * x + pose[4] * y + pose[5] * z,
        pose[6] * x + pose[7] * y + pose[8] * z,
    )
