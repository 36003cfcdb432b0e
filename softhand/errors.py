"""Every error that softhand raises for a mistake that its user can mend."""

from __future__ import annotations

from typing import Any


class SofthandError(Exception):
    """Base of all errors that softhand raises on purpose.

    The message says what was wrong, the value got, what is allowed and what to try. Keyword arguments become
    attributes, so that a program can react to `error.finger` or `error.value`.
    """

    def __init__(self, message: str, **data: Any) -> None:
        super().__init__(message)
        self.__dict__.update(data)

    def say_more(self, text: str) -> None:
        """Put another sentence behind the message."""
        self.args = (f"{self}{text}", *self.args[1:])


class ScenarioError(SofthandError):
    """A scenario, or a setting of it, cannot be used."""

    key: str = ""
    """Dotted path of the setting."""
    value: Any = None
    """What it was."""


class ModelError(SofthandError):
    """A URDF cannot be turned into a hand or an object."""

    file: str = ""


class GraspError(SofthandError):
    """No grasp at rest exists for what was asked."""

    finger: str = ""
    """Or joint."""
    quantity: str = ""
    """Such as `reach`, `force`, `torque`."""
    value: Any = None


class LawError(SofthandError):
    """A fingertip law is not usable: wrong number of results, not compilable, NaN."""

    law: str = ""
    file: str = ""
    """Of the formula at fault, if one is."""
    line: int = 0


class MeasurementError(SofthandError):
    """Measurements of a fingertip cannot be read, or no law can be fitted to them."""

    column: str = ""
    value: Any = None


class SimulationStopped(SofthandError):
    """A run ended before its duration."""

    recording: Any = None
    """All that was computed; None outside of `Simulation.run`."""
    reason: str = ""
    """One word: `flat`, `apex`, `rim`, `law`, `diverged`, `controller`, `reference`, `stepper`, `given up`,
    `interrupted`, `lost`, `collision`."""
    time: float = 0.0
    """Of the last good sample [s]."""
    finger: str = ""
    """At fault, if one is."""
    law: str = ""
    """At fault, if one is."""
    rows: Any = None
    """Of a study, what was finished."""


class StudyError(SofthandError):
    """A study, or the store of its runs, cannot be used."""

    file: Any = None
    line: int = 0
    """Of the study's file; 0 where there is none to name."""
    key: str = ""
    """Dotted path of the setting."""
    value: Any = None
    """What it was."""


class SweepStopped(SofthandError):
    """A sweep ended before its last run; what is done is in its store, and the same call goes on."""

    reason: str = ""
    """`interrupted`, or `lost` for want of disk or workers."""
    done: int = 0
    """Runs."""
    runs: int = 0
    """Of all."""
    folder: Any = None
    """Of the store."""


class RolloutStopped(SofthandError):
    """Many runs were interrupted."""

    runs: Any = None
    """All that was computed, a `Runs`."""


class ControllerError(SimulationStopped):
    """A controller raised, or returned something that is no torque."""

    controller: str = ""
    """Name of its class."""


class RecordingError(SofthandError):
    """A recording cannot be read or written."""

    file: Any = None


class MissingArrayError(RecordingError, AttributeError, KeyError):
    """A recording has no array of that name. As Python wants it, also an AttributeError and a KeyError."""

    __str__ = Exception.__str__  # KeyError would show it in quotes


class BrowserError(SofthandError):
    """Chromium is missing, does not start or does not answer, or a page in it failed."""


class ScenarioWarning(UserWarning):
    """A scenario runs, but not as it is meant: `softhand.simulate` warns so, `softhand.check` says more."""
