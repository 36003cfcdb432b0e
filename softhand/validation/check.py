"""One line of the table: what was measured, what is exact, how far apart they may be."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

Experiment = Callable[[], "Iterable[Check]"]
"""Runs one small system and says what it found."""


@dataclass(frozen=True)
class Check:
    """A measured number beside the exact one."""

    name: str
    measured: float
    exact: float
    tolerance: float
    """Of the difference: a share of `exact`, or in `unit` if `exact` is 0 or `is_absolute`."""
    unit: str = ""
    is_absolute: bool = False

    @property
    def allowed(self) -> float:
        """Largest difference, in `unit`."""
        return self.tolerance if self.is_absolute or self.exact == 0.0 else self.tolerance * abs(self.exact)

    @property
    def passed(self) -> bool:
        """Whether measured and exact are close enough; never for NaN."""
        return abs(self.measured - self.exact) <= self.allowed
