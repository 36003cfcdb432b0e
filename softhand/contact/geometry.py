"""A tip against a plane face: the closed solution of [Nakashima] Eqs. (13) and (16)."""

from __future__ import annotations

import math

from softhand.compiled import compiled


@compiled
def place_contact(pad, pose, object_pose, contact):
    """Contact frame, contact point, R, Theta and Phi from the poses of the tip and of the object.

    With the outward normal n of the face at the offset d, in world axes, and the tip at p_F:

        z_C = -n,   R = n . (p_F - p_O) - d,   p_C = p_F + R z_C

    and (Theta, Phi) are the polar angles of z_C in F, z_C = (sin Phi, cos Theta cos Phi, sin Theta cos Phi) by (14).
    For a law in polar coordinates the axes x_C = dp/dTheta and y_C = dp/dPhi (normalised) are those of (17). They spin
    at the apex. For a law in surface coordinates x_C is the tangent of the face, and y_C = z_C cross x_C: fixed in the
    object, so that the tangential displacement along them is the integral of the velocity.

    Args:
        pad: one row of `records.PAD`.
        pose: pose of the joint that carries the tip (`Snapshot.poses`), shape (12,).
        object_pose: pose of the object, shape (12,).
        contact: one row of `records.CONTACT`; rotation, point, tip, distance, angles, sin_Phi, cos_Phi, lean and
            the entries of J_delta^-1 are set.
    """
    # z_C in the world, and R
    distance = -pad.face_offset
    for row in range(3):
        tip = pose[9 + row]
        normal = 0.0
        for k in range(3):
            tip += pose[3 * k + row] * pad.position[k]
            normal += object_pose[3 * k + row] * pad.face_normal[k]
        contact.tip[row] = tip
        contact.rotation[row, 2] = -normal
        distance += normal * (tip - object_pose[9 + row])
    contact.distance = distance
    # the axes of F in the world, times z_C: z_C in F
    ux, uy, uz = 0.0, 0.0, 0.0
    for row in range(3):
        z = contact.rotation[row, 2]
        contact.point[row] = contact.tip[row] + distance * z
        fx, fy, fz = _finger_axes(pad, pose, row)
        ux += fx * z
        uy += fy * z
        uz += fz * z
    cos_Phi = math.sqrt(uy * uy + uz * uz)
    cos_Theta = uy / cos_Phi if cos_Phi > 0.0 else 1.0
    sin_Theta = uz / cos_Phi if cos_Phi > 0.0 else 0.0
    contact.sin_Phi, contact.cos_Phi = ux, cos_Phi
    contact.angles[0], contact.angles[1] = math.atan2(uz, uy), math.atan2(ux, cos_Phi)
    if pad.is_surface:
        _face_axes(pad, pose, object_pose, contact)
        contact.theta_per_x, contact.phi_per_y, contact.psi_per_x = 1.0, 1.0, 0.0
        return
    contact.theta_per_x = 1.0 / (distance * cos_Phi)
    contact.phi_per_y = 1.0 / distance
    contact.psi_per_x = -ux * contact.theta_per_x
    for row in range(3):
        fx, fy, fz = _finger_axes(pad, pose, row)
        contact.rotation[row, 0] = -sin_Theta * fy + cos_Theta * fz
        contact.rotation[row, 1] = cos_Phi * fx - ux * (cos_Theta * fy + sin_Theta * fz)


@compiled
def _face_axes(pad, pose, object_pose, contact):
    """x_C along the tangent of the face, y_C = z_C cross x_C, and the components of x_F along them."""
    R, t = contact.rotation, pad.face_tangent
    for row in range(3):
        R[row, 0] = object_pose[row] * t[0] + object_pose[3 + row] * t[1] + object_pose[6 + row] * t[2]
    R[0, 1] = R[1, 2] * R[2, 0] - R[2, 2] * R[1, 0]
    R[1, 1] = R[2, 2] * R[0, 0] - R[0, 2] * R[2, 0]
    R[2, 1] = R[0, 2] * R[1, 0] - R[1, 2] * R[0, 0]
    first, second = 0.0, 0.0
    for row in range(3):
        axis, _, _ = _finger_axes(pad, pose, row)
        first += axis * R[row, 0]
        second += axis * R[row, 1]
    contact.lean[0], contact.lean[1] = first, second


@compiled
def _finger_axes(pad, pose, row):
    """World component `row` of the three axes of F."""
    a, b, c = pose[row], pose[3 + row], pose[6 + row]
    R = pad.rotation
    return (
        a * R[0, 0] + b * R[1, 0] + c * R[2, 0],
        a * R[0, 1] + b * R[1, 1] + c * R[2, 1],
        a * R[0, 2] + b * R[1, 2] + c * R[2, 2],
    )
