"""The limit surface of force and torsion as cones: an ellipse as it is, others by a polygon inside."""

from __future__ import annotations

import numpy as np

from softhand.numerics.arrays import Array

FACETS = 12
"""Of the polygon, which is inside the surfaces of soft tips by 0.4 % of the radius at most."""


def is_ellipse(curve: Array) -> bool:
    """Whether the limit surface is F^2 + T^2 = 1.

    Args:
        curve: c_i of `contact.limit.set_limit`, shape (5,).
    """
    return not np.any(curve)


def facets(curve: Array, count: int = FACETS) -> Array:
    """Rows (a, b) with a F + b T <= 1 inside the limit surface, F = |f_t| / (mu f_z), T = |tau| / tau_max.

    The corners of the polygon lie on the surface, which is convex, so that all of the polygon is inside.

    Args:
        curve: c_i of `contact.limit.set_limit`, shape (5,).
        count: of facets.

    Returns:
        Shape (count, 2), nothing below zero.
    """
    angle = np.linspace(0.0, 0.5 * np.pi, count + 1)
    u = np.sin(angle) ** 2
    Q = 1.0 + u * (1.0 - u) * np.polynomial.polynomial.polyval(u, curve)
    F, T = np.sin(angle) / np.sqrt(Q), np.cos(angle) / np.sqrt(Q)
    F, T = np.minimum(np.maximum.accumulate(F), F[-1]), np.minimum(np.maximum.accumulate(T[::-1])[::-1], T[0])
    cross = F[1:] * T[:-1] - F[:-1] * T[1:]
    rows: Array = np.column_stack([(T[:-1] - T[1:]) / cross, (F[1:] - F[:-1]) / cross])
    return rows
