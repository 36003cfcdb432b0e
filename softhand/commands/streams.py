"""The streams of the process whatever they are: closed, full, of an encoding without Greek letters."""

from __future__ import annotations

import os
import sys
from typing import Any

from softhand.errors import SofthandError


def prepare_streams() -> None:
    """Let every text be printed: letters that a console does not know as a question mark, nothing if it is closed."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # closed by the shell, `2>&-`
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115  for as long as the process
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")


def finish_output() -> None:
    """Write what is held back of the output.

    Raises:
        SofthandError: it cannot be written.
    """
    try:
        sys.stdout.flush()
    except OSError as error:
        give_up(sys.stdout)
        raise SofthandError(f"standard output cannot be written: {error.strerror}; send it elsewhere.") from error


def give_up(stream: Any) -> None:
    """Let what is still held back go nowhere, so that Python does not fail on it at its end."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
