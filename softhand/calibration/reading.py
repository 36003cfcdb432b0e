"""Log files by their ending: recordings of softhand, MCAP logs of them, and CSV."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

from softhand.assembly.plant import read_world
from softhand.calibration.csv_log import Hand, read_csv_log
from softhand.calibration.log import Log
from softhand.calibration.recorded_log import log_of_recording
from softhand.errors import MeasurementError
from softhand.model.world import slides_of
from softhand.recording.recording import Recording, load_recording
from softhand.scenario.scenario import Scenario

_EXPORT = "softhand.export.writing"


def read_log(source: Recording | str | Path, scenario: Scenario) -> Log:
    """The log in a file or a recording.

    Raises:
        MeasurementError: its ending is another, or what it holds cannot be used.
        RecordingError: it is no recording.
        SofthandError: it is MCAP, and the extra `export` is not installed.
    """
    if isinstance(source, Recording):
        return log_of_recording(source, scenario)
    path = Path(source)
    recording = recording_of(path)
    if recording is not None:
        return log_of_recording(recording, scenario, str(path))
    if path.suffix.lower() not in (".csv", ".txt", ".tsv"):
        raise MeasurementError(
            f"{path}: a log ends in .nc, .mcap or .csv; give one of these, or the folder of a run.",
            column="", value=str(path),
        )  # fmt: skip
    world = read_world(scenario)
    return read_csv_log(path, Hand(tuple(world.joint_names), slides_of(world).tolist(), scenario.hand.names))


def recording_of(path: Path) -> Recording | None:
    """The recording in a file or a folder; None if it ends otherwise.

    Raises:
        MeasurementError: there is nothing of that name.
    """
    if not path.exists():
        raise MeasurementError(
            f"{path}: no such file or folder; a log is run.nc, the folder of a run, an MCAP log of one, or CSV.",
            column="", value=str(path),
        )  # fmt: skip
    if path.suffix.lower() == ".mcap":
        found: Recording = import_module(_EXPORT).read_mcap(path)
        return found
    return load_recording(path) if path.suffix.lower() == ".nc" or path.is_dir() else None
