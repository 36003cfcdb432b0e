"""What a fingertip can have been measured at: most often a wrong unit is found out here."""

from __future__ import annotations

import numpy as np

from softhand.errors import MeasurementError
from softhand.identification.files.header import FORCE
from softhand.identification.record import Measurements

LARGEST = 1e6
"""No fingertip bears more [N], [N m]."""
_SMALLEST = 1e-12  # [N], [N m]; nothing smaller is measured


def check_plausible(measurements: Measurements, radius: float) -> None:
    """Refuse measurements of which no law could be fitted.

    Raises:
        MeasurementError: nothing was measured, forces of no size that a tip has, or dr beyond the radius.
    """
    if not 0.0 < radius <= 1.0:
        raise MeasurementError(
            f"The radius of the tip is {radius} m; it must be positive, and 1 m at most.", column="radius", value=radius
        )
    there = np.isfinite(measurements.force)
    if not there.any():
        raise MeasurementError("No force and no moment was measured; give at least one row.", column="", value=None)
    largest = np.max(np.where(there, np.abs(measurements.force), 0.0), axis=0)
    for name, size in zip(FORCE, largest.tolist(), strict=True):
        if size > 0.0 and not _SMALLEST <= size <= LARGEST:
            raise MeasurementError(
                f"{name} is {size:g} at most, which no fingertip gives. Is the unit right?", column=name, value=size
            )
    deepest = float(measurements.deformation[:, 0].max())
    if deepest >= radius:
        raise MeasurementError(
            f"The largest dr is {1e3 * deepest:g} mm, but the radius of the tip is {1e3 * radius:g} mm. "
            "Is one of the units wrong?",
            column="dr", value=deepest,
        )  # fmt: skip
