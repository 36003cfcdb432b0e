"""The recordings that commands draw and compute with: loaded, and refused where their numbers cannot be used."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from softhand.recording.recording import Recording


def load_run(file: Path) -> Recording:
    """The recording in a file, or in the folder of a run.

    Raises:
        RecordingError: it cannot be read, or its numbers cannot be used.
    """
    from softhand.recording.recording import load_recording
    from softhand.recording.sound import require_sound

    return require_sound(load_recording(file), file)
