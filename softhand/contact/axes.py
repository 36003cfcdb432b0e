"""Axes of a contact: those of the finger frame F in the world, and those along a face that do not spin."""

from __future__ import annotations

import math

from softhand.numerics.branches import seldom
from softhand.numerics.compiled import compiled


@compiled
def finger_axes(pad, pose, row):
    """World component `row` of the three axes of F."""
    a, b, c = pose[row], pose[3 + row], pose[6 + row]
    R = pad.rotation
    return (
        a * R[0, 0] + b * R[1, 0] + c * R[2, 0],
        a * R[0, 1] + b * R[1, 1] + c * R[2, 1],
        a * R[0, 2] + b * R[1, 2] + c * R[2, 2],
    )


@compiled
def face_axes(pad, pose, object_pose, contact):
    """x_C along the tangent of the face, y_C = z_C cross x_C, and the components of x_F along them."""
    R = contact.rotation
    tx, ty, tz = turned_tangent(pad, contact.normal)
    for row in range(3):
        R[row, 0] = object_pose[row] * tx + object_pose[3 + row] * ty + object_pose[6 + row] * tz
    R[0, 1] = R[1, 2] * R[2, 0] - R[2, 2] * R[1, 0]
    R[1, 1] = R[2, 2] * R[0, 0] - R[0, 2] * R[2, 0]
    R[2, 1] = R[0, 2] * R[1, 0] - R[1, 2] * R[0, 0]
    first, second = 0.0, 0.0
    for row in range(3):
        axis, _, _ = finger_axes(pad, pose, row)
        first += axis * R[row, 0]
        second += axis * R[row, 1]
    contact.lean[0], contact.lean[1] = first, second


@compiled
def turned_tangent(pad, normal):
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
