"""The recordings that commands draw and compute with: found, loaded, refused where their numbers cannot be used."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from softhand.recording.recording import Recording


def is_run(target: str | Path) -> bool:
    """Whether this is a recording, or the folder of one, rather than a scenario."""
    path = Path(target)
    return path.suffix.lower() == ".nc" or (path / "run.nc").is_file()


def run_file(target: str | Path) -> Path:
    """The file of a recording that is named by itself or by its folder."""
    path = Path(target)
    return path / "run.nc" if path.is_dir() else path


def load_run(target: str | Path) -> Recording:
    """The recording in a file, or in the folder of a run.

    Raises:
        RecordingError: it cannot be read, or its numbers cannot be used.
    """
    from softhand.recording.recording import load_recording
    from softhand.recording.sound import require_sound

    return require_sound(load_recording(target), target)
