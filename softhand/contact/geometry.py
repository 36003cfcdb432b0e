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
    The axes x_C = dp/dTheta and y_C = dp/dPhi (normalised) are those of (17).

    Args:
        pad: one row of `records.PAD`.
        pose: pose of the joint that carries the tip (`Snapshot.poses`), shape (12,).
        object_pose: pose of the object, shape (12,).
        contact: one row of `records.CONTACT`; rotation, point, tip, distance, angles, sin_Phi, cos_Phi are set.
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
    for row in range(3):
        fx, fy, fz = _finger_axes(pad, pose, row)
        contact.rotation[row, 0] = -sin_Theta * fy + cos_Theta * fz
        contact.rotation[row, 1] = cos_Phi * fx - ux * (cos_Theta * fy + sin_Theta * fz)


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
