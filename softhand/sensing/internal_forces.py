"""The internal forces between contacts, (58)."""

from __future__ import annotations

import math

import numpy as np

from softhand.numerics.branches import usually
from softhand.numerics.compiled import compiled
from softhand.numerics.linear import least_norm
from softhand.sensing.truss import truss_forces

_FEW = 4  # contacts up to which K alone is the quicker way; from five on K K^T is singular
_APART = 1e-9  # [m] below which two contacts are one point: tips in the air may all be nearest to one vertex


@compiled
def internal_forces(contacts, pairs, K, internal_force):
    """K of (58) and f_N = K^+ f_C.

    Column k of K holds, for the pair (i, j), the unit vector from contact i to j in C_Fi and from j to i in C_Fj; zero
    for contacts at one point.

    Args:
        contacts: table `records.CONTACT`, fingertips first.
        pairs: contacts of each column, shape (np, 2).
        K: set, shape (3 nc, np).
        internal_force: set [N], shape (np,).
    """
    for k in range(pairs.shape[0]):
        i, j = pairs[k, 0], pairs[k, 1]
        a, b = contacts[i], contacts[j]
        x, y, z = b.point[0] - a.point[0], b.point[1] - a.point[1], b.point[2] - a.point[2]
        apart = math.sqrt(x * x + y * y + z * z)
        scale = 1.0 / apart if usually(apart > _APART) else 0.0
        for row in range(3):
            K[3 * i + row, k] = scale * (a.rotation[0, row] * x + a.rotation[1, row] * y + a.rotation[2, row] * z)
            K[3 * j + row, k] = -scale * (b.rotation[0, row] * x + b.rotation[1, row] * y + b.rotation[2, row] * z)
    if K.shape[0] > 3 * _FEW and truss_forces(contacts, pairs, internal_force):
        return
    f_C = np.empty(K.shape[0])
    for i in range(K.shape[0] // 3):
        for row in range(3):
            f_C[3 * i + row] = contacts[i].force[row]
    least_norm(K, False, f_C, internal_force)
