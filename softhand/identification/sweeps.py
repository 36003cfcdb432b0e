"""The series in which measurements are drawn: one quantity varied, all others held, as in [Nakashima] Figs. 9-12."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softhand.identification.record import Measurements

DR, DTHETA, DPHI, DPSI, PHI = range(5)
_VARIED = {0: (DR,), 1: (DTHETA,), 2: (DPHI,), 3: (DPSI, DR)}
"""What is varied for each component: its own deformation, and for the torsion moment also dr."""
_MOST = 4


@dataclass(frozen=True, eq=False)
class Sweep:
    """One series.

    Attributes:
        component: 0 to 3 for Fr, Ftheta, Fphi, Fpsi.
        varied: index of what is varied, in (dr, dtheta, dphi, dpsi, phi).
        held: the imposed values; that of `varied` means nothing, shape (5,).
        rows: of the measurements.
    """

    component: int
    varied: int
    held: NDArray[np.float64]
    rows: NDArray[np.int64]


def find_sweeps(measurements: Measurements, component: int) -> list[Sweep]:
    """Up to four series of a component, those of large contact angles first; none if nothing was varied alone."""
    imposed = np.round(measurements.imposed, 9)
    there = np.flatnonzero(np.isfinite(measurements.force[:, component]))
    found = []
    for varied in _VARIED[component]:
        others = np.delete(imposed[there], varied, axis=1)
        groups, number = np.unique(others, axis=0, return_inverse=True)
        series = []
        for k in range(len(groups)):
            rows = there[number.ravel() == k]
            if len(np.unique(imposed[rows, varied])) > 1:
                series.append(Sweep(component, varied, imposed[rows[0]], rows))
        series.sort(key=lambda sweep: -sweep.held[PHI])
        found += series
    spread = np.linspace(0, len(found) - 1, min(len(found), _MOST)).round().astype(int)
    return [found[k] for k in spread]
