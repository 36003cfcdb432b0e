"""A neo-Hookean body, nearly or fully incompressible: its energy to second order about any deformation."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.numerics.arrays import Array

N_ROWS = 10
"""Numbers of a state at a point: the nine of F - 1, row by row, and the pressure p."""


class NeoHookean:
    """W = (1/2) (F:F - 3 - 2 ln J) + p (J - 1) - p^2 / (2 lambda), stationary in p; G = 1.

    lambda = 2 G nu / (1 - 2 nu); at nu = 0.5 the last term is gone and J = 1. Small strain is Hooke's law.
    """

    def __init__(self, nu: float) -> None:
        self.softness = (1.0 - 2.0 * nu) / (2.0 * nu)
        """1 / lambda."""

    def expand(self, state: Array) -> tuple[Array, Array]:
        """Derivatives of W at points.

        Args:
            state: rows of F - 1 and p, shape (10, ...).

        Returns:
            First and second, shapes (10, ...) and (10, 10, ...).
        """
        points = state.shape[1:]
        F = state[:9].reshape(3, 3, *points) + _spread(np.eye(3), points)
        p = state[9]
        last = np.moveaxis(F, (0, 1), (-2, -1))
        J, back = np.linalg.det(last), np.moveaxis(np.linalg.inv(last), (-2, -1), (0, 1))
        turned = np.swapaxes(back, 0, 1).reshape(9, *points)  # F^-T
        slope = np.concatenate([F.reshape(9, *points) + (p * J - 1.0) * turned, (J - 1.0 - self.softness * p)[None]])
        crossed = np.einsum("ai...,bj...->ibja...", back, back).reshape(9, 9, *points)
        bend = np.empty((N_ROWS, N_ROWS, *points))
        bend[:9, :9] = _spread(np.eye(9), points) + (1.0 - p * J) * crossed + p * J * turned[:, None] * turned[None]
        bend[:9, 9] = bend[9, :9] = J * turned
        bend[9, 9] = -self.softness
        return slope, bend


def _spread(table: Any, points: tuple[int, ...]) -> Any:
    """A table at every point."""
    return table.reshape(*table.shape, *(1 for _ in points))
