"""What a study asks of each run: numbers by name, and limits within which a run is a success."""

from __future__ import annotations

from typing import Literal

from pydantic import field_validator, model_validator

from softhand.recording.variables import VARIABLES
from softhand.settings.settings import Settings
from softhand.settings.wording import choices

READY = {
    "position_error": "mm",
    "orientation_error": "deg",
    "friction_use": "1",
    "force_error": "N",
    "settling_time": "s",
    "overshoot": "%",
    "effort": "N m",
}
"""Figures of `analysis.performance.Performance` that a run can be asked for, with their units."""


class Outcome(Settings):
    """A number of each run: a figure that is ready, or one of a recorded variable."""

    figure: str | None = None
    """One of the figures of a run, such as `position_error`; docs/controllers.md has what they mean."""
    variable: str | None = None
    """An array of a recording, such as `slip_travel`."""
    of: Literal["max", "min", "norm", "mean"] = "max"
    """What becomes of the numbers of one sample."""
    over: Literal["last", "first", "max", "min", "mean", "rms"] = "last"
    """What becomes of the samples of a run."""

    @field_validator("figure")
    @classmethod
    def _is_ready(cls, name: str | None) -> str | None:
        if name is not None and name not in READY:
            raise ValueError(f"no figure has this name. {choices(name, READY)}")
        return name

    @field_validator("variable")
    @classmethod
    def _is_recorded(cls, name: str | None) -> str | None:
        if name is not None and name not in VARIABLES:
            raise ValueError(f"no variable has this name. {choices(name, VARIABLES)}")
        return name

    @model_validator(mode="after")
    def _is_one(self) -> Outcome:
        if (self.figure is None) == (self.variable is None):
            raise ValueError("give either a figure or a variable.")
        return self

    @property
    def units(self) -> str:
        """Of the number; of several, those of the variable."""
        return READY[self.figure] if self.figure else VARIABLES[self.variable or ""].units


class Condition(Settings):
    """Limits of an outcome, both with the value itself."""

    below: float | None = None
    """Largest value of a success."""
    above: float | None = None
    """Smallest value of a success."""

    @model_validator(mode="after")
    def _is_some(self) -> Condition:
        if self.below is None and self.above is None:
            raise ValueError("give below, above or both.")
        if self.below is not None and self.above is not None and self.above > self.below:
            raise ValueError(f"nothing is above {self.above:g} and below {self.below:g}.")
        return self
