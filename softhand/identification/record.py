"""What was imposed on a fingertip and what was measured."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softhand.errors import MeasurementError
from softhand.numerics.arrays import Array

EXAMPLE = Path(__file__).with_name("example.csv")
"""Measurements to try things with: generated, not measured, as their first lines say."""


@dataclass(frozen=True, eq=False)
class Measurements:
    """What was imposed on a hemispherical tip and what was measured, in the order in which it was done.

    Attributes:
        phi: contact angle of the undeformed tip, phi = Phi + dphi [rad], shape (n,).
        deformation: dr [m], dtheta, dphi, dpsi [rad], shape (n, 4).
        force: Fr [N], Ftheta, Fphi, Fpsi [N m], NaN where not measured, shape (n, 4).
        radius: of the undeformed tip [m], if the file says so.
        run: rows of different numbers are never one series; all 0 if None, shape (n,).
        has_series: whether `run` is the series themselves, as a column of a file says them.
        notes: what reading a file changed, in words.

    Raises:
        MeasurementError: arrays of other shapes, or an imposed value that is no number.
    """

    phi: Array
    deformation: Array
    force: Array
    radius: float | None = None
    run: NDArray[np.int64] | None = None
    has_series: bool = False
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        count = np.size(self.phi)
        for name, shape in (("phi", (count,)), ("deformation", (count, 4)), ("force", (count, 4)), ("run", (count,))):
            values = np.zeros(count, dtype=np.int64) if name == "run" and self.run is None else getattr(self, name)
            values = np.asarray(values, dtype=np.int64 if name == "run" else float)
            if values.shape != shape:
                raise MeasurementError(
                    f"{name} of the measurements has the shape {values.shape}; it must be {shape}.",
                    column=name, value=values.shape,
                )  # fmt: skip
            object.__setattr__(self, name, values)
        if not np.all(np.isfinite(self.imposed)) or np.any(np.isinf(self.force)):
            what = "phi and the deformation must be finite numbers, and forces too, or NaN where they were not measured"
            raise MeasurementError(f"In the measurements {what}.", column="", value=None)

    def __len__(self) -> int:
        return len(self.phi)

    @property
    def imposed(self) -> Array:
        """dr, dtheta, dphi, dpsi, phi of each row, shape (n, 5)."""
        return np.column_stack([self.deformation, self.phi])

    @property
    def settings(self) -> NDArray[np.int64]:
        """Number of the imposed setting of each row: rows that repeat a setting have the same, shape (n,)."""
        _, number = np.unique(np.round(self.imposed, 9), axis=0, return_inverse=True)
        return number.ravel()

    @property
    def runs(self) -> NDArray[np.int64]:
        """`run`, zeros where none is given, shape (n,)."""
        return np.zeros(len(self), dtype=np.int64) if self.run is None else self.run

    def select(self, rows: NDArray[np.bool_]) -> Measurements:
        """Some of the rows."""
        return Measurements(self.phi[rows], self.deformation[rows], self.force[rows], self.radius,
                            self.runs[rows], self.has_series, self.notes)  # fmt: skip


def repeats_scatter(measurements: Measurements) -> Array:
    """Standard deviation of each component about the mean of its setting, pooled; NaN without repeats, shape (4,)."""
    result = np.full(4, np.nan)
    settings = measurements.settings
    for component, values in enumerate(measurements.force.T):
        there = np.isfinite(values)
        _, number, count = np.unique(settings[there], return_inverse=True, return_counts=True)
        if there.sum() > len(count):
            means = np.bincount(number, values[there]) / count
            result[component] = math.sqrt(np.sum((values[there] - means[number]) ** 2) / (there.sum() - len(count)))
    return result
