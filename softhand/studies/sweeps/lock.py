"""One driver at a time for a folder."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from softhand.errors import StudyError

try:
    import fcntl
except ImportError:  # pragma: no cover
    fcntl = None  # type: ignore[assignment]  # where there is none, nobody is kept out


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Inside this context the folder is this process's alone; the system gives it back however the process ends.

    Raises:
        StudyError: another process has it; says which.
    """
    file = folder / "lock"
    with open(file, "a+") as lock:
        try:
            if fcntl is not None:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            lock.seek(0)
            who = lock.read(200).strip() or "another process"
            raise StudyError(
                f"{folder}: {who} is at work in it; wait for it, or choose another folder with --out.", file=folder
            ) from error
        except OSError:  # a file system without locks
            pass
        lock.truncate(0)
        lock.write(f"process {os.getpid()} on {socket.gethostname()}")
        lock.flush()
        yield
