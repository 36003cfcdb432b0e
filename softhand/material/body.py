"""A body in elements: how its state at points follows from the unknowns, and an energy by these."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softhand.material.neo_hookean import NeoHookean
from softhand.numerics.arrays import Array


@dataclass(frozen=True)
class Body:
    """Points of integration of all elements.

    Attributes:
        rows: state by the unknowns of the element, shape (10, unknowns of an element, elements, points).
        places: of these among all unknowns, shape (unknowns of an element, elements).
        weights: volume of each point, shape (elements, points).
        size: number of unknowns.
    """

    rows: Array
    places: NDArray[np.int64]
    weights: Array
    size: int

    def state(self, x: Array) -> Array:
        """Rows of F - 1 and p at the points, shape (10, elements, points)."""
        return np.einsum("akef,ke->aef", self.rows, x[self.places])

    def slope(self, material: NeoHookean, state: Array) -> Array:
        """Derivative of the energy by the unknowns, about a state of the points."""
        own = np.einsum("akef,aef->ke", self.rows, material.expand(state)[0] * self.weights)
        return np.bincount(self.places.ravel(), own.ravel(), self.size).astype(np.float64)

    def tangent(self, material: NeoHookean, state: Array) -> Any:
        """Second derivatives of the energy by the unknowns, sparse."""
        from scipy.sparse import coo_matrix

        bend = material.expand(state)[1] * self.weights
        moved = np.einsum("abef,blef->alef", bend, self.rows)
        own = np.einsum("akef,alef->kle", self.rows, moved)
        i = np.broadcast_to(self.places[:, None], own.shape)
        j = np.broadcast_to(self.places[None], own.shape)
        return coo_matrix((own.ravel(), (i.ravel(), j.ravel())), (self.size, self.size)).tocsr()


def at_points(basis: Any, first: int, size: int) -> Any:
    """From the unknowns to one number at the points of a basis, sparse, shape (points, size).

    Args:
        basis: of scikit-fem.
        first: which unknown is the first of that number.
        size: of all unknowns.
    """
    from scipy.sparse import coo_matrix

    points = np.arange(basis.dx.size).reshape(basis.dx.shape)
    values, rows, columns = [], [], []
    for (function,), dofs in zip(basis.basis, basis.element_dofs, strict=True):
        values.append(np.broadcast_to(np.asarray(function), points.shape).ravel())
        rows.append(points.ravel())
        columns.append(np.broadcast_to(dofs[:, None] + first, points.shape).ravel())
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return coo_matrix(entries, (points.size, size)).tocsr()
