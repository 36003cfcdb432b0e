"""Internal forces of many contacts: the forces in the bars of a truss, of which the contacts are the joints."""

from __future__ import annotations

import math

import numpy as np

from softhand.numerics.compiled import compiled
from softhand.numerics.linear import factor_by_columns, substitute

_PLANE = 1e-7  # of the size of the truss: joints no further out of a plane lie in it


@compiled
def truss_forces(contacts, pairs, internal_force):
    """f_N = K^+ f_C of (58), in the time of one Cholesky factor where K K^T is singular.

    In world axes column k of K is the unit vector d of a bar from contact i to j, at i, and -d at j: K K^T is the
    stiffness of a truss, to which the motions Z as one rigid body are free. As K^T Z = 0,

        f_N = K^T y,   (K K^T + Z Z^T) y = f_C

    with translations and turns about the middle in units of the size as Z. Joints in a plane are also free to leave it.

    Args:
        contacts: table `records.CONTACT`, fingertips first.
        pairs: contacts of each bar, shape (np, 2).
        internal_force: set [N], shape (np,).

    Returns:
        False, and nothing is set, where a joint is free in yet other ways, as of two contacts at one point.
    """
    count = _joints(pairs)
    arms, S, y, normal = np.empty((count, 3)), np.zeros((3 * count, 3 * count)), np.empty(3 * count), np.zeros(3)
    _place_joints(contacts, arms)
    in_plane = _find_plane(arms, normal)
    # Z Z^T, the lower triangle: blocks (1 + a_i . a_j) 1 - a_j a_i^T
    for i in range(count):
        for j in range(i + 1):
            a, b = arms[i], arms[j]
            along = 1.0 + a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
            for row in range(3):
                for k in range(3):
                    S[3 * i + row, 3 * j + k] = (along if row == k else 0.0) - b[row] * a[k]
        if in_plane:
            for row in range(3):
                for k in range(3):
                    S[3 * i + row, 3 * i + k] += normal[row] * normal[k]
    # + K K^T
    for n in range(pairs.shape[0]):
        d = _bar(arms, pairs[n, 0], pairs[n, 1])
        i, j = max(pairs[n, 0], pairs[n, 1]), min(pairs[n, 0], pairs[n, 1])
        for row in range(3):
            for k in range(3):
                stiff = d[row] * d[k]
                S[3 * i + row, 3 * i + k] += stiff
                S[3 * j + row, 3 * j + k] += stiff
                S[3 * i + row, 3 * j + k] -= stiff
    if not factor_by_columns(S):
        return False
    for i in range(count):
        R, f = contacts[i].rotation, contacts[i].force
        for row in range(3):
            y[3 * i + row] = R[row, 0] * f[0] + R[row, 1] * f[1] + R[row, 2] * f[2]
    substitute(S, y)
    for n in range(pairs.shape[0]):
        i, j = 3 * pairs[n, 0], 3 * pairs[n, 1]
        d = _bar(arms, pairs[n, 0], pairs[n, 1])
        internal_force[n] = d[0] * (y[i] - y[j]) + d[1] * (y[i + 1] - y[j + 1]) + d[2] * (y[i + 2] - y[j + 2])
    return True


@compiled
def _joints(pairs):
    """Number of contacts in the pairs."""
    last = 0
    for n in range(pairs.shape[0]):
        last = max(last, pairs[n, 0], pairs[n, 1])
    return last + 1


@compiled
def _place_joints(contacts, arms):
    """Contact points from their middle, in units of the root of their mean square distance."""
    count, square = arms.shape[0], 0.0
    for row in range(3):
        middle = 0.0
        for i in range(count):
            middle += contacts[i].point[row] / count
        for i in range(count):
            arms[i, row] = contacts[i].point[row] - middle
            square += arms[i, row] * arms[i, row] / count
    if square > 0.0:
        for i in range(count):
            for row in range(3):
                arms[i, row] /= math.sqrt(square)


@compiled
def _find_plane(arms, normal):
    """Whether all joints lie in one plane through their middle; its normal is set."""
    far, largest = 0, 0.0
    for i in range(arms.shape[0]):
        square = arms[i, 0] ** 2 + arms[i, 1] ** 2 + arms[i, 2] ** 2
        if square > largest:
            far, largest = i, square
    a, largest = arms[far], 0.0
    for i in range(arms.shape[0]):
        b = arms[i]
        x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
        square = x * x + y * y + z * z
        if square > largest:
            length = math.sqrt(square)
            normal[0], normal[1], normal[2], largest = x / length, y / length, z / length, square
    for i in range(arms.shape[0]):
        b = arms[i]
        if abs(b[0] * normal[0] + b[1] * normal[1] + b[2] * normal[2]) > _PLANE:
            return False
    return True


@compiled
def _bar(arms, i, j):
    """Unit vector from one joint to another; zero if they are one point."""
    x, y, z = arms[j, 0] - arms[i, 0], arms[j, 1] - arms[i, 1], arms[j, 2] - arms[i, 2]
    apart = math.sqrt(x * x + y * y + z * z)
    if not apart > 1e-9:
        return 0.0, 0.0, 0.0
    return x / apart, y / apart, z / apart
