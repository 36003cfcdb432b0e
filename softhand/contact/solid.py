"""The nearest point of a solid: of a box by formulas of its own, of any other shape by its function."""

from __future__ import annotations

import math

from softhand.contact.address import call
from softhand.numerics.branches import usually
from softhand.numerics.compiled import compiled

APART = 1.0
"""Distance of what cannot touch where it is [m]."""
SAME = 1.0 - 1e-9
"""Cosine of two normals that are one."""


@compiled
def meet_solid(pad, base_pose, contact):
    """z_C in the world and R, against the nearest point of a solid."""
    if pad.nearest_function != 0:
        _meet_shape(pad, base_pose, contact)
    else:
        _meet_box(pad, base_pose, contact)


@compiled
def end_at_solid(pad, base_pose, contact):
    """A side of a solid is met only where the deepest point lies in the solid, and nearer to no other side."""
    distance = contact.distance
    if distance >= 0.0:
        return
    meet_solid(pad, base_pose, contact)
    n, along = pad.face_normal, 0.0
    for k in range(3):
        along += n[k] * contact.normal[k]
    inside = contact.distance < 0.0 and along > SAME
    contact.distance = distance if inside else APART


@compiled
def _meet_shape(pad, object_pose, contact):
    """z_C in the world and R, against the nearest point of a shape, which its function gives."""
    near = contact.near
    for k in range(3):
        near[k] = 0.0
        for row in range(3):
            near[k] += object_pose[3 * k + row] * (contact.tip[row] - object_pose[9 + row])
    near[8] = pad.radius
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
