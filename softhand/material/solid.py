"""A tip in three dimensions, one side of a plane of symmetry: its elements, and points on its outer side."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.material.body import Body, at_points
from softhand.material.half_ball import outer_facets
from softhand.material.neo_hookean import N_ROWS
from softhand.numerics.arrays import Array

_INSIDE_ORDER, _SURFACE_ORDER = 5, 8  # of the integration; on the surface many, so that the contact ends between two


class Solid:
    """Quadratic displacement and linear pressure on curved tetrahedra; bonded at z = 0, symmetric about y = 0.

    Args:
        mesh: as `half_ball` gives it. All forces and energies are those of both sides.

    Attributes:
        body: its elements.
        free: unknowns that neither the flat face nor the symmetry holds.
        places: points of integration on the outer side, undeformed, shape (3, points).
        areas: of these, on both sides, shape (points,).
        displacements: by direction, from the unknowns to the displacement of these points, sparse.
    """

    def __init__(self, mesh: Any) -> None:
        from skfem import Basis, ElementTetP1, ElementTetP2, FacetBasis

        inside = Basis(mesh, ElementTetP2(), intorder=_INSIDE_ORDER)
        pressure = Basis(mesh, ElementTetP1(), intorder=_INSIDE_ORDER)
        n, size = inside.N, 3 * inside.N + pressure.N
        rows, places = [], []
        for i in range(3):
            for (function,) in inside.basis:
                row = np.zeros((N_ROWS, *inside.dx.shape))
                row[3 * i : 3 * i + 3] = function.grad
                rows.append(row)
            places.append(inside.element_dofs + i * n)
        for (function,) in pressure.basis:
            row = np.zeros((N_ROWS, *inside.dx.shape))
            row[9] = np.asarray(function)
            rows.append(row)
        places.append(pressure.element_dofs + 3 * n)
        self.body = Body(np.stack(rows, 1), np.concatenate(places), 2.0 * inside.dx, size)
        left = np.ones(size, dtype=bool)
        left[: 3 * n] = np.tile(np.abs(inside.doflocs[2]) > 1e-9, 3)
        left[n : 2 * n] &= np.abs(inside.doflocs[1]) > 1e-9
        self.free = np.nonzero(left)[0]
        outside = FacetBasis(mesh, ElementTetP2(), facets=outer_facets(mesh), intorder=_SURFACE_ORDER)
        self.places: Array = np.asarray(outside.global_coordinates()).reshape(3, -1)
        self.areas: Array = 2.0 * outside.dx.ravel()
        self.displacements = [at_points(outside, i * n, size) for i in range(3)]

    def positions(self, x: Array) -> Array:
        """Of the points on the outer side, shape (3, points)."""
        return self.places + np.stack([displacement @ x for displacement in self.displacements])
