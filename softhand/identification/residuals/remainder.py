"""What is left of the measured numbers, and what parts of it are taken out before the rest is judged."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from softhand.identification.fitting.solving import SINGULAR, Solution, scaled
from softhand.identification.record import Measurements
from softhand.identification.residuals.series import find_directions, find_series
from softhand.numerics.arrays import Array


@dataclass(frozen=True, eq=False)
class Residuals:
    """Residuals in standard deviations of their component, series by series.

    Attributes:
        error: measured less fitted, shape (m,).
        slope: what a change of the coefficients adds to the fitted numbers, columns of length 1, shape (m, p).
        force: the fitted numbers, shape (m,).
        spread: standard deviation beside others of the component, as weighted, shape (m,).
        component: 0 to 3, shape (m,).
        setting: number of the setting, shape (m,).
        series: number of the series and component, 0, 1, ..., shape (m,).
        direction: 1 where the deformation grows along the series, -1 where it falls back, shape (m,).
        number: place of each among the measured numbers of the model, shape (m,).
    """

    error: Array
    slope: Array
    force: Array
    spread: Array
    component: NDArray[np.int64]
    setting: NDArray[np.int64]
    series: NDArray[np.int64]
    direction: NDArray[np.int64]
    number: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.error)

    def over(self, spread: Array) -> Residuals:
        """The same in other standard deviations."""
        slope = scaled(self.slope / spread[:, None])[0]
        return replace(
            self, error=self.error / spread, slope=slope, force=self.force / spread, spread=self.spread * spread
        )

    def sums(self, values: Array) -> Array:
        """Sums over each series, shape (series,) or (series, ...)."""
        return np.add.reduceat(values, self._starts, axis=0)

    @cached_property
    def _starts(self) -> NDArray[np.int64]:
        """Place of the first number of each series."""
        return np.flatnonzero(np.diff(self.series, prepend=-1))


@dataclass(frozen=True, eq=False)
class Remainder:
    """Residuals without what the coefficients, and gains of the series, could take up.

    Attributes:
        error: what remains, shape (m,).
        taken: orthonormal columns of what was taken out, but for the gains, shape (m, r).
        gain: of length 1 over each series, what its gain takes out; zeros where gains are left in, shape (m,).
        freedom: numbers less what was taken out.
    """

    error: Array
    taken: Array
    gain: Array
    freedom: int

    @property
    def leverage(self) -> Array:
        """Share of each number that was taken out, shape (m,)."""
        return np.sum(self.taken**2, axis=1) + self.gain**2


def find_residuals(solution: Solution, spread: Array, measurements: Measurements) -> Residuals:
    """The residuals of a fit in the order of their series."""
    model = solution.model
    by_row = find_series(measurements)
    pairs = np.column_stack([by_row[model.row], model.component])
    series = np.unique(pairs, axis=0, return_inverse=True)[1].ravel()
    order = np.lexsort((model.row, series))
    return Residuals(
        solution.residual[order],
        scaled(solution.weighted_slope)[0][order],
        (solution.weight * model.forces(solution.values))[order],
        spread[order],
        model.component[order],
        model.setting[order],
        series[order],
        find_directions(measurements, by_row)[model.row][order],
        order,
    )


def remainder(residuals: Residuals, with_gains: bool, extra: Array | None = None) -> Remainder:
    """Take out the coefficients, further columns if given, and a gain of each series if asked."""
    columns = residuals.slope if extra is None else np.column_stack([residuals.slope, scaled(extra)[0]])
    error, gain, count = residuals.error, np.zeros(len(residuals)), 0
    if with_gains:
        length = np.sqrt(residuals.sums(residuals.force**2))
        gain = residuals.force / np.where(length > 0.0, length, 1.0)[residuals.series]
        count = int(np.sum(length > 0.0))
        columns = columns - gain[:, None] * residuals.sums(gain[:, None] * columns)[residuals.series]
        error = error - gain * residuals.sums(gain * error)[residuals.series]
    left, singular, _ = np.linalg.svd(columns, full_matrices=False)
    taken = left[:, singular > SINGULAR]  # the columns had length 1 before the gains were taken out
    return Remainder(error - taken @ (taken.T @ error), taken, gain, len(residuals) - count - taken.shape[1])
