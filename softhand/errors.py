"""Every error that softhand raises for a mistake that its user can mend."""

from __future__ import annotations

from typing import Any


class SofthandError(Exception):
    """Base of all errors that softhand raises on purpose.

    The message says what was wrong, the value got, what is allowed and what to try. Extra keyword arguments
    become attributes, so that a program can react to `error.finger` or `error.value`.
    """

    def __init__(self, message: str, **data: Any) -> None:
        super().__init__(message)
        self.__dict__.update(data)


class ScenarioError(SofthandError):
    """A scenario, or a setting of it, cannot be used. Carries `.key` and `.value`."""


class ModelError(SofthandError):
    """A URDF cannot be turned into a hand or an object. Carries `.file`."""


class GraspError(SofthandError):
    """No grasp at rest exists for what was asked. Carries `.finger`, `.quantity` and `.value`."""


class LawError(SofthandError):
    """A fingertip law is not usable: wrong number of results, not compilable, NaN. Carries `.law`."""


class MeasurementError(SofthandError):
    """Measurements of a fingertip cannot be read, or no law can be fitted to them. Carries `.column` and `.value`."""


class SimulationStopped(SofthandError):
    """A run ended before its duration. Carries `.recording` with all that was computed, `.reason` and `.time`."""


class ControllerError(SimulationStopped):
    """A controller raised, or returned something that is no torque. Carries `.controller` as well."""


class RecordingError(SofthandError):
    """A recording cannot be read or written. Carries `.file`."""


class BrowserError(SofthandError):
    """Chromium is missing, does not start or does not answer, or a page in it failed."""
