"""The lines of a text file from anywhere: a regular file, of bounded size, in UTF-8."""

from __future__ import annotations

import re
from pathlib import Path

from softhand.errors import MeasurementError
from softhand.files import read_regular

MOST_BYTES = 16_000_000
LONGEST_LINE = 10_000  # [characters]; a row of measurements has a hundred
_BREAK = re.compile("\r\n|\n|\r")  # str.splitlines takes more, such as form feeds


def read_lines(file: Path) -> list[str]:
    """The lines of a file.

    Raises:
        MeasurementError: it cannot be opened, is a pipe or a device, is too large, or is no text.
    """
    try:
        content = read_regular(file, MOST_BYTES)
    except OSError as error:
        raise _refused(file, error.strerror or str(error)) from error
    except ValueError as error:
        raise _refused(
            file, f"it {error}; write the measurements, means of them if they are many, into a file"
        ) from error
    try:
        lines = _BREAK.split(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise _refused(file, "it is not UTF-8 text; save it as CSV in UTF-8") from error
    for number, line in enumerate(lines, start=1):
        if len(line) > LONGEST_LINE or "\0" in line:
            what = "has zero bytes" if "\0" in line else f"is {len(line)} characters long"
            raise _refused(file, f"line {number} {what}, which no row of measurements does; give a CSV file")
    return lines


def _refused(file: Path, why: str) -> MeasurementError:
    return MeasurementError(f"{file}: cannot be read: {why}.", column="", value=str(file))
