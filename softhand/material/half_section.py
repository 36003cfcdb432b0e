"""The half section of a hemisphere as triangles, finer where it is pressed."""

from __future__ import annotations

from typing import Any

import numpy as np

_FINER_WITHIN = (0.9, 0.8)  # of the apex, over the radius; the contact reaches to 0.75 at a depth of 0.4


_SKINS = (0.12,)  # over the radius, where the edge of the contact will be


def half_section(level: int) -> Any:
    """A quarter of the unit disc in (R, Z): the flat face at Z = 0, the apex at (0, 1).

    Args:
        level: each more halves all edges.

    Returns:
        A `skfem.MeshTri`.
    """
    from skfem import MeshTri

    disc = MeshTri.init_circle(2)
    mesh = disc.restrict(np.nonzero((_centres(disc) > 0.0).all(axis=0))[0])
    for reach in _FINER_WITHIN:
        R, Z = _centres(mesh)
        mesh = _rounded(mesh.refined(np.nonzero(np.hypot(R, Z - 1.0) < reach)[0]))
    for depth in _SKINS:
        R, Z = _centres(mesh)
        skin = (np.hypot(R, Z) > 1.0 - depth) & (np.hypot(R, Z - 1.0) < _FINER_WITHIN[-1])
        mesh = _rounded(mesh.refined(np.nonzero(skin)[0]))
    for _ in range(level):
        mesh = _rounded(mesh.refined())
    return mesh


def _centres(mesh: Any) -> Any:
    return mesh.p[:, mesh.t].mean(axis=1)


def _rounded(mesh: Any) -> Any:
    """New points on the outer edge moved onto the circle."""
    points = mesh.p.copy()
    outer = np.unique(mesh.facets[:, mesh.boundary_facets()])
    outer = outer[(points[:, outer] > 1e-9).all(axis=0)]
    points[:, outer] /= np.hypot(*points[:, outer])
    return type(mesh)(points, mesh.t)
