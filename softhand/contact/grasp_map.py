"""The grasp map: what forces at some points do to a body as a whole."""

from __future__ import annotations

import numpy as np

from softhand.numerics.arrays import Array
from softhand.numerics.spatial import cross_matrix


def grasp_map(arms: Array) -> Array:
    """G of the wrench (f, m) = G (f_1, f_2, ...): forces at the ends of arms, moments about where these begin.

        f = sum f_i,   m = sum p_i x f_i,   so that G_i = (1, [p_i]x)     Murray, Li, Sastry (1994), Eq. (5.6)

    Its transpose takes the velocity and the angular velocity of the body to the velocities v + w x p_i of the points.

    Args:
        arms: p_i from the point about which moments are taken [m], shape (nc, 3).

    Returns:
        In the axes of the arms, shape (6, 3 nc); rows of forces, then of moments [m].
    """
    return np.vstack([np.tile(np.eye(3), len(arms)), np.hstack(list(cross_matrix(np.asarray(arms, dtype=float))))])
