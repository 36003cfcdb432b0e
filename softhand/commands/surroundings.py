"""What the machine must give a command: a current folder that is there, and memory."""

from __future__ import annotations

import os

from softhand.errors import SofthandError

_LEAST = 1_000_000_000  # bytes; with less, OpenBLAS tries for ever to get its buffers while it is loaded


def check_surroundings() -> None:
    """Refuse what a command could not run in.

    Raises:
        SofthandError: the current folder is gone, or memory is limited to less than a command needs.
    """
    try:
        os.getcwd()
    except OSError as error:
        raise SofthandError(f"the current folder cannot be used: {error.strerror}; go to another one.") from error
    limit = _memory_limit()
    if limit is not None and limit < _LEAST:
        raise SofthandError(
            f"memory is limited to {limit / 1e6:.0f} MB (ulimit -v); softhand needs {_LEAST / 1e6:.0f} MB.", value=limit
        )


def explain(error: Exception) -> str:
    """An error of the machine in words: of its memory, its disks, its libraries."""
    if isinstance(error, MemoryError):
        return f"memory is used up{f' ({error})' if str(error) else ''}; give the command more of it (ulimit -v)."
    if isinstance(error, ImportError):
        return f"a part of softhand cannot be loaded: {error}; is there too little memory, or the installation damaged?"
    return f"{error}; is the disk full, or a file not yours?"


def _memory_limit() -> int | None:
    """Bytes of address space that the process may have, if that is limited."""
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return None
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return None if limit == resource.RLIM_INFINITY else limit
