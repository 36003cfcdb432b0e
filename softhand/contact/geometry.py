"""A pad against a plane face, the closed solution of [Nakashima] Eqs. (13) and (16), a solid shape, or a ball."""

from __future__ import annotations

import math

from softhand.contact.axes import face_axes, finger_axes
from softhand.contact.edge import meet_edge
from softhand.contact.records import PLANE, SIDE, SOLID
from softhand.contact.solid import end_at_solid, meet_solid
from softhand.numerics.branches import seldom, usually
from softhand.numerics.compiled import compiled

_POLE = 1e-3  # of the radius: R is taken no nearer to 0, where J_delta and laws have a pole; a run ends long before


@compiled
def find_nearest(pad, pose, base_pose, contact):
    """z_C and R: where the shape of the base is nearest to the centre of the pad.

    Args:
        pad: one row of `records.PAD`.
        pose: pose of the joint that carries the pad (`Snapshot.poses`), shape (12,).
        base_pose: pose of the joint that carries the shape, shape (12,).
        contact: one row of `records.CONTACT`; tip, the third column of rotation, normal, feature, distance are set.
    """
    for row in range(3):
        tip = pose[9 + row]
        for k in range(3):
            tip += pose[3 * k + row] * pad.position[k]
        contact.tip[row] = tip
    if pad.shape == PLANE or pad.shape == SIDE:
        _meet_face(pad, base_pose, contact)
        if pad.semi_axes[0] > 0.0:
            _go_to_deepest(pad, pose, contact)
        if pad.shape == SIDE:
            end_at_solid(pad, base_pose, contact)
    elif pad.shape != SOLID:
        meet_ball(pad, base_pose, contact)
    elif pad.is_edge:
        meet_edge(pad, pose, base_pose, contact)
    else:
        meet_solid(pad, base_pose, contact)
    if not pad.is_support and seldom(abs(contact.distance) < _POLE * pad.radius):
        contact.distance = math.copysign(_POLE * pad.radius, contact.distance)


@compiled
def place_contact(pad, pose, object_pose, contact):
    """Contact frame, contact point, Theta and Phi from the poses of the tip and of the object.

    With the outward normal n of the face at the offset d, in world axes, and the tip at p_F:

        z_C = -n,   R = n . (p_F - p_O) - d,   p_C = p_F + R z_C

    Against a solid shape n points from its nearest point to the tip, and R is the distance: the same over a face, and
    continuous across edges and vertices. With the tip's centre inside, R is minus the depth below the nearest surface.
    Between two balls n lies on the line of their centres, and p_C between them: it lies deeper in the base by the share
    of dr that the base takes.

    (Theta, Phi) are the polar angles of z_C in F, z_C = (sin Phi, cos Theta cos Phi, sin Theta cos Phi) by (14).
    For a law in polar coordinates the axes x_C = dp/dTheta and y_C = dp/dPhi (normalised) are those of (17). They spin
    at the apex. For a law in surface coordinates x_C is the tangent of the face, and y_C = z_C cross x_C: fixed in the
    object, so that the tangential displacement along them is the integral of the velocity.

    Args:
        pad: one row of `records.PAD`.
        pose: pose of the joint that carries the tip (`Snapshot.poses`), shape (12,).
        object_pose: pose of the joint that carries the shape it meets, shape (12,).
        contact: one row of `records.CONTACT`, after `find_nearest`; rotation, point, angles, sin_Phi, cos_Phi, lean and
            the entries of J_delta^-1 are set.
    """
    distance = contact.distance
    reach = distance + pad.base_share * (pad.radius - distance)
    # the axes of F in the world, times z_C: z_C in F
    ux, uy, uz = 0.0, 0.0, 0.0
    for row in range(3):
        z = contact.rotation[row, 2]
        contact.point[row] = contact.tip[row] + reach * z
        fx, fy, fz = finger_axes(pad, pose, row)
        ux += fx * z
        uy += fy * z
        uz += fz * z
    cos_Phi = math.sqrt(uy * uy + uz * uz)
    cos_Theta, sin_Theta = 1.0, 0.0
    if usually(cos_Phi > 0.0):
        cos_Theta, sin_Theta = uy / cos_Phi, uz / cos_Phi
    contact.sin_Phi, contact.cos_Phi = ux, cos_Phi
    contact.angles[0], contact.angles[1] = math.atan2(uz, uy), math.atan2(ux, cos_Phi)
    if pad.is_surface:
        face_axes(pad, pose, object_pose, contact)
        contact.theta_per_x, contact.phi_per_y, contact.psi_per_x = 1.0, 1.0, 0.0
        return
    contact.theta_per_x = 1.0 / (distance * cos_Phi)
    contact.phi_per_y = 1.0 / distance
    contact.psi_per_x = -ux * contact.theta_per_x
    for row in range(3):
        fx, fy, fz = finger_axes(pad, pose, row)
        contact.rotation[row, 0] = -sin_Theta * fy + cos_Theta * fz
        contact.rotation[row, 1] = cos_Phi * fx - ux * (cos_Theta * fy + sin_Theta * fz)


@compiled
def _meet_face(pad, object_pose, contact):
    """z_C in the world and R, against an endless face."""
    distance = -pad.face_offset
    for row in range(3):
        normal = 0.0
        for k in range(3):
            normal += object_pose[3 * k + row] * pad.face_normal[k]
        contact.rotation[row, 2] = -normal
        contact.normal[row] = pad.face_normal[row]
        distance += normal * (contact.tip[row] - object_pose[9 + row])
    contact.distance = distance
    contact.feature = 1


@compiled
def _go_to_deepest(pad, pose, contact):
    """From the middle of an ellipsoid to the point of it that lies deepest in the plane, which z_C points into.

    With the semi-axes A = diag(a, b, c) along F and u = z_C in F, that point is A^2 u / |A u| from the middle, and
    nearer to the plane by |A u|. It is a point of no radius which runs over the ellipsoid as that turns. How deep it is
    changes as if it were fixed there, since it is the deepest: dr' = v_z, and the force does the work that the law
    stores.
    """
    A, x, y, z = pad.semi_axes, 0.0, 0.0, 0.0
    for row in range(3):
        fx, fy, fz = finger_axes(pad, pose, row)
        z_C = contact.rotation[row, 2]
        x, y, z = x + fx * z_C, y + fy * z_C, z + fz * z_C
    reach = math.sqrt((A[0] * x) ** 2 + (A[1] * y) ** 2 + (A[2] * z) ** 2)
    x, y, z = A[0] * A[0] * x / reach, A[1] * A[1] * y / reach, A[2] * A[2] * z / reach
    for row in range(3):
        fx, fy, fz = finger_axes(pad, pose, row)
        contact.tip[row] += fx * x + fy * y + fz * z
    contact.distance -= reach


@compiled
def roll_stiffness(pad, pose, contact):
    """Torque of the normal force N per turn of an ellipsoid, since the place where it touches runs over it.

    A turn by w moves that place by D (z_C x w) and changes the depth in second order by w x z_C . D (w x z_C) / 2, with

        D = (A^2 - s s^T) / |A u| - |A u|,   s = A^2 u / |A u|,   in x_C, y_C

    Sets `rolling`, N D without s s^T and where it is positive: a stepper takes it for stable, and the pole of a thin
    ellipsoid, where the torque changes sides within a turn that a step may jump over, needs the secant, not the slope.
    """
    A, R = pad.semi_axes, contact.rotation
    xx, xy, yy, zz = 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        x, y, z = 0.0, 0.0, 0.0
        for row in range(3):
            axis = finger_axes(pad, pose, row)[k]
            x, y, z = x + axis * R[row, 0], y + axis * R[row, 1], z + axis * R[row, 2]
        x, y, z = A[k] * x, A[k] * y, A[k] * z
        xx, xy, yy, zz = xx + x * x, xy + x * y, yy + y * y, zz + z * z
    share = contact.force[2] / math.sqrt(zz)
    rolling = contact.rolling
    rolling[0], rolling[1], rolling[2] = share * max(xx - zz, 0.0), 0.0, share * max(yy - zz, 0.0)
    if xx > zz and yy > zz:
        rolling[1] = share * xy


@compiled
def meet_ball(pad, object_pose, contact):
    """z_C in the world and R, against a ball; the two centres must not coincide."""
    square = 0.0
    for row in range(3):
        centre = object_pose[9 + row]
        for k in range(3):
            centre += object_pose[3 * k + row] * pad.ball_centre[k]
        gap = contact.tip[row] - centre
        contact.rotation[row, 2] = -gap
        square += gap * gap
    length = math.sqrt(square)
    for row in range(3):
        contact.rotation[row, 2] /= length
    for k in range(3):
        contact.normal[k] = 0.0
        for row in range(3):
            contact.normal[k] -= object_pose[3 * k + row] * contact.rotation[row, 2]
    contact.distance = length - pad.ball_radius
    contact.feature = 1
