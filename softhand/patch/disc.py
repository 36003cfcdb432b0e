"""The contact as a disc of columns, and how an elastic half-space couples them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from softhand.numerics.arrays import Array

_NEAR, _FAR = 5.0, 2.0  # points of quadrature over the width of a ring, for neighbours and for others


@dataclass(frozen=True, eq=False)
class Disc:
    """Columns on a disc of radius 1: rings of equal width, cut into equal sectors. Column i n_s + s is of ring i.

    Attributes:
        edges: radii of the rings, shape (n_r + 1,).
        points: centres of the columns, shape (N, 2).
        areas: share of each in the disc, shape (N,).
        along: mean of 1 / s over each pair of columns, s their distance, shape (N, N).
        across: mean of (x x, x y; x y, y y) / s^3, shape (N, 2, N, 2).
    """

    edges: Array
    points: Array
    areas: Array
    along: Array
    across: Array

    @property
    def sectors(self) -> int:
        """How many columns a ring has."""
        return len(self.points) // (len(self.edges) - 1)

    def compliance(self, nu: float) -> Array:
        """Displacements of the columns by forces on them, on a half-space of shear modulus 1.

        Cerruti's solution, the mean over each pair of columns, so that it is symmetric and forces and displacements are
        those of one energy:

            u_x = 1 / (2 pi G) {(1 - nu) / s + nu x^2 / s^3} f_x + nu / (2 pi G) x y / s^3 f_y,   u_y likewise

        Args:
            nu: Poisson's ratio.

        Returns:
            Rows and columns x, y of column 0, x, y of column 1, and so on; times 1 / (G L) for a disc of radius L and
            shear modulus G, shape (2 N, 2 N).
        """
        count = len(self.points)
        C = nu * self.across
        for k in range(2):
            C[:, k, :, k] += (1.0 - nu) * self.along
        return C.reshape(2 * count, 2 * count) / (2.0 * np.pi)


@lru_cache(4)
def disc(rings: int, sectors: int) -> Disc:
    """The disc of so many rings and sectors.

    What two columns do to each other depends on the angle between them: the first column of each ring tells all.
    """
    edges = np.linspace(0.0, 1.0, rings + 1)
    angles = 2.0 * np.pi * np.arange(sectors) / sectors
    middles = 2.0 / 3.0 * np.diff(edges**3) / np.diff(edges**2)
    points = np.stack([np.outer(middles, np.cos(angles)).ravel(), np.outer(middles, np.sin(angles)).ravel()], axis=1)
    turns = np.array([[[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]] for a in angles])
    along = np.zeros((rings, sectors, rings, sectors))
    across = np.zeros((rings, sectors, 2, rings, sectors, 2))
    own = np.arange(sectors)
    for i in range(rings):
        for j in range(rings):
            for t in range(sectors):
                is_near = abs(i - j) <= 1 and min(t, sectors - t) <= 1
                size = 1.0 / rings / (_NEAR if is_near else _FAR)
                x, y, share = _quadrature(i, rings, 0, sectors, size, 0)
                x_j, y_j, share_j = _quadrature(j, rings, t, sectors, size, 1)
                dx, dy = x[:, None] - x_j, y[:, None] - y_j
                s = np.hypot(dx, dy)
                weights = np.outer(share, share_j) / s
                xx, xy, whole = np.sum(weights * (dx / s) ** 2), np.sum(weights * dx * dy / s**2), np.sum(weights)
                pair = np.array([[xx, xy], [xy, whole - xx]])
                along[i, own, j, (own + t) % sectors] = whole
                across[i, own, :, j, (own + t) % sectors, :] = turns @ pair @ turns.transpose(0, 2, 1)
    count = rings * sectors
    flat, full = along.reshape(count, count), across.reshape(count, 2, count, 2)
    return Disc(
        edges,
        points,
        np.repeat(np.diff(edges**2) / sectors, sectors),
        0.5 * (flat + flat.T),
        0.5 * (full + full.transpose(2, 3, 0, 1)),
    )


@lru_cache
def _gauss(count: int) -> tuple[Array, Array]:
    return np.polynomial.legendre.leggauss(count)


@lru_cache(10_000)
def _quadrature(ring: int, rings: int, sector: int, sectors: int, size: float, more: int) -> tuple[Array, Array, Array]:
    """Points of a column about `size` apart, `more` each way so that two sets never coincide, and their shares."""
    half, middle, width = np.pi / sectors, (ring + 0.5) / rings, 1.0 / rings
    out, w_out = _gauss(max(2, int(np.ceil(width / size - 1e-9))) + more)
    round_, w_round = _gauss(max(2, int(np.ceil(2.0 * half * middle / size))) + more)
    r, angle = middle + 0.5 * width * out, 2.0 * half * sector + half * round_
    share = np.outer(w_out * r, w_round)
    return (
        np.outer(r, np.cos(angle)).ravel(),
        np.outer(r, np.sin(angle)).ravel(),
        (share / np.sum(share)).ravel(),
    )
