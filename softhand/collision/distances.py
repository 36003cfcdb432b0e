"""Signed distances of solids, and a lower bound of them for many poses at once."""

from __future__ import annotations

from collections.abc import Sequence

import coal
import numpy as np

from softhand.collision.solids import Solid
from softhand.numerics.arrays import Array

TOUCH = 1e-5
"""Depth below which two solids do not collide [m]: shapes that rest on each other, in the digits of coal."""

_REQUEST = coal.DistanceRequest()


def distance(a: Solid, b: Solid, R: Array, p: Array) -> float:
    """Signed distance of two solids [m]; what is negative is the depth, the shortest way that parts them.

    Args:
        a: one.
        b: other.
        R: axes of all bodies, shape (bodies, 3, 3).
        p: their origins [m], shape (bodies, 3).
    """
    result = coal.DistanceResult()
    return float(coal.distance(a.shape, _place(a, R, p), b.shape, _place(b, R, p), _REQUEST, result))


def _place(solid: Solid, R: Array, p: Array) -> coal.Transform3s:
    body = solid.body
    return coal.Transform3s(R[body] @ solid.rotation, R[body] @ solid.position + p[body])


class Boxes:
    """Boxes along the world's axes about all solids, for the poses of many samples.

    Args:
        solids: each once.
        R: axes of all bodies, shape (k, bodies, 3, 3).
        p: their origins [m], shape (k, bodies, 3).
    """

    def __init__(self, solids: Sequence[Solid], R: Array, p: Array) -> None:
        self._at: dict[Solid, tuple[Array, Array]] = {}
        for solid in solids:
            if solid.is_endless:
                continue
            centre, half = solid.bounds
            axes = R[:, solid.body] @ solid.rotation
            middle = p[:, solid.body] + R[:, solid.body] @ solid.position + axes @ centre
            self._at[solid] = middle, np.abs(axes) @ half

    def least(self, a: Solid, b: Solid) -> Array:
        """What the distance of two solids is at least in each sample [m], negative if their boxes meet, shape (k,)."""
        if a.is_endless or b.is_endless:
            table, (middle, half) = (a, self._at[b]) if a.is_endless else (b, self._at[a])
            normal = np.array(table.shape.n)
            above: Array = middle @ normal - half @ np.abs(normal) - table.shape.d
            return above
        (one, half_one), (other, half_other) = self._at[a], self._at[b]
        gap = np.abs(one - other) - half_one - half_other
        apart: Array = np.linalg.norm(np.maximum(gap, 0.0), axis=1)
        return np.where(apart > 0.0, apart, np.max(gap, axis=1))
