"""The restricted likelihood of sizes of noise: how well they explain what residuals are left of a fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from softhand.identification.fitting.solving import span
from softhand.identification.residuals.remainder import Residuals
from softhand.numerics.arrays import Array

FLOOR = 1e-6
"""Least variance of a number; that of the residuals is 1."""


@dataclass(frozen=True, eq=False)
class _State:
    """What holds at some sizes. With D the independent part of V, and u_s the forces of series s:

    Attributes:
        inverse: 1 / D, shape (m,).
        pull: u / D, what V^-1 leaves of it is this over `grown`, shape (m,).
        power: u_s' D^-1 u_s, shape (series,).
        grown: 1 + size u_s' D^-1 u_s, shape (series,).
        loss: size / grown, so that V^-1 = D^-1 - loss_s pull_s pull_s', shape (series,).
        W: V^-1 A, shape (m, p).
        Phi: (A' V^-1 A)^-1, shape (p, p).
        error: R e, shape (m,).
    """

    inverse: Array
    pull: Array
    power: Array
    grown: Array
    loss: Array
    W: Array
    Phi: Array
    error: Array


class Likelihood:
    """Restricted likelihood [Patterson, Thompson, Biometrika 58, 1971] of the residuals e of a fit.

    Their variance is V = sum_i size_i V_i: diagonal parts, and a gain of each series, for which V_i is the sum of
    u_s u_s' with u_s the forces of series s. With A what the coefficients can take up and
    R = V^-1 - V^-1 A (A' V^-1 A)^-1 A' V^-1, no larger matrix is made than of numbers by coefficients.

    Args:
        residuals: e and A, in the order of their series.
        parts: the diagonals, shape (k, m).
        with_gains: whether series have gains, of one size.
    """

    def __init__(self, residuals: Residuals, parts: Array, with_gains: bool) -> None:
        self._residuals, self._parts, self._with_gains = residuals, parts, with_gains
        self._taken = span(residuals.slope)

    @property
    def start(self) -> Array:
        """Sizes to begin from: noise of the components alone, some of the rest."""
        power = max(float(np.mean(self._residuals.force**2)), 1e-300)
        return np.array([1.0] * 4 + [0.1 / power] * (len(self._parts) - 4 + self._with_gains))

    def at(self, size: Array) -> tuple[float, Array]:
        """Minus the logarithm of the likelihood, and its derivatives by the sizes.

        2 criterion = log |V| + log |A' V^-1 A| + e' R e
        2 d criterion / d size_i = tr(R V_i) - e' R V_i R e
        """
        residuals, state = self._residuals, self._state(size)
        volume = np.sum(np.log(state.grown)) - np.sum(np.log(state.inverse)) - np.linalg.slogdet(state.Phi)[1]
        slope = self._parts @ (state.inverse - self._taken_out(state) - state.error**2)
        if self._with_gains:
            N = residuals.sums(residuals.force[:, None] * state.W)
            trace = np.sum(state.power / state.grown) - np.sum((N @ state.Phi) * N)
            slope = np.append(slope, trace - np.sum(residuals.sums(residuals.force * state.error) ** 2))
        return 0.5 * float(volume + residuals.error @ state.error), 0.5 * slope

    def information(self, size: Array) -> Array:
        """tr(R V_i R V_j) / 2, the inverse of the covariance of the sizes."""
        residuals, parts, state = self._residuals, self._parts, self._state(size)
        W, Phi = state.W, state.Phi
        # R = 1 / D - B, with B = loss pull pull' in each series, plus W Phi W'
        among = np.array([Phi @ (W.T @ (part[:, None] * W)) for part in parts])
        loss, by_part = state.loss, [residuals.sums(part * state.pull**2) for part in parts]
        across = [residuals.sums((part * state.pull)[:, None] * W) for part in parts]
        found = parts * state.inverse * (state.inverse - 2.0 * self._taken_out(state)) @ parts.T
        found += np.einsum("iab,jba->ij", among, among)
        found += np.array([[np.sum(loss**2 * one * other) for one in by_part] for other in by_part])
        found += 2.0 * np.array([[np.sum(loss[:, None] * (one @ Phi) * other) for one in across] for other in across])
        if self._with_gains:
            N, alone = residuals.sums(residuals.force[:, None] * W), state.power / state.grown
            NPhi, left = N @ Phi, state.pull / state.grown[residuals.series]
            both = Phi @ N.T @ NPhi  # R u_s = left on series s, less W Phi N_s
            squares = left**2 - 2.0 * left * np.sum(W * NPhi[residuals.series], axis=1) + np.sum((W @ both) * W, axis=1)
            own = np.sum(alone**2) - 2.0 * np.sum(alone * np.sum(NPhi * N, axis=1)) + np.trace(both @ N.T @ N)
            side = parts @ squares
            found = np.block([[found, side[:, None]], [side, own]])
        return 0.5 * found

    def _state(self, size: Array) -> _State:
        residuals = self._residuals
        inverse = 1.0 / np.maximum(size[: len(self._parts)] @ self._parts, FLOOR)
        pull = residuals.force * inverse
        power = residuals.sums(residuals.force * pull)
        gain = size[-1] if self._with_gains else 0.0
        grown = 1.0 + gain * power
        loss = gain / grown

        def solve(columns: Array) -> Array:
            along = loss[:, None] * residuals.sums(pull[:, None] * columns)
            return inverse[:, None] * columns - pull[:, None] * along[residuals.series]

        W = solve(self._taken)
        Phi = np.linalg.inv(self._taken.T @ W)
        error = solve(residuals.error[:, None])[:, 0] - W @ (Phi @ (W.T @ residuals.error))
        return _State(inverse, pull, power, grown, loss, W, Phi, error)

    def _taken_out(self, state: _State) -> Array:
        """Diagonal of D^-1 - R, shape (m,)."""
        return state.loss[self._residuals.series] * state.pull**2 + np.sum((state.W @ state.Phi) * state.W, axis=1)
