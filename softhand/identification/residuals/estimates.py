"""What is known of each coefficient: value, interval, and why there is none."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from softhand.identification.fitting.coefficients import Coefficient, coefficients_of, offset_of
from softhand.identification.fitting.settling import Settled
from softhand.identification.residuals.intervals import find_intervals
from softhand.identification.residuals.judgement import Judgement
from softhand.numerics.record import Record


@dataclass(frozen=True)
class Estimate(Record):
    """One coefficient.

    Attributes:
        coefficient: which, with its limits.
        value: in SI; NaN if the data do not tell it.
        low: lower end of the confidence interval.
        high: upper end.
        note: why it is not told, or not well; "" if all is well.
        is_fitted: False for one that was fixed or left at its default.
    """

    unreported: ClassVar = frozenset({"coefficient"})

    coefficient: Coefficient
    value: float
    low: float = math.nan
    high: float = math.nan
    note: str = ""
    is_fitted: bool = True

    @property
    def units(self) -> Mapping[str, str]:  # type: ignore[override]  # each has its own
        """Unit of the value and of both ends."""
        return dict.fromkeys(("value", "low", "high"), self.coefficient.unit or "1")

    @property
    def name(self) -> str:
        """Of the coefficient."""
        return self.coefficient.name


def find_estimates(settled: Settled, judgement: Judgement, level: float) -> tuple[tuple[Estimate, ...], Estimate]:
    """Estimates of the coefficients of the law, and of the offset of dr.

    Where the offset is not shown, the values are those without it, and the intervals those beside a free one: what the
    data do not rule out is allowed for.
    """
    model, values = settled.solution.model, judgement.solution.values
    low, high = find_intervals(judgement.offset.solution, judgement.noise, level)
    low[: len(values)] = np.minimum(low[: len(values)], values)
    high[: len(values)] = np.maximum(high[: len(values)], values)

    def estimate(coefficient: Coefficient) -> Estimate:
        name = coefficient.name
        if name in model.fixed:
            return Estimate(coefficient, float(model.fixed[name]), note=settled.notes.get(name, "fixed"),  # type: ignore[arg-type]
                            is_fitted=False)  # fmt: skip
        if coefficient in settled.lost:
            return Estimate(coefficient, math.nan, note=settled.lost[coefficient], is_fitted=False)
        k = model.free.index(coefficient)
        note = "no interval: no number is left that tells the noise" if math.isnan(low[k]) else ""
        if high[k] - low[k] > 2.0 * abs(values[k]):
            note = "badly told: the interval is wider than the value"
        return Estimate(coefficient, float(values[k]), float(low[k]), float(high[k]), note)

    estimates = tuple(estimate(coefficient) for coefficient in coefficients_of(model.law_class))
    offset, kind = offset_of(model.radius), judgement.offset.kind
    if kind == "known":
        return estimates, estimate(offset)
    if kind == "unseen":
        return estimates, Estimate(offset, 0.0, note="not seen by the data, taken as 0", is_fitted=False)
    if kind == "beyond":
        return estimates, Estimate(offset, 0.0, note="none within a tenth of the radius fits", is_fitted=False)
    value = float(judgement.offset.solution.values[-1])
    return estimates, Estimate(offset, value if judgement.has_offset else 0.0, float(low[-1]), float(high[-1]),
                               "" if judgement.has_offset else f"not told from 0; the best is {value:.3g}")  # fmt: skip
