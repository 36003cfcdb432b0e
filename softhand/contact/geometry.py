"""A pad against a plane face, the closed solution of [Nakashima] Eqs. (13) and (16), a solid shape, or a ball."""

from __future__ import annotations

import math

from softhand.contact.address import call
from softhand.contact.records import PLANE, SIDE, SOLID
from softhand.numerics.branches import seldom, usually
from softhand.numerics.compiled import compiled

_HALVINGS = 40  # of an edge, until its deepest point is known to the digits of a double
_APART = 1.0  # [m] the distance of what cannot touch where it is
_STEEP = 0.05  # length of a mean of two normals below which these are opposite, and how much their slopes must differ
_SAME = 1.0 - 1e-9  # cosine of two normals that are one
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
            _end_at_solid(pad, base_pose, contact)
    elif pad.shape != SOLID:
        _meet_ball(pad, base_pose, contact)
    elif pad.is_edge:
        _meet_edge(pad, pose, base_pose, contact)
    else:
        _meet_solid(pad, base_pose, contact)
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
        fx, fy, fz = _finger_axes(pad, pose, row)
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
        fx, fy, fz = _finger_axes(pad, pose, row)
        z_C = contact.rotation[row, 2]
        x, y, z = x + fx * z_C, y + fy * z_C, z + fz * z_C
    reach = math.sqrt((A[0] * x) ** 2 + (A[1] * y) ** 2 + (A[2] * z) ** 2)
    x, y, z = A[0] * A[0] * x / reach, A[1] * A[1] * y / reach, A[2] * A[2] * z / reach
    for row in range(3):
        fx, fy, fz = _finger_axes(pad, pose, row)
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
            axis = _finger_axes(pad, pose, row)[k]
            x, y, z = x + axis * R[row, 0], y + axis * R[row, 1], z + axis * R[row, 2]
        x, y, z = A[k] * x, A[k] * y, A[k] * z
        xx, xy, yy, zz = xx + x * x, xy + x * y, yy + y * y, zz + z * z
    share = contact.force[2] / math.sqrt(zz)
    rolling = contact.rolling
    rolling[0], rolling[1], rolling[2] = share * max(xx - zz, 0.0), 0.0, share * max(yy - zz, 0.0)
    if xx > zz and yy > zz:
        rolling[1] = share * xy


@compiled
def _meet_solid(pad, base_pose, contact):
    """z_C in the world and R, against the nearest point of a solid."""
    if pad.nearest_function != 0:
        _meet_shape(pad, base_pose, contact)
    else:
        _meet_box(pad, base_pose, contact)


@compiled
def _end_at_solid(pad, base_pose, contact):
    """A side of a solid is met only where the deepest point lies in the solid, and nearer to no other side."""
    distance = contact.distance
    if distance >= 0.0:
        return
    _meet_solid(pad, base_pose, contact)
    n, along = pad.face_normal, 0.0
    for k in range(3):
        along += n[k] * contact.normal[k]
    inside = contact.distance < 0.0 and along > _SAME
    contact.distance = distance if inside else _APART


@compiled
def _meet_edge(pad, pose, base_pose, contact):
    """z_C in the world and R, where an edge crosses an edge or a rim of a convex solid, or dips into a curved surface.

    Its ends are corners, which are pads of their own. Along the edge the signed distance is convex, and n . e with the
    direction e its slope. In a curved surface the edge is deepest where that is zero. A polyhedron it passes one side
    after the other; an edge that reaches over it may lie flat on a side, where its deepest point would be now here and
    now there. So it is two pads: `way` says towards which end the side is sought through which the edge leaves, and
    where it comes to that side, n jumps. The mean of both n that is at a right angle to e is at a right angle to both
    edges, and the distance that of two lines. So dr' = v_z, and the force gives back what it took.

    Where an edge crosses the rim of a round body, that mean has the length l < 1, and the greatest depth d along the
    edge changes as d' = l v_z; with l d as the depth of a spring k it gives back what it took too, k d^2 / 2.
    """
    mx, my, mz = contact.tip[0], contact.tip[1], contact.tip[2]
    forward = -1.0 if pad.way < 0 else 1.0
    ex, ey = forward * _finger_axis(pad, pose, 0), forward * _finger_axis(pad, pose, 1)
    ez = forward * _finger_axis(pad, pose, 2)
    _meet_solid(pad, base_pose, contact)
    if contact.distance >= pad.half_length:
        return
    # the deepest point, between low and high
    low, high = -pad.half_length, pad.half_length
    ax, ay, az = _normal_along(pad, base_pose, contact, mx + low * ex, my + low * ey, mz + low * ez)
    ends_here = ax * ex + ay * ey + az * ez >= 0.0
    bx, by, bz = _normal_along(pad, base_pose, contact, mx + high * ex, my + high * ey, mz + high * ez)
    is_out, rises = contact.distance > 0.0, bx * ex + by * ey + bz * ez > 0.0
    if pad.way == 0 and (ends_here or not rises):
        contact.distance = _APART
        return
    if not rises:
        low = high
        ax, ay, az = bx, by, bz
    elif ends_here:
        high = low
        _normal_along(pad, base_pose, contact, mx + low * ex, my + low * ey, mz + low * ez)
    else:
        for _ in range(_HALVINGS):
            t = 0.5 * (low + high)
            nx, ny, nz = _normal_along(pad, base_pose, contact, mx + t * ex, my + t * ey, mz + t * ez)
            if nx * ex + ny * ey + nz * ez < 0.0:
                low, ax, ay, az = t, nx, ny, nz
            else:
                high, bx, by, bz = t, nx, ny, nz
    if contact.distance >= 0.0:
        contact.distance = _APART
        return
    if pad.way != 0:
        # where it leaves, and where it comes to the side through which it does, or that is nearest to its end
        inside, outside = high, pad.half_length
        if is_out:
            for _ in range(_HALVINGS):
                t = 0.5 * (inside + outside)
                nx, ny, nz = _normal_along(pad, base_pose, contact, mx + t * ex, my + t * ey, mz + t * ez)
                if contact.distance < 0.0:
                    inside, bx, by, bz = t, nx, ny, nz
                else:
                    outside = t
        else:
            inside = outside
            bx, by, bz = _normal_along(pad, base_pose, contact, mx + inside * ex, my + inside * ey, mz + inside * ez)
        high = inside
        if ax * bx + ay * by + az * bz > _SAME:
            contact.distance = _APART
            return
        for _ in range(_HALVINGS):
            t = 0.5 * (low + high)
            nx, ny, nz = _normal_along(pad, base_pose, contact, mx + t * ex, my + t * ey, mz + t * ez)
            if nx * bx + ny * by + nz * bz > _SAME:
                high = t
            else:
                low, ax, ay, az = t, nx, ny, nz
    down, up = ax * ex + ay * ey + az * ez, bx * ex + by * ey + bz * ez
    if pad.way != 0 and up - down < _STEEP:
        contact.distance = _APART
        return
    share = up / (up - down)
    nx, ny, nz = share * ax + (1.0 - share) * bx, share * ay + (1.0 - share) * by, share * az + (1.0 - share) * bz
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    if not length > _STEEP:
        contact.distance = _APART
        return
    nx, ny, nz, depth = nx / length, ny / length, nz / length, -contact.distance
    if pad.way == 0:
        contact.distance = -depth * length
    else:  # from the point of equal depth to that on the common normal of both edges
        contact.distance = -depth / length
        t = (depth - depth / length * (nx * bx + ny * by + nz * bz)) / up
        if abs(up) < abs(down):
            t = (depth - depth / length * (nx * ax + ny * ay + nz * az)) / down
        contact.tip[0], contact.tip[1], contact.tip[2] = (
            contact.tip[0] + t * ex, contact.tip[1] + t * ey, contact.tip[2] + t * ez,
        )  # fmt: skip
    contact.feature = 2
    contact.rotation[0, 2], contact.rotation[1, 2], contact.rotation[2, 2] = -nx, -ny, -nz
    for k in range(3):
        contact.normal[k] = 0.0
        for row in range(3):
            contact.normal[k] -= base_pose[3 * k + row] * contact.rotation[row, 2]


@compiled
def _finger_axis(pad, pose, row):
    """World component `row` of x_F."""
    x, _, _ = _finger_axes(pad, pose, row)
    return x


@compiled
def _normal_along(pad, base_pose, contact, x, y, z):
    """Normal of the solid in the world at a point; the contact is then there."""
    contact.tip[0], contact.tip[1], contact.tip[2] = x, y, z
    _meet_solid(pad, base_pose, contact)
    return -contact.rotation[0, 2], -contact.rotation[1, 2], -contact.rotation[2, 2]


@compiled
def _meet_box(pad, object_pose, contact):
    """z_C in the world and R, against the nearest point of a solid box."""
    square, beyond = 0.0, 0
    for k in range(3):
        contact.normal[k] = 0.0
    for axis in range(3):
        along = _along_side(pad, object_pose, contact, axis)
        gap = along - min(max(along, -pad.box_half[axis]), pad.box_half[axis])
        beyond += int(gap != 0.0)
        square += gap * gap
        for k in range(3):
            contact.normal[k] += gap * pad.box_rotation[k, axis]
    if usually(square > 0.0):
        contact.distance, contact.feature = math.sqrt(square), beyond
        for k in range(3):
            contact.normal[k] /= contact.distance
    else:
        _meet_box_from_inside(pad, object_pose, contact)
    for row in range(3):
        contact.rotation[row, 2] = -(
            object_pose[row] * contact.normal[0]
            + object_pose[3 + row] * contact.normal[1]
            + object_pose[6 + row] * contact.normal[2]
        )


@compiled
def _along_side(pad, object_pose, contact, axis):
    """How far the tip is from the middle of the box along one of its sides."""
    along = -(
        pad.box_rotation[0, axis] * pad.box_centre[0]
        + pad.box_rotation[1, axis] * pad.box_centre[1]
        + pad.box_rotation[2, axis] * pad.box_centre[2]
    )
    for k in range(3):
        local = 0.0
        for row in range(3):
            local += object_pose[3 * k + row] * (contact.tip[row] - object_pose[9 + row])
        along += pad.box_rotation[k, axis] * local
    return along


@compiled
def _meet_box_from_inside(pad, object_pose, contact):
    """Normal, minus the depth, and feature where the nearest point is on a face outwards."""
    depth, inward, side = -math.inf, 0, 1.0
    for axis in range(3):
        along = _along_side(pad, object_pose, contact, axis)
        if abs(along) - pad.box_half[axis] > depth:
            depth, inward, side = abs(along) - pad.box_half[axis], axis, math.copysign(1.0, along)
    contact.distance, contact.feature = depth, 1
    for k in range(3):
        contact.normal[k] = side * pad.box_rotation[k, inward]


@compiled
def _meet_ball(pad, object_pose, contact):
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


@compiled
def _meet_shape(pad, object_pose, contact):
    """z_C in the world and R, against the nearest point of a shape, which its function gives."""
    near = contact.near
    for k in range(3):
        near[k] = 0.0
        for row in range(3):
            near[k] += object_pose[3 * k + row] * (contact.tip[row] - object_pose[9 + row])
    call(pad.nearest_function, pad.shape_data, near)  # type: ignore[call-arg]
    for k in range(3):
        contact.normal[k] = near[3 + k]
    contact.distance = near[6]
    contact.feature = int(near[7])
    for row in range(3):
        contact.rotation[row, 2] = -(
            object_pose[row] * near[3] + object_pose[3 + row] * near[4] + object_pose[6 + row] * near[5]
        )


@compiled
def _turned_tangent(pad, normal):
    """The tangent at the start, turned as little as brings the normal there onto that of the contact.

    So the axes are a function of the normal alone: fixed in a face, continuous over edges and along curved surfaces,
    and without a memory. Along a great circle of normals through that of the start, as of a tip that rolls straight on,
    they do not spin about the normal. Along any other way they spin by the solid angle between that way and the great
    circles to its ends, and the stored displacement (s1, s2), which keeps its components, turns with them. It keeps its
    length, so no energy comes or goes for a law that is isotropic in s. Carried over the object without any spin, s
    would come back from a closed way turned by the solid angle of that way; carried over the tip, by another. Neither
    is more right than the other, and all differ by as little as the solid angle.
    """
    n, t = pad.face_normal, pad.face_tangent
    cosine = n[0] * normal[0] + n[1] * normal[1] + n[2] * normal[2]
    if seldom(cosine >= 1.0 - 1e-15):
        return t[0], t[1], t[2]
    if seldom(cosine < -0.999):  # on the far side no such turn is defined
        along = t[0] * normal[0] + t[1] * normal[1] + t[2] * normal[2]
        x, y, z = t[0] - along * normal[0], t[1] - along * normal[1], t[2] - along * normal[2]
        length = math.sqrt(x * x + y * y + z * z)
        return x / length, y / length, z / length
    wx, wy, wz = (
        n[1] * normal[2] - n[2] * normal[1],
        n[2] * normal[0] - n[0] * normal[2],
        n[0] * normal[1] - n[1] * normal[0],
    )
    ax, ay, az = wy * t[2] - wz * t[1], wz * t[0] - wx * t[2], wx * t[1] - wy * t[0]
    share = 1.0 / (1.0 + cosine)
    return (
        t[0] + ax + share * (wy * az - wz * ay),
        t[1] + ay + share * (wz * ax - wx * az),
        t[2] + az + share * (wx * ay - wy * ax),
    )


@compiled
def _face_axes(pad, pose, object_pose, contact):
    """x_C along the tangent of the face, y_C = z_C cross x_C, and the components of x_F along them."""
    R = contact.rotation
    tx, ty, tz = _turned_tangent(pad, contact.normal)
    for row in range(3):
        R[row, 0] = object_pose[row] * tx + object_pose[3 + row] * ty + object_pose[6 + row] * tz
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
