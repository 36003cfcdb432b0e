"""An edge of one body against a convex solid: where it crosses edges or rims of that, or dips into it."""

from __future__ import annotations

from softhand.contact.axes import finger_axes
from softhand.contact.solid import APART, SAME, meet_solid
from softhand.numerics.compiled import compiled
from softhand.numerics.triples import dot, length, moved, times_number

_HALVINGS = 40  # of an edge, until its deepest point is known to the digits of a double
_STEEP = 0.05  # length of a mean of two normals below which these are opposite, and how much their slopes must differ


@compiled
def meet_edge(pad, pose, base_pose, contact):
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
    m, forward = (contact.tip[0], contact.tip[1], contact.tip[2]), -1.0 if pad.way < 0 else 1.0
    e = times_number(forward, (_along(pad, pose, 0), _along(pad, pose, 1), _along(pad, pose, 2)))
    meet_solid(pad, base_pose, contact)
    if contact.distance >= pad.half_length:
        return
    low, high = -pad.half_length, pad.half_length
    a = _normal_at(pad, base_pose, contact, moved(m, low, e))
    ends_here = dot(a, e) >= 0.0
    b = _normal_at(pad, base_pose, contact, moved(m, high, e))
    is_out, rises = contact.distance > 0.0, dot(b, e) > 0.0
    if pad.way == 0 and (ends_here or not rises):
        contact.distance = APART
        return
    if not rises:
        low, a = high, b
    elif ends_here:
        high = low
        _normal_at(pad, base_pose, contact, moved(m, low, e))
    else:
        low, a, high, b = _deepest(pad, base_pose, contact, m, e, low, a, high, b)
    if contact.distance >= 0.0:
        contact.distance = APART
        return
    if pad.way != 0:
        high, b = _leaving(pad, base_pose, contact, m, e, high, b, is_out)
        if dot(a, b) > SAME:
            contact.distance = APART
            return
        a = _before_side(pad, base_pose, contact, m, e, low, a, high, b)
    _meet_between(pad, base_pose, contact, e, a, b)


@compiled
def _deepest(pad, base_pose, contact, m, e, low, a, high, b):
    """The deepest point of m + t e, between low and high with the normals a and b there; both close in on it."""
    for _ in range(_HALVINGS):
        t = 0.5 * (low + high)
        n = _normal_at(pad, base_pose, contact, moved(m, t, e))
        if dot(n, e) < 0.0:
            low, a = t, n
        else:
            high, b = t, n
    return low, a, high, b


@compiled
def _leaving(pad, base_pose, contact, m, e, inside, b, is_out):
    """Where the edge leaves the solid towards its end, or that end if it does not, and the normal there."""
    outside = pad.half_length
    if not is_out:
        return outside, _normal_at(pad, base_pose, contact, moved(m, outside, e))
    for _ in range(_HALVINGS):
        t = 0.5 * (inside + outside)
        n = _normal_at(pad, base_pose, contact, moved(m, t, e))
        if contact.distance < 0.0:
            inside, b = t, n
        else:
            outside = t
    return inside, b


@compiled
def _before_side(pad, base_pose, contact, m, e, low, a, high, b):
    """The normal just before the edge comes to the side of normal b; the contact is then there."""
    for _ in range(_HALVINGS):
        t = 0.5 * (low + high)
        n = _normal_at(pad, base_pose, contact, moved(m, t, e))
        if dot(n, b) > SAME:
            high = t
        else:
            low, a = t, n
    return a


@compiled
def _meet_between(pad, base_pose, contact, e, a, b):
    """z_C in the world and R, by the mean of the normals a and b on both sides that is at a right angle to the edge."""
    down, up = dot(a, e), dot(b, e)
    if pad.way != 0 and up - down < _STEEP:
        contact.distance = APART
        return
    share = up / (up - down)
    mean = moved(times_number(share, a), 1.0 - share, b)
    size = length(mean)
    if not size > _STEEP:
        contact.distance = APART
        return
    n, depth = (mean[0] / size, mean[1] / size, mean[2] / size), -contact.distance
    if pad.way == 0:
        contact.distance = -depth * size
    else:  # from the point of equal depth to that on the common normal of both edges
        contact.distance = -depth / size
        t = (depth - depth / size * dot(n, b)) / up
        if abs(up) < abs(down):
            t = (depth - depth / size * dot(n, a)) / down
        for k in range(3):
            contact.tip[k] += t * e[k]
    contact.feature = 2
    for k in range(3):
        contact.rotation[k, 2] = -n[k]
    for k in range(3):
        contact.normal[k] = 0.0
        for row in range(3):
            contact.normal[k] -= base_pose[3 * k + row] * contact.rotation[row, 2]


@compiled
def _along(pad, pose, row):
    """World component `row` of x_F, which an edge lies along."""
    x, _, _ = finger_axes(pad, pose, row)
    return x


@compiled
def _normal_at(pad, base_pose, contact, place):
    """Normal of the solid in the world at a place; the contact is then there."""
    contact.tip[0], contact.tip[1], contact.tip[2] = place
    meet_solid(pad, base_pose, contact)
    return -contact.rotation[0, 2], -contact.rotation[1, 2], -contact.rotation[2, 2]
