"""What contacts can do to an object: their grasp matrix, and the least squeeze with which they hold.

A wrench is a force and a moment about one point, the origin of the `Contacts`. Forces and moments are compared by one
length L: a moment M counts as the force M / L. All that is said here is the same for an object twice as large, if L is.

Source: Murray, Li, Sastry, A Mathematical Introduction to Robotic Manipulation (1994), chapter 5.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from softhand.contact.grasp_map import grasp_map
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record

_MOST_CUTS = 60


@dataclass(frozen=True, eq=False)
class Contacts(Record):
    """Soft fingers against an object; nc contacts.

    Attributes:
        points: from the point about which moments are taken, usually the centre of mass [m], shape (nc, 3).
        normals: unit normals into the object, the direction of a pushing tip, shape (nc, 3).
        friction: mu of each contact, shape (nc,).
        torsion_length: tau_max / (mu f_z) of each contact [m], zero for a hard finger, shape (nc,).
        length: L, by which moments are compared with forces [m].
        curves: c_i of each limit surface, see `contact.limit.set_limit`, zeros for ellipses, shape (nc, 5).
    """

    units: ClassVar = {
        "points": "m", "normals": "1", "friction": "1", "torsion_length": "m", "length": "m", "curves": "1",
    }  # fmt: skip

    points: Array
    normals: Array
    friction: Array
    torsion_length: Array
    length: float
    curves: Array

    def __len__(self) -> int:
        return len(self.points)

    def without(self, index: int) -> Contacts:
        """The same contacts but one."""
        kept = [i for i in range(len(self)) if i != index]
        each = (self.points, self.normals, self.friction, self.torsion_length, self.curves)
        points, normals, friction, torsion_length, curves = (values[kept] for values in each)
        return Contacts(points, normals, friction, torsion_length, self.length, curves)


def tangents(normal: Array) -> tuple[Array, Array]:
    """Two unit vectors t_1, t_2 that make a right-handed frame (t_1, t_2, normal)."""
    x, y, z = normal.tolist()
    if abs(x) <= abs(y) and abs(x) <= abs(z):
        size = math.hypot(y, z)
        a, b, c = 0.0, -z / size, y / size
    elif abs(y) <= abs(z):
        size = math.hypot(x, z)
        a, b, c = z / size, 0.0, -x / size
    else:
        size = math.hypot(x, y)
        a, b, c = -y / size, x / size, 0.0
    return np.array([a, b, c]), np.array([y * c - z * b, z * a - x * c, x * b - y * a])


def grasp_matrix(contacts: Contacts, has_torsion: bool = True) -> Array:
    """G in contact frames: wrench on the object from the contact forces, [Murray] Eq. (5.6).

    Args:
        contacts: the contacts.
        has_torsion: with the torsion about the normal of each soft finger.

    Returns:
        Columns f_1, f_2, f_n [N] and with torsion tau [N m] of each contact along (t_1, t_2, n), n into the object, as
        wrenches on the object, [N] and [N m]; shape (6, 4 nc) or (6, 3 nc).
    """
    G, count = grasp_map(contacts.points).reshape(6, -1, 3), 4 if has_torsion else 3
    axes = np.array([[*tangents(normal), normal] for normal in contacts.normals])
    columns = np.zeros((6, len(contacts), count))
    columns[..., :3] = np.einsum("rik,ifk->rif", G, axes)
    if has_torsion:
        columns[3:, :, 3] = contacts.normals.T
    return columns.reshape(6, -1)


def singular_values(contacts: Contacts, has_torsion: bool = True) -> Array:
    """Singular values of G without dimension, largest first, shape (6,).

    Lengths are counted in L: moments M / L, torsions tau / L. A value of zero means a wrench that no contact force of
    any size answers.
    """
    G = grasp_matrix(contacts, has_torsion)
    G[3:] /= contacts.length
    if has_torsion:
        G[:, 3::4] *= contacts.length
    values = np.linalg.svd(G, compute_uv=False)
    return np.concatenate([values, np.zeros(6 - len(values))])


def least_squeeze(
    carried: Array, internal: Array, normals: Array, friction: Array, use: float = 1.0, least_normal: float = 0.0
) -> Array | None:
    """The smallest internal forces with which all contacts stay in their friction cones.

        min sum |f_N|,   f = carried + internal f_N,   |f_t| <= use mu f_n,   f_n >= least_normal

    A linear program in which a violated cone is cut off by its tangent plane, d . f_t <= use mu f_n for
    d = f_t / |f_t|, until none is: the cones are round.

    Args:
        carried: forces on the object without squeeze [N], shape (nc, 3).
        internal: forces of one newton of each internal force, shape (nc, 3, pairs).
        normals: into the object, shape (nc, 3).
        friction: mu, shape (nc,).
        use: share of the friction that may be used.
        least_normal: [N].

    Returns:
        f_N [N], shape (pairs,), below 0 where two contacts are spread; None if no squeeze holds.
    """
    from scipy.optimize import linprog

    pairs = internal.shape[2]
    internal = np.concatenate([internal, -internal], axis=2)  # f_N = squeeze - spread, both >= 0
    normal_carried = np.einsum("ir,ir->i", normals, carried)
    normal_internal = np.einsum("ir,irk->ik", normals, internal)
    rows, bounds = [-normal_internal], [normal_carried - least_normal]
    mu = use * np.asarray(friction)
    directions = [(i, sign * t) for i, n in enumerate(normals) for t in tangents(n) for sign in (1.0, -1.0)]
    for _ in range(_MOST_CUTS):
        for i, d in directions:
            rows.append((d @ internal[i] - mu[i] * normal_internal[i])[None])
            bounds.append(np.array([mu[i] * normal_carried[i] - d @ carried[i]]))
        found = linprog(np.ones(2 * pairs), np.vstack(rows), np.concatenate(bounds), bounds=(0.0, None), method="highs")
        if found.x is None:
            return None
        both = np.maximum(found.x, 0.0)
        force = carried + internal @ both
        pressing = np.einsum("ir,ir->i", normals, force)
        tangential = force - pressing[:, None] * normals
        size = np.linalg.norm(tangential, axis=1)
        beyond = np.flatnonzero(size > mu * pressing + 1e-7 * (1.0 + size))
        if not beyond.size:
            return both[:pairs] - both[pairs:]
        directions = [(int(i), tangential[i] / size[i]) for i in beyond]
    return None
