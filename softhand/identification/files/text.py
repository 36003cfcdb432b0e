"""The lines of a text file from anywhere: a regular file, of bounded size, in UTF-8."""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path

from softhand.errors import MeasurementError

MOST_BYTES = 16_000_000
LONGEST_LINE = 10_000  # [characters]; a row of measurements has a hundred
_BREAK = re.compile("\r\n|\n|\r")  # str.splitlines takes more, such as form feeds


def read_lines(file: Path) -> list[str]:
    """The lines of a file.

    Raises:
        MeasurementError: it cannot be opened, is a pipe or a device, is too large, or is no text.
    """
    try:
        with open(file, "rb", opener=_open) as source:
            if not stat.S_ISREG(os.fstat(source.fileno()).st_mode):
                raise _refused(file, "it is a pipe or a device; write the measurements into a file")
            content = source.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        raise _refused(file, getattr(error, "strerror", None) or str(error)) from error
    if len(content) > MOST_BYTES:
        raise _refused(file, f"it is larger than {MOST_BYTES / 1e6:g} MB; take means, or every tenth row")
    try:
        lines = _BREAK.split(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise _refused(file, "it is not UTF-8 text; save it as CSV in UTF-8") from error
    for number, line in enumerate(lines, start=1):
        if len(line) > LONGEST_LINE or "\0" in line:
            what = "has zero bytes" if "\0" in line else f"is {len(line)} characters long"
            raise _refused(file, f"line {number} {what}, which no row of measurements does; give a CSV file")
    return lines


def _open(path: str, flags: int) -> int:
    """Open without waiting for a writer at the other end of a pipe."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _refused(file: Path, why: str) -> MeasurementError:
    return MeasurementError(f"{file}: cannot be read: {why}.", column="", value=str(file))
