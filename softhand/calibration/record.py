"""What a calibration has found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from softhand.errors import MeasurementError
from softhand.numerics.record import Record
from softhand.scenario.scenario import Scenario

_WORSE = 1.15
"""Residuals of the held-out part over the noise, from which the fit is said to be worse there."""


@dataclass(frozen=True)
class Estimate(Record):
    """A parameter with its interval.

    Attributes:
        name: key of the scenario.
        value: that fits best.
        low: lower end of the interval.
        high: upper end.
        unit: of all three.
        start: value that the fit began from.
        note: what is to be said of it, or "".
    """

    name: str
    value: float
    low: float
    high: float
    unit: str
    start: float
    note: str


@dataclass(frozen=True)
class Residuals(Record):
    """What is left of a measured quantity.

    Attributes:
        quantity: as in the section `sensing` of a scenario.
        noise: standard deviation of the residuals of the fitted part, in the unit of the quantity.
        held_out: root mean square of those of the held-out part over the noise; NaN without one.
        alike: correlation of neighbours; 0 for white noise.
    """

    quantity: str
    noise: float
    held_out: float
    alike: float


@dataclass(frozen=True, eq=False)
class Calibration(Record):
    """Numbers of a scenario fitted to a log.

    Attributes:
        estimates: of the parameters.
        residuals: by quantity.
        level: of the intervals.
        is_noise: whether residuals are white; else the intervals are those for residuals that belong together.
        untold: what the log does not tell, in words; it was held.
        starts: from which the fit began and came to rest.
        agreeing: of these, how many came to the same values.
        duration: of the log [s].
        source: of the log.
        scenario: with what was found put in.
        fitted: the fit with its pieces, for figures.
    """

    units: ClassVar = {"level": "1", "duration": "s"}
    unreported: ClassVar = frozenset({"scenario", "fitted"})

    estimates: tuple[Estimate, ...]
    residuals: tuple[Residuals, ...]
    level: float
    is_noise: bool
    untold: tuple[str, ...]
    starts: int
    agreeing: int
    duration: float
    source: str
    scenario: Scenario
    fitted: Any

    def estimate(self, name: str) -> Estimate:
        """The estimate of a key, or of the only one that ends so.

        Raises:
            MeasurementError: nothing of that name was fitted.
        """
        found = [one for one in self.estimates if one.name == name or one.name.endswith(f".{name}")]
        if len(found) != 1:
            names = ", ".join(one.name for one in self.estimates)
            raise MeasurementError(
                f"{name}: was not fitted, or is not unique; there are {names}.", column=name, value=None
            )
        return found[0]

    def value(self, name: str) -> float:
        """The value of a parameter that fits best."""
        return self.estimate(name).value

    def interval(self, name: str) -> tuple[float, float]:
        """Ends of the interval of a parameter."""
        one = self.estimate(name)
        return one.low, one.high

    def to_toml(self) -> str:
        """The scenario with what was found; delays as whole control periods."""
        return self.scenario.to_toml()

    def rows(self) -> list[tuple[str, ...]]:
        """Name, value, ends of the interval, unit, where the fit began and note of each parameter."""
        return [
            (one.name, f"{one.value:.6g}", f"{one.low:.6g}", f"{one.high:.6g}", one.unit, f"{one.start:.6g}", one.note)
            for one in self.estimates
        ]

    def residual_rows(self) -> list[tuple[str, ...]]:
        """Quantity, noise, held-out residuals over it, and correlation of neighbours."""
        return [
            (
                one.quantity,
                f"{one.noise:.3g}",
                "-" if np.isnan(one.held_out) else f"{one.held_out:.3f}",
                f"{one.alike:.3f}",
            )
            for one in self.residuals
        ]

    @property
    def findings(self) -> tuple[str, ...]:
        """What is to be said of the fit."""
        elsewhere = self.starts - self.agreeing
        said = [f"not told, and held: {text}" for text in self.untold]
        alike = [f"{one.quantity} ({one.alike:.2f})" for one in self.residuals if abs(one.alike) > 0.1]
        if not self.is_noise:
            said.append(
                f"the residuals of {', '.join(alike)} are like their neighbours: the model is not all that is in the "
                "log; the intervals allow for that, but not for a bias of the model"
            )
        worse = [one for one in self.residuals if one.held_out > _WORSE]
        said += [
            f"{one.quantity}: residuals of the held-out part are {one.held_out:.2f} times those of the fitted one"
            for one in worse
        ]
        if self.agreeing < self.starts:
            said.append(f"{elsewhere} of {self.starts} starts came to rest elsewhere, with a larger sum")
        return tuple(said)
