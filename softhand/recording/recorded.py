"""What a recording tells of its scenario."""

from __future__ import annotations

from typing import Any

from softhand.recording.recording import Recording
from softhand.settings.toml import tomllib


def scenario_of(recording: Recording) -> dict[str, Any]:
    """The recorded scenario; empty if its text cannot be read."""
    try:
        return tomllib.loads(recording.scenario)
    except ValueError:
        return {}


def is_coulomb(recording: Recording) -> bool:
    """Whether friction has a limit in this run, and its use is recorded."""
    contact = scenario_of(recording).get("fingertip", {}).get("contact")
    return contact == "coulomb" and "limit_surface_use" in recording.variables
