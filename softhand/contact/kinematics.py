"""Contact velocities and what they do to the deformation, [Nakashima] Eqs. (21)-(43)."""

from __future__ import annotations

import math

from softhand.contact.address import call
from softhand.contact.leaning import leaning_columns
from softhand.contact.sliders import react_again
from softhand.numerics.branches import seldom
from softhand.numerics.compiled import compiled


@compiled
def contact_jacobian(pad, contact, columns, J, jacobian):
    """Columns of [J_CF, -J_O] in C_F that are not zero, in the velocities of the rigid-body model.

    Row a of `jacobian` is (v_x, v_y, v_z, w_z), the velocity of the tip's material point at the contact relative to the
    object's, for the velocity `columns[a]`, Eqs. (35), (42).

    Args:
        pad: one row of `records.PAD`; its `own` first columns move the tip.
        contact: one row of `records.CONTACT`, after `place_contact`.
        columns: velocities that move the tip, then those that move the object, padded with -1, shape (width,).
        J: world Jacobians of `Snapshot`.
        jacobian: set, shape (width, 4), or (width, 6): then also, of a pad whose law has a moment, the rates of its
            lean, see `leaning_columns`, and of an ellipsoid those at which z_C turns towards x_C and y_C as it sees it.
    """
    px, py, pz = contact.point[0], contact.point[1], contact.point[2]
    R, own, rolls = contact.rotation, pad.own, pad.semi_axes[0] > 0.0
    for a in range(columns.shape[0]):
        column = columns[a]
        if column < 0:
            break
        sign = 1.0 if a < own else -1.0
        column += pad.first_twist
        wx, wy, wz = sign * J[3, column], sign * J[4, column], sign * J[5, column]
        vx = sign * J[0, column] + wy * pz - wz * py
        vy = sign * J[1, column] + wz * px - wx * pz
        vz = sign * J[2, column] + wx * py - wy * px
        for row in range(3):
            jacobian[a, row] = R[0, row] * vx + R[1, row] * vy + R[2, row] * vz
        jacobian[a, 3] = R[0, 2] * wx + R[1, 2] * wy + R[2, 2] * wz
        if rolls:
            jacobian[a, 4] = R[0, 1] * wx + R[1, 1] * wy + R[2, 1] * wz
            jacobian[a, 5] = -(R[0, 0] * wx + R[1, 0] * wy + R[2, 0] * wz)
        elif pad.slope_function != 0:
            leaning_columns(pad, contact, J, column, sign, jacobian[a])


@compiled
def relative_velocity(columns, jacobian, v, velocity):
    """velocity = [J_CF, -J_O] v, shape (4,)."""
    x, y, z, w = 0.0, 0.0, 0.0, 0.0
    for a in range(columns.shape[0]):
        if columns[a] < 0:
            break
        speed = v[columns[a]]
        x += jacobian[a, 0] * speed
        y += jacobian[a, 1] * speed
        z += jacobian[a, 2] * speed
        w += jacobian[a, 3] * speed
    velocity[0], velocity[1], velocity[2], velocity[3] = x, y, z, w


@compiled
def deformation_rate(contact, velocity, rate):
    """rate = J_delta^-1 velocity, Eq. (43) solved for the deformation.

        J_delta = [0, R cosPhi, 0, 0;  0, 0, R, 0;  1, 0, 0, 0;  0, sinPhi, 0, 1]          (37), (42)

    In surface coordinates J_delta only puts the components in order: dr' = v_z, s' = v_xy, psi' = w_z.

    Args:
        contact: one row of `records.CONTACT`, after `place_contact`.
        velocity: v_x, v_y, v_z [m/s], w_z [rad/s] in C_F, shape (4,).
        rate: of dr [m/s], dtheta, dphi, dpsi [rad/s], or of dr, s1, s2 [m/s], psi [rad/s], shape (4,).
    """
    rate[0] = velocity[2]
    rate[1] = contact.theta_per_x * velocity[0]
    rate[2] = contact.phi_per_y * velocity[1]
    rate[3] = velocity[3] + contact.psi_per_x * velocity[0]


@compiled
def move_contacts(pads, columns, contacts, jacobian, v):
    """The velocities of the contacts at v, and the viscous forces there, with the frames of the last evaluation."""
    for i in range(contacts.shape[0]):
        contact = contacts[i]
        if pads[i].is_support and seldom(contact.is_idle > 0):
            continue
        relative_velocity(columns[i], jacobian[i], v, contact.velocity)
        deformation_rate(contact, contact.velocity, contact.deformation_rate)
        contact.pressing_rate = contact.velocity[2]
        react_again(pads[i], contact)


@compiled
def integrate_memory(pads, columns, contacts, jacobian, v, step, z):
    """z += h z'(v) but for what relaxes, with the frames of the last evaluation; sets the velocities at v."""
    move_contacts(pads, columns, contacts, jacobian, v)
    for i in range(contacts.shape[0]):
        first = 0
        for _ in range(pads[i].elements):
            for k in range(3):
                z[i, first + k] += step * contacts[i].deformation_rate[1 + k]
            first += pads[i].block


@compiled
def deformation_jacobian(distance, sin_Phi, cos_Phi, J_delta):
    """J_delta of (37), (42): contact velocity in C_F from the rate of (dr, dtheta, dphi, dpsi), shape (4, 4).

    Of the polar coordinates; that of the surface coordinates has ones in the places of the first three entries.
    """
    J_delta[:] = 0.0
    J_delta[0, 1] = distance * cos_Phi
    J_delta[1, 2] = distance
    J_delta[2, 0] = 1.0
    J_delta[3, 1] = sin_Phi
    J_delta[3, 3] = 1.0


@compiled
def contact_coordinates(pad, contact, columns, object_pose, J, v, eta, eta_rate):
    """eta = (theta, phi, alpha_o, psi) of (15), (20) and its rate by (38)-(41).

    With E = [0 -1; 1 0], K_go, M_go and T_go of the object's surface and (v, w) the rolling velocity V_C of (35):

        alpha_f' = M_f^-1 K_R^-1 (E w_xy - R_psi K_go R_psi v_xy)                                       (38)
        alpha_o' = M_go^-1 R_psi^-1 K_R^-1 (E w_xy + v_xy / R)          (39), with + where the paper prints -
        psi'     = w_z + sinPhi theta' + T_go M_go alpha_o'                                             (40)
        K_R      = 1 / R + R_psi K_go R_psi                                                             (41)

    A plane face has K_go = 0, M_go = I, T_go = 0, and alpha_o are the coordinates of the contact point in the face
    frame, whose origin is the foot of the perpendicular from the object frame's origin. Curved shapes have coordinates
    of their own. V_C is the relative velocity less that of the deformation, as it is: slip takes from the deformation
    what (43) gives it, so that what slips rolls on, at the mean rate of the last step. Under a law in surface
    coordinates there is no polar deformation: theta, phi and psi are then the angles Theta, Phi and Psi of the deformed
    tip, and (38)-(40) hold with V_C the whole relative velocity.

    Theta is in (-pi, pi], Phi in [-pi/2, pi/2], Psi in (-pi, pi]; theta, phi and psi differ from them by the
    deformation. Angles among alpha_o have the ranges of their shape.

    Args:
        pad: one row of `records.PAD`.
        contact: one row of `records.CONTACT`, evaluated, its `slip_speed` that of the last step.
        columns: as in `contact_jacobian`.
        object_pose: pose of the object, shape (12,).
        J: world Jacobians of `Snapshot`.
        v: velocity, shape (nv,).
        eta: theta, phi [rad], alpha_o [m or rad] (two), psi [rad], set, shape (5,).
        eta_rate: set, shape (5,).
    """
    R = contact.rotation
    cosine, sine = _polar_axes(pad, contact)
    # C_O in the world; x_C of (17) in it gives Psi
    x_C_x, x_C_y, alpha_x, alpha_y = 0.0, 0.0, 0.0, 0.0
    n, chart = pad.face_normal, contact.near
    tx, ty, tz = pad.face_tangent[0], pad.face_tangent[1], pad.face_tangent[2]
    if pad.chart_function != 0:
        _read_chart(pad, contact, object_pose, chart)
        n = contact.normal
        tx, ty, tz = chart[10], chart[11], chart[12]
    sx, sy, sz = n[1] * tz - n[2] * ty, n[2] * tx - n[0] * tz, n[0] * ty - n[1] * tx
    for row in range(3):
        tangent = object_pose[row] * tx + object_pose[3 + row] * ty + object_pose[6 + row] * tz
        second = object_pose[row] * sx + object_pose[3 + row] * sy + object_pose[6 + row] * sz
        arm = contact.point[row] - object_pose[9 + row]
        x_C = cosine * R[row, 0] + sine * R[row, 1]
        x_C_x += tangent * x_C
        x_C_y += second * x_C
        alpha_x += tangent * arm
        alpha_y += second * arm
    dtheta, dphi, dpsi, theta_rate, phi_rate, psi_rate = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if not pad.is_surface:
        dtheta, dphi, dpsi = contact.deformation[1], contact.deformation[2], contact.deformation[3]
        theta_rate = contact.deformation_rate[1] - contact.slip_speed[0]
        phi_rate = contact.deformation_rate[2] - contact.slip_speed[1]
        psi_rate = contact.deformation_rate[3] - contact.slip_speed[2]
    eta[0], eta[1] = contact.angles[0] + dtheta, contact.angles[1] + dphi
    eta[2], eta[3] = alpha_x, alpha_y
    if pad.chart_function != 0:
        eta[2], eta[3] = chart[8], chart[9]
    eta[4] = math.atan2(-x_C_y, x_C_x) - dpsi
    relative_x, relative_y = _relative_spin(pad, contact, columns, J, v)
    wx = cosine * relative_x + sine * relative_y + phi_rate
    wy = cosine * relative_y - sine * relative_x - contact.cos_Phi * theta_rate
    distance, velocity = contact.distance, contact.velocity
    vx = cosine * velocity[0] + sine * velocity[1] - distance * contact.cos_Phi * theta_rate
    vy = cosine * velocity[1] - sine * velocity[0] - distance * phi_rate
    wz = velocity[3] - contact.sin_Phi * theta_rate - psi_rate
    if pad.chart_function != 0:
        wx, wy, wz = _roll_on(chart, x_C_x, x_C_y, distance, vx, vy, wx, wy, wz, eta_rate)
    else:
        along, across = -distance * wy + vx, distance * wx + vy
        eta_rate[2] = x_C_x * along + x_C_y * across  # R_psi = [cosPsi -sinPsi; -sinPsi -cosPsi] is its own inverse
        eta_rate[3] = x_C_y * along - x_C_x * across
    eta_rate[0], eta_rate[1] = -wy / contact.cos_Phi, wx
    eta_rate[4] = wz + contact.sin_Phi * eta_rate[0]


@compiled
def _read_chart(pad, contact, object_pose, chart):
    """What the shape says of its surface at the contact point, see `model.shapes.shape`."""
    for k in range(3):
        chart[k] = 0.0
        for row in range(3):
            chart[k] += object_pose[3 * k + row] * (contact.point[row] - object_pose[9 + row])
        chart[3 + k] = contact.normal[k]
    call(pad.chart_function, pad.shape_data, chart)  # type: ignore[call-arg]


@compiled
def _roll_on(chart, x_C_x, x_C_y, distance, vx, vy, wx, wy, wz, eta_rate):
    """Sets alpha_o' by (39); returns the w_xy that makes (38) that of a plane, and w_z with T_go M_go alpha_o' of (40).

    All in axes of C_O, where K_R is 1 / R + K_go; R_psi turns into it and back.
    """
    k11, k12, k22 = chart[16], chart[17], chart[18]
    a, b = x_C_y * wx - x_C_x * wy, -x_C_y * wy - x_C_x * wx  # E w_xy
    p, q = x_C_x * vx + x_C_y * vy, x_C_y * vx - x_C_x * vy  # v_xy
    r11, r22 = 1.0 / distance + k11, 1.0 / distance + k22
    determinant = r11 * r22 - k12 * k12
    first, second = a + p / distance, b + q / distance
    moved = (r22 * first - k12 * second) / determinant  # M_go alpha_o'
    turned = (r11 * second - k12 * first) / determinant
    eta_rate[3] = turned / chart[15]
    eta_rate[2] = (moved - chart[14] * eta_rate[3]) / chart[13]
    first, second = a - k11 * p - k12 * q, b - k12 * p - k22 * q
    along = (r22 * first - k12 * second) / (determinant * distance)
    across = (r11 * second - k12 * first) / (determinant * distance)
    return (
        x_C_y * along - x_C_x * across,
        -x_C_x * along - x_C_y * across,
        wz + chart[19] * moved + chart[20] * turned,
    )


@compiled
def _polar_axes(pad, contact):
    """Cosine and sine of the angle about z_C from x_C of the contact frame to x_C of (17)."""
    if not pad.is_surface or contact.cos_Phi == 0.0:
        return 1.0, 0.0
    return contact.lean[1] / contact.cos_Phi, -contact.lean[0] / contact.cos_Phi


@compiled
def _relative_spin(pad, contact, columns, J, v):
    """Angular velocity of the tip relative to the object along x and y of the contact frame."""
    x, y, z = 0.0, 0.0, 0.0
    for a in range(columns.shape[0]):
        column = columns[a]
        if column < 0:
            break
        speed = v[column] if a < pad.own else -v[column]
        column += pad.first_twist
        x, y, z = x + J[3, column] * speed, y + J[4, column] * speed, z + J[5, column] * speed
    R = contact.rotation
    return R[0, 0] * x + R[1, 0] * y + R[2, 0] * z, R[0, 1] * x + R[1, 1] * y + R[2, 1] * z
