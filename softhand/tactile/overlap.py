"""Kernel: how much of a contact each taxel has, by the overlap of the undeformed tip with the object."""

from __future__ import annotations

import math

from softhand.contact.records import PLANE
from softhand.numerics.compiled import compiled
from softhand.tactile.solid import set_depths


@compiled
def weigh(skin, i, pad, contact, base_pose):
    """The weight of each taxel in the force of its contact.

    A taxel at r v in the contact frame lies p = r v_z - R below the tangent plane of the object and d below its
    surface: d = p on a plane face, and less over an edge, a vertex or a curved surface. With e = (1 + eta) h^2 / (2 r):

        W = x^(m + 1) / (x + e) {1 - (o / h)^2}^2,   x = e + dr - (1 + eta) r (1 - v_z) - min(p - d, max(p, 0))

    where x > 0, and o, at most h, is how far the taxel lies outside of the object. Without e and h, for ever finer
    taxels, W is x^m inside and 0 outside. On a plane that is the pressure of `growth.pressure_exponent`,
    (1 - rho^2 / a^2)^m; of columns, m = 1 and eta = 0, it is the depth. The skin spreads it over h. dr is taken so
    large, and o so small, that three taxels lie within the contact, which can carry any force and torsion. W is
    continuous in the state.

    Args:
        skin: `field.Skin`, `moved` is read, `work` is set.
        i: which tip.
        pad: its row of `records.PAD`.
        contact: its row of `records.CONTACT`.
        base_pose: of the object, shape (12,).

    Returns:
        The sum of all weights, positive, and how many taxels have one, see `Skin.taking`.
    """
    v, r, R, work = skin.moved[2], pad.radius, contact.distance, skin.work
    h, m, wide = skin.reach[i], skin.exponent[i], 1.0 + skin.narrow[i]
    touch, below, weight = work[0], work[1], work[2]
    e = 0.5 * wide * h * h / r
    base = e + _deep_enough(v, wide * r, contact.deformation[0])
    nearest, count = _look(skin, pad, contact, base_pose, base, wide)
    total, taking = 0.0, 0
    for k in range(count):
        t = skin.taking[k]
        x, p = base - wide * r * (1.0 - v[t]), r * v[t] - R
        x -= min(p - below[t], max(p, 0.0))
        o = max(-below[t] - nearest, 0.0) / h
        if x <= 0.0 or o >= 1.0:
            continue
        fades = (1.0 - o * o) * (1.0 - o * o)
        touch[t] = min(x / e, 1.0) * fades
        weight[t] = _power(x, m) * x / (x + e) * fades
        total += weight[t]
        skin.taking[taking] = t
        taking += 1
    return total, taking


@compiled
def _deep_enough(v, r, dr):
    """dr, or so much that three taxels lie in r (1 - v) <= dr."""
    inside = 0
    for t in range(v.shape[0]):
        inside += r * (1.0 - v[t]) <= dr
    if inside > 2:
        return dr
    first, second, third = 2.0, 2.0, 2.0
    for t in range(v.shape[0]):
        first, second, third = _three(1.0 - v[t], first, second, third)
    return max(dr, r * third)


@compiled
def _three(x, first, second, third):
    """The three least of four numbers, in their order, from three in theirs and another one."""
    if x >= third:
        return first, second, third
    if x >= second:
        return first, second, x
    if x >= first:
        return first, x, second
    return x, first, second


@compiled
def _power(x, m):
    """x^m."""
    if m == 1.0:
        return x
    return math.sqrt(x) if m == 0.5 else x**m


@compiled
def _look(skin, pad, contact, base_pose, base, wide):
    """Sets `below` and `taking` of the taxels that may have a part.

    Returns:
        How far outside of the object the third nearest of them is [m], and how many they are.
    """
    v, r, R, below, taking = skin.moved[2], pad.radius, contact.distance, skin.work[1], skin.taking
    count = 0
    for t in range(v.shape[0]):
        taking[count] = t
        count += base - wide * r * (1.0 - v[t]) > 0.0
    if pad.shape != PLANE:
        set_depths(skin.solid, pad, contact, base_pose, skin.moved, taking, count, below)
    first, second, third = math.inf, math.inf, math.inf
    for k in range(count):
        t = taking[k]
        p = r * v[t] - R
        below[t] = p if pad.shape == PLANE else min(below[t], p)
        first, second, third = _three(max(-below[t], 0.0), first, second, third)
    return third, count
