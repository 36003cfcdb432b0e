"""Force closure and its margin: the largest ball about zero in what one newton of normal force can do.

One newton at contact i makes the wrenches g_i + B_i s: the normal force, and on top of it the forces and torsions
s = (f_1, f_2, tau / l) / mu inside its limit surface H(s) = 1, exact or an ellipse, see `contact.limit`. Shared by
the contacts at will it makes their convex hull W, whose support in a direction d is

    h(d) = max_i (g_i . d + max_{H(s) <= 1} s . B_i^T d),   for an ellipse max_i (g_i . d + |B_i^T d|)

and the margin is the least h over all unit d: no facets stand for round cones.

It is found by shooting rays. The ray c leaves W where the largest t with t c in W is, a linear program whose columns,
the support points, are made as they are wanted; its dual is the normal d of W there. The ray along that normal leaves W
no further out, and so on, down to a point of W that is nearest to zero among its neighbours. Several first rays find
the nearest of all; the tests hold it against hulls.

Sources: Ferrari, Canny, Planning Optimal Grasps, ICRA 1992; Howe, Cutkosky, Practical Force-Motion Models for Sliding
Manipulation (1996), for the limit surface of a soft finger.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from softhand.contact.limit import limit_of
from softhand.grasping.wrenches import Contacts, grasp_matrix
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled

_CLOSED = 1e-7  # [N/N] least margin that is told from none
_RAYS = np.vstack([np.eye(6), -np.eye(6), np.random.default_rng(0).normal(size=(20, 6))])
_NEAR = 1e-4  # share by which one more ray must improve the margin
_MET = 1e-3  # share by which W may reach beyond the plane of a ray
_MOST_RAYS = 40
_MOST_COLUMNS = 400
_TURNS = 5  # of the search for the point of a limit surface
_SEED = 1e-8  # size of a simplex about zero from which a ray starts


def closure_margin(contacts: Contacts) -> float:
    """Margin of force closure: radius of the largest ball about zero in the hull of what the contacts can do.

    The quality of [Ferrari, Canny] for a total normal force of one newton (their L1), with round friction cones and the
    limit surfaces of soft fingers [Howe, Cutkosky]. It is the size of the worst wrench that the grasp answers with one
    newton of normal force in all; zero where some wrench cannot be answered at all, however hard the squeeze.

    Args:
        contacts: the contacts.

    Returns:
        [N] a newton, to a thousandth; moments count over L.
    """
    return float(_least_support(wrench_sets(contacts), _RAYS, _CLOSED, np.empty(6)))


class WrenchSets(NamedTuple):
    """What one newton of normal force can do at each contact, moments over L."""

    centres: Array
    """g_i, shape (nc, 6)."""
    spreads: Array
    """B_i, shape (nc, 6, 3)."""
    curves: Array
    """c_i of the limit surfaces, zeros for ellipses, shape (nc, 5)."""


def wrench_sets(contacts: Contacts) -> WrenchSets:
    """Those of some contacts."""
    G = grasp_matrix(contacts).reshape(6, len(contacts), 4).transpose(1, 0, 2).copy()
    G[:, 3:] /= contacts.length
    mu = contacts.friction
    spreads = G[:, :, [0, 1, 3]] * np.column_stack([mu, mu, mu * contacts.torsion_length])[:, None]
    return WrenchSets(G[:, :, 2].copy(), np.ascontiguousarray(spreads), contacts.curves)


def worst_wrench(sets: WrenchSets, enough: float = 0.0) -> tuple[float, Array]:
    """The margin, and the direction of the wrench that is answered worst.

    With the rays along the axes alone, which of a thousand grasps hardly one needs more than.

    Args:
        sets: of the contacts.
        enough: a margin below this need not be known: h(d) of some direction below it will do.

    Returns:
        h(d) and the unit vector d, shape (6,).
    """
    worst = np.empty(6)
    return float(_least_support(sets, _RAYS[:12], max(enough, _CLOSED), worst)), worst


def is_force_closure(contacts: Contacts) -> bool:
    """Whether any wrench can be answered: zero lies inside of what the contacts can do."""
    return closure_margin(contacts) > 0.0


def supports(sets: WrenchSets, directions: Array) -> Array:
    """How far one newton at each contact reaches along unit directions of wrenches, shape (nc, directions).

    The least over the directions of the largest over the contacts is an upper bound of the margin.

    Args:
        sets: of the contacts.
        directions: shape (directions, 6).
    """
    found = np.empty((len(sets.centres), len(directions)))
    _fill_supports(sets, directions, found)
    return found


@compiled
def _fill_supports(sets, directions, found):
    for i in range(found.shape[0]):
        for k in range(found.shape[1]):
            found[i, k] = _reach(sets, i, directions[k])[0]


@compiled
def _least_support(sets, starts, enough, worst):
    """Least h(d) that rays from some starts come to, or the first below `enough`; sets d, shape (6,). Never below 0."""
    least = math.inf
    ray, normal, point = np.empty(6), np.empty(6), np.empty(6)
    basis, work, weights, change = np.empty((6, 6)), np.empty((6, 12)), np.empty(6), np.empty(6)
    for i in range(starts.shape[0]):
        ray[:] = starts[i]
        last = math.inf
        for turn in range(_MOST_RAYS):
            for r in range(6):  # off the symmetries of a grasp, where planes meet in more than six points
                ray[r] += 1e-7 * math.sin(1.0 + 3.0 * r + turn)
            _shoot(sets, ray, normal, point, basis, work, weights, change)
            size = 0.0
            for r in range(6):
                size += normal[r] * normal[r]
            for r in range(6):
                ray[r] = normal[r] / math.sqrt(size)
            reached = _support(sets, ray, point)
            if reached < least:
                least = reached
                for r in range(6):
                    worst[r] = ray[r]
            if reached < enough:
                return reached if reached > _CLOSED else 0.0
            if reached >= last * (1.0 - _NEAR):
                break
            last = reached
    return least


@compiled
def _shoot(sets, ray, normal, point, basis, work, weights, change):
    """Where a ray leaves W: six points of W that span the plane there, and its normal.

        max t,   t c = sum w_k p_k,   w_k >= 0,   sum w_k = 1

    by the simplex method. It starts from points about zero, which are in W if the margin is above their size; if it is
    not, they stay in the basis, and h of the normal is not above it either.

    Args:
        sets: `WrenchSets`.
        ray: c, shape (6,).
        normal: of the plane, normal . p_k = 1, set, shape (6,).
        point: scratch, shape (6,).
        basis: p_k as columns, scratch, shape (6, 6).
        work: scratch, shape (6, 12).
        weights: w_k / t, scratch, shape (6,).
        change: scratch, shape (6,).
    """
    for k in range(6):
        for r in range(6):
            basis[r, k] = 0.0
        basis[k, k] = _SEED if ray[k] >= 0.0 else -_SEED
    for _ in range(_MOST_COLUMNS):
        if not _invert(basis, work):
            break
        # weights of the ray in the basis, and the plane through its points
        for k in range(6):
            weights[k], normal[k] = 0.0, 0.0
            for r in range(6):
                weights[k] += work[k, 6 + r] * ray[r]
                normal[k] += work[r, 6 + k]
        # the point of W furthest beyond that plane comes in
        if _support(sets, normal, point) <= 1.0 + _MET:
            break
        largest = 0.0
        for k in range(6):
            change[k] = 0.0
            for r in range(6):
                change[k] += work[k, 6 + r] * point[r]
            largest = max(largest, abs(change[k]))
        # and that goes out whose weight is the first to vanish
        out, least = -1, math.inf
        for k in range(6):
            if change[k] > 1e-9 * largest and max(weights[k], 0.0) / change[k] < least:
                out, least = k, max(weights[k], 0.0) / change[k]
        if out < 0:
            break
        for r in range(6):
            basis[r, out] = point[r]


@compiled
def _support(sets, direction, point):
    """h(d), and the point of W that is furthest along d, set, shape (6,)."""
    most, which = -math.inf, 0
    for i in range(sets.centres.shape[0]):
        reached = _reach(sets, i, direction)[0]
        if reached > most:
            most, which = reached, i
    _, s = _reach(sets, which, direction)
    for r in range(6):
        point[r] = sets.centres[which, r]
        for k in range(3):
            point[r] += sets.spreads[which, r, k] * s[k]
    return most


@compiled
def _reach(sets, i, direction):
    """How far contact i reaches along d, and the s of its limit surface with which it does.

    The outward normal e(s) of the surface must be along B^T d = (x, y, z): with F and T the parts of s in force and in
    torsion, e = (alpha F, beta T) along (|(x, y)|, |z|), see `limit_of`. What is left of the error of s counts in its
    square only.
    """
    along, x, y, z = 0.0, 0.0, 0.0, 0.0
    for r in range(6):
        along += sets.centres[i, r] * direction[r]
        x += sets.spreads[i, r, 0] * direction[r]
        y += sets.spreads[i, r, 1] * direction[r]
        z += sets.spreads[i, r, 2] * direction[r]
    a, b = math.hypot(x, y), abs(z)
    if a + b == 0.0:
        return along, (0.0, 0.0, 0.0)
    curve, F, T = sets.curves[i], a, b
    for _ in range(_TURNS if curve[0] != 0.0 or curve[1] != 0.0 else 0):
        normal = limit_of(curve, (F, 0.0, T))[1]
        F, T = a * F / normal[0] if F > 0.0 else 0.0, b * T / normal[2] if T > 0.0 else 0.0
    size = math.sqrt(limit_of(curve, (F, 0.0, T))[0])
    F, T = F / size, T / size
    scale = F / a if a > 0.0 else 0.0
    return along + a * F + b * T, (scale * x, scale * y, math.copysign(T, z))


@compiled
def _invert(A, work):
    """A^-1 into the last columns of `work`, by elimination with pivots; False if A is singular."""
    for i in range(6):
        for j in range(6):
            work[i, j], work[i, 6 + j] = A[i, j], 1.0 if i == j else 0.0
    for k in range(6):
        pivot = k
        for i in range(k + 1, 6):
            if abs(work[i, k]) > abs(work[pivot, k]):
                pivot = i
        if abs(work[pivot, k]) < 1e-13:
            return False
        for j in range(12):
            work[k, j], work[pivot, j] = work[pivot, j], work[k, j]
        factor = 1.0 / work[k, k]
        for j in range(12):
            work[k, j] *= factor
        for i in range(6):
            if i != k and work[i, k] != 0.0:
                factor = work[i, k]
                for j in range(12):
                    work[i, j] -= factor * work[k, j]
    return True
