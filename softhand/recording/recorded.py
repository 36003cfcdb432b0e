"""What a recording tells of its scenario, which another version of softhand may have written."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from softhand.errors import RecordingError
from softhand.recording.recording import Recording
from softhand.settings.toml import parse_toml

_PLUGINS = ("controller", "reference", "stepper")


@dataclass(frozen=True)
class RecordedScenario:
    """The scenario of a recording as plain tables, any part of which may be missing or of another kind.

    Attributes:
        table: as the text has it; not to be changed.
    """

    table: dict[str, Any]

    def at(self, *keys: str) -> Any:
        """The value to which keys lead; None if there is none."""
        value: Any = self.table
        for key in keys:
            value = value.get(key) if isinstance(value, dict) else None
        return value

    def number(self, *keys: str) -> float | None:
        """The number to which keys lead; None if there is none."""
        return _number(self.at(*keys))

    def vector(self, *keys: str) -> tuple[float, float, float] | None:
        """The three numbers to which keys lead; None if there are none."""
        values = self.at(*keys)
        numbers = [_number(value) for value in values] if isinstance(values, list) else []
        match numbers:
            case [float(x), float(y), float(z)]:
                return x, y, z
        return None

    @property
    def title(self) -> str:
        """Its description, or words that fit any run."""
        return str(self.at("description") or "softhand run")

    @property
    def settings_line(self) -> str:
        """What it runs with, in a line."""
        chosen = {name: self.at(name, "name") or self.at(name, "kind") for name in _PLUGINS}
        return ", ".join(f"{name} {choice}" for name, choice in chosen.items() if choice)

    @property
    def is_coulomb(self) -> bool:
        """Whether the friction of its tips has a limit."""
        return bool(self.at("fingertip", "contact") == "coulomb")


def scenario_of(recording: Recording) -> RecordedScenario:
    """The recorded scenario, parsed once; without any table if its text cannot be read."""
    return read_scenario(recording.scenario)


def recorded_table(recording: Recording) -> dict[str, Any]:
    """The recorded scenario as tables of one's own.

    Raises:
        RecordingError: its text is no TOML.
    """
    try:
        return parse_toml(recording.scenario)
    except ValueError as error:
        raise RecordingError(
            f"The recording cannot be computed anew, as its scenario cannot be read: {error}", file=None
        ) from error


def is_coulomb(recording: Recording) -> bool:
    """Whether friction has a limit in this run, and its use is recorded."""
    return scenario_of(recording).is_coulomb and "limit_surface_use" in recording.variables


@lru_cache(maxsize=16)
def read_scenario(text: str) -> RecordedScenario:
    """The scenario of a text, parsed once; without any table if it cannot be read."""
    try:
        return RecordedScenario(parse_toml(text))
    except ValueError:
        return RecordedScenario({})


def _number(value: Any) -> float | None:
    is_number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    return float(value) if is_number else None
