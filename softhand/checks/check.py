"""Is a URDF, a scenario or a recording sound?"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from softhand.checks.recording import RecordingCheckup, check_recording
from softhand.checks.scenario import Checkup, check_scenario
from softhand.checks.urdf import UrdfCheckup, check_urdf
from softhand.errors import ScenarioError
from softhand.recording.recording import Recording
from softhand.scenario.scenario import Scenario, load_scenario


def check(
    target: str | Path | Scenario | Recording, changes: Mapping[str, Any] | None = None
) -> Checkup | RecordingCheckup | UrdfCheckup:
    """What is wrong or doubtful in a URDF, a scenario or a recording.

    Args:
        target: a .urdf file, the name of a scenario that ships, a .toml file, a run.nc; or what has been loaded.
        changes: to a scenario, by dotted keys, as in `load_scenario`.

    Returns:
        Errors, warnings and tables by its kind; `raise_errors` turns the errors into an exception.

    Raises:
        SofthandError: it cannot be read, or the scenario cannot be run.
    """
    if isinstance(target, str | Path):
        ending = Path(target).suffix.lower()
        if ending not in (".urdf", ".nc"):
            return check_scenario(load_scenario(str(target), changes))
        target = Recording.load(Path(target)) if ending == ".nc" else Path(target)
    elif isinstance(target, Scenario):
        return check_scenario(target.with_values(dict(changes or {})))
    if changes:
        raise ScenarioError(
            f"changes are for a scenario, and this is a {'URDF' if isinstance(target, Path) else 'recording'}.",
            key="set", value=changes,
        )  # fmt: skip
    return check_urdf(target) if isinstance(target, Path) else check_recording(target)
