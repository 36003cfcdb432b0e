"""Files that may be anything: only regular ones are read, no more of them than is asked for."""

from __future__ import annotations

import os
import stat
from pathlib import Path


def read_regular(file: Path, most: int) -> bytes:
    """The content of a regular file; that of a file of /proc, whose size is told as 0, is empty.

    Args:
        file: to read.
        most: bytes that such a file has at most.

    Raises:
        OSError: it cannot be opened or read.
        ValueError: it is not regular or too long; a phrase such as "is a directory".
    """
    if "\0" in os.fspath(file):
        raise ValueError("has a null character in its name")
    if os.path.isdir(file):
        raise ValueError("is a directory")
    with open(file, "rb", opener=_open) as stream:
        status = os.fstat(stream.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise ValueError("is no regular file but a pipe or a device")
        if status.st_size > most:
            raise ValueError(f"is longer than {most} bytes")
        return stream.read(status.st_size)


def _open(path: str, flags: int) -> int:
    """Open without waiting for a writer at the other end of a pipe."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
