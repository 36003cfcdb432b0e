"""The formats that a recording can be written in beside its own."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from softhand.errors import SofthandError
from softhand.export.extras import module_with
from softhand.recording.recording import Recording
from softhand.recording.whole_file import check_place, fill_whole

FRAME_RATE = 30.0  # pictures a second; numbers go along at every sample
_BYTES = 40  # of a file, a number of the recording: far more than it takes, so that no disk is full half way
Progress = Callable[[float], None]


def write_mcap(
    recording: Recording,
    path: str | os.PathLike[str],
    rate: float = FRAME_RATE,
    picture: bool = True,
    progress: Progress = lambda done: None,
) -> None:
    """Write an MCAP log, whole or not at all: every number as it is, the scene in 3-D, events as messages of a log.

    Args:
        recording: an incomplete one goes along as far as it goes.
        path: file to write; an older one is replaced.
        rate: pictures a second.
        picture: whether the scene goes along; it needs most arrays.
        progress: is told what is done, 0 to 1.

    Raises:
        RecordingError: the recording lacks what a picture needs, or the file cannot be written.
        SofthandError: the packages of the extra `export` are missing, or the rate is not above 0.
    """
    _fill(recording, path, ("export", "softhand.export.mcap.file"), rate=rate, picture=picture, progress=progress)


def read_mcap(path: str | os.PathLike[str]) -> Recording:
    """The recording that `write_mcap` wrote, each number bit-equal.

    Raises:
        RecordingError: the file cannot be read, or softhand did not write it.
        SofthandError: the packages of the extra `export` are missing.
    """
    recording: Recording = module_with("export", "softhand.export.mcap.reading").read(Path(path))
    return recording


def write_rrd(
    recording: Recording,
    path: str | os.PathLike[str],
    rate: float = FRAME_RATE,
    picture: bool = True,
    progress: Progress = lambda done: None,
) -> None:
    """Write a recording of Rerun, with the same in it; the arguments and errors are those of `write_mcap`.

    The packages are those of the extra `rerun`.
    """
    _fill(recording, path, ("rerun", "softhand.export.rerun"), rate=rate, picture=picture, progress=progress)


def _fill(recording: Recording, path: str | os.PathLike[str], module: tuple[str, str], **options: Any) -> None:
    rate = options["rate"]
    if not 0.0 < rate <= 1e4:
        raise SofthandError(f"rate: {rate:g} is out of range; take pictures a second above 0, up to 10000.", value=rate)
    write = module_with(*module).write
    check_place(Path(path))
    numbers = sum(array.size for array in recording.variables.values())
    fill_whole(Path(path), lambda partial: write(recording, partial, **options), _BYTES * numbers)
