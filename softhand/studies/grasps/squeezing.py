"""The least squeeze as a cone program: what `grasping.wrenches.least_squeeze` finds by planes, much faster"""

from __future__ import annotations

import clarabel
import numpy as np
from scipy import sparse

from softhand.contact.pairs import contact_pairs
from softhand.errors import GraspError
from softhand.grasping.situation import Situation
from softhand.grasping.wrenches import tangents
from softhand.numerics.arrays import Array

_TOUCH = 0.1  # [N] of each tip, under the least internal forces, as `GraspQuality` has it
_SOLVED = (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved)


class Contacts:
    """Contacts of an object at one pose, ready to be squeezed.

        min sum |f_N|,   f = carried + internal f_N,   |f_t| <= use mu f_n,   f_n >= least_normal

    Args:
        here: hand and object.
        points: in the world [m], shape (nc, 3).
        normals: into the object, in the world, shape (nc, 3).
        friction: mu, shape (nc,).

    Raises:
        GraspError: the contacts cannot carry the weight.
    """

    def __init__(self, here: Situation, points: Array, normals: Array, friction: Array) -> None:
        pairs = len(contact_pairs(len(points)))
        self._carried = here.forces(points, np.zeros(pairs))
        self._internal = np.stack([here.forces(points, unit) - self._carried for unit in np.eye(pairs)], axis=2)
        self._axes = [np.array([n, *tangents(n)]) for n in normals]
        self._friction = friction

    def least(self, use: float = 1.0, least_normal: float = _TOUCH) -> Array | None:
        """f_N [N], shape (pairs,); None if no squeeze holds.

        Args:
            use: share of the friction that may be used.
            least_normal: with which each tip presses at least [N].
        """
        pairs = self._internal.shape[2]
        one = np.eye(pairs)
        rows = [np.hstack([one, -one]), np.hstack([-one, -one])]  # |f_N| <= size
        bounds = [np.zeros(2 * pairs)]
        cones = []
        for axes, carried, internal, mu in zip(
            self._axes, self._carried, self._internal, self._friction, strict=True
        ):  # fmt: skip
            along, at = axes @ internal, axes @ carried
            rows.append(_wide(-along[:1]))
            bounds.append(at[:1] - least_normal)
            cone = np.array([use * mu, 1.0, 1.0])
            cones.append((_wide(-cone[:, None] * along), cone * at))
        A = np.vstack([*rows, *(one for one, _ in cones)])
        b = np.concatenate([*bounds, *(one for _, one in cones)])
        kinds = [clarabel.NonnegativeConeT(2 * pairs + len(cones)), *(clarabel.SecondOrderConeT(3) for _ in cones)]
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.max_threads = 1
        cost = np.concatenate([np.zeros(pairs), np.ones(pairs)])
        empty = sparse.csc_matrix((2 * pairs, 2 * pairs))
        found = clarabel.DefaultSolver(empty, cost, sparse.csc_matrix(A), b, kinds, settings).solve()
        return np.array(found.x[:pairs]) if found.status in _SOLVED else None


def contacts_at(here: Situation, points: Array, normals: Array, friction: Array) -> Contacts | None:
    """`Contacts`; None where they cannot carry the weight."""
    try:
        return Contacts(here, points, normals, friction)
    except GraspError:
        return None


def _wide(rows: Array) -> Array:
    """Rows of f_N beside those of its sizes."""
    return np.hstack([rows, np.zeros(rows.shape)])
