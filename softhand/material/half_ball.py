"""One side of a hemisphere as curved tetrahedra, finer where it is pressed."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.numerics.arrays import Array

_FINER_WITHIN = ((0.9,), (0.9, 0.75))  # of the contact, over the radius, by level
_ZERO = 1e-9


def half_ball(level: int, towards: Array) -> Any:
    """The points y > 0 of the hemisphere z > 0 of radius 1 about the origin; flat face and symmetry are planes.

    Args:
        level: 0 or 1, the mesh of about 2000 or 5000 unknowns.
        towards: unit vector in the plane y = 0 to the point of first touch, shape (3,).

    Returns:
        A `skfem.MeshTet2`, whose edges are arcs where they lie in the sphere.
    """
    from skfem import MeshTet, MeshTet2

    ball = MeshTet.init_ball(1)
    middles = _middles(ball)
    mesh = _rounded(ball.restrict(np.nonzero((middles[1] > 0.0) & (middles[2] > 0.0))[0]).refined())
    for reach in _FINER_WITHIN[level]:
        near = np.linalg.norm(_middles(mesh) - towards[:, None], axis=0) < reach
        mesh = _rounded(mesh.refined(np.nonzero(near)[0]))
    curved = MeshTet2.from_mesh(mesh)
    points = curved.doflocs.copy()
    sides = mesh.facets[:, outer_facets(mesh)]
    edges = np.sort(np.hstack([sides[[0, 1]], sides[[1, 2]], sides[[0, 2]]]), axis=0)
    known = {tuple(edge): k for k, edge in enumerate(mesh.edges.T)}
    middle = mesh.p.shape[1] + np.array([known[tuple(edge)] for edge in np.unique(edges, axis=1).T])
    points[:, middle] /= np.linalg.norm(points[:, middle], axis=0)
    return MeshTet2(points, curved.t)


def outer_facets(mesh: Any) -> Any:
    """Those in the sphere."""
    facets = mesh.boundary_facets()
    x = mesh.p[:, mesh.facets[:, facets]]
    return facets[(np.abs(x[1]) > _ZERO).any(axis=0) & (np.abs(x[2]) > _ZERO).any(axis=0)]


def _middles(mesh: Any) -> Any:
    return mesh.p[:, mesh.t].mean(axis=1)


def _rounded(mesh: Any) -> Any:
    """New points on the outer side moved onto the sphere."""
    points, outer = mesh.p.copy(), np.unique(mesh.facets[:, outer_facets(mesh)])
    points[:, outer] /= np.linalg.norm(points[:, outer], axis=0)
    return type(mesh)(points, mesh.t)
