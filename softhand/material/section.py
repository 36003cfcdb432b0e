"""The half section of a body with its elements, for displacements with or without a wave around the axis."""

from __future__ import annotations

from math import pi
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from softhand.material.body import Body, at_points
from softhand.material.neo_hookean import N_ROWS
from softhand.numerics.arrays import Array

Motion = Literal["press", "twist", "lean"]
"""(u_R, u_Theta, u_Z) around the axis: (u, 0, w); (0, v, 0); (u cos, v sin, w cos) of Theta."""

FIELDS: dict[Motion, str] = {"press": "RZp", "twist": "T", "lean": "RTZp"}
"""Fields of a motion in the order of their unknowns; p is the pressure."""

_EDGE_ORDER = 20  # many points on an edge, so that the contact ends between two of them

_ZERO_ON_AXIS: dict[Motion, str] = {"press": "R", "twist": "T", "lean": "Zp"}


class Section:
    """Quadratic displacement and linear pressure (Taylor, Hood) on triangles; bonded at Z = 0.

    Args:
        mesh: a `skfem.MeshTri` in (R, Z).
    """

    def __init__(self, mesh: Any) -> None:
        from skfem import Basis, ElementTriP1, ElementTriP2, FacetBasis

        self.height = float(mesh.p[1].max())
        self.inside = Basis(mesh, ElementTriP2(), intorder=4)
        self.pressure = Basis(mesh, ElementTriP1(), intorder=4)
        outer = mesh.facets_satisfying(lambda x: (x > 1e-6).all(axis=0), boundaries_only=True)
        self.outside = FacetBasis(mesh, ElementTriP2(), facets=outer, intorder=_EDGE_ORDER)

    def size(self, motion: Motion) -> int:
        """Number of unknowns."""
        return sum(self._basis(field).N for field in FIELDS[motion])

    def free(self, motion: Motion) -> NDArray[np.int64]:
        """Unknowns that neither the flat face nor the axis holds."""
        left = np.ones(self.size(motion), dtype=bool)
        for field in FIELDS[motion]:
            basis, first = self._basis(field), self._first(motion, field)
            if field != "p":
                left[first + basis.get_dofs(lambda x: x[1] < 1e-6).all()] = False
            if field in _ZERO_ON_AXIS[motion]:
                left[first + basis.get_dofs(lambda x: x[0] < 1e-6).all()] = False
        return np.nonzero(left)[0]

    def body(self, motion: Motion) -> Body:
        """All of it, for one motion."""
        radius = np.asarray(self.inside.global_coordinates())[0]
        waves = 1.0 if motion == "lean" else 0.0
        rows, places = [], []
        for field in FIELDS[motion]:
            basis = self._basis(field)
            for (function,) in basis.basis:
                rows.append(_rows(field, function, radius, waves))
            places.append(basis.element_dofs + self._first(motion, field))
        weights = (2.0 - waves) * pi * radius * self.inside.dx
        return Body(np.stack(rows, 1), np.concatenate(places), weights, self.size(motion))

    def edge(self, motion: Motion, field: str) -> tuple[Any, Array, Array]:
        """A displacement at points of the outer edge.

        Returns:
            Sparse matrix from the unknowns; (R, Z) of the points, shape (2, points); their areas, shape (points,).
        """
        basis = self.outside
        places = np.asarray(basis.global_coordinates()).reshape(2, -1)
        waves = 1.0 if motion == "lean" else 0.0
        areas = (2.0 - waves) * pi * places[0] * basis.dx.ravel()
        return at_points(basis, self._first(motion, field), self.size(motion)), places, areas

    def _basis(self, field: str) -> Any:
        return self.pressure if field == "p" else self.inside

    def _first(self, motion: Motion, field: str) -> int:
        """Place of the first unknown of a field."""
        before = FIELDS[motion][: FIELDS[motion].index(field)]
        return sum(self._basis(other).N for other in before)


def _rows(field: str, function: Any, radius: Array, waves: float) -> Array:
    """State at the points by the unknown of one function: (9 of grad u in R, Theta, Z; p), shape (10, ...)."""
    N, rows = np.asarray(function), np.zeros((N_ROWS, *radius.shape))
    if field == "p":
        rows[9] = N
        return rows
    along_R, along_Z = function.grad
    first = 3 * "RTZ".index(field)
    rows[first], rows[first + 2] = along_R, along_Z
    rows[first + 1] = (waves if field == "T" else -waves) * N / radius
    if field == "R":  # the directions turn with Theta
        rows[4] = N / radius
    elif field == "T":
        rows[1] = -N / radius
    return rows
