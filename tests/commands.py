"""The command line as its user sees it, in this process: what is printed, what is said of errors, the exit code."""

from __future__ import annotations

import io
import os
import signal
import sys
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

from softhand.commands.main import main
from softhand.simulation.interrupts import SIGNALS


@dataclass(frozen=True)
class Outcome:
    """How a command ended."""

    returncode: int
    stdout: str
    stderr: str

    @property
    def errors(self) -> str:
        """What is said of mistakes, without the lines that say what begins."""
        return "".join(line for line in self.stderr.splitlines(keepends=True) if not line.endswith(" ...\n"))


def run_command(*arguments: str, folder: Path, width: int = 300) -> Outcome:
    """`softhand ARGUMENTS` from a folder, on a console so many letters wide."""
    before = sys.argv, Path.cwd(), os.environ.get("COLUMNS")
    handlers = {number: signal.getsignal(number) for number in SIGNALS}
    out, errors, code = io.StringIO(), io.StringIO(), 0
    sys.argv, os.environ["COLUMNS"] = ["softhand", *arguments], str(width)
    os.chdir(folder)
    try:
        with redirect_stdout(out), redirect_stderr(errors):
            main()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 0 if end.code is None else 1
    finally:
        sys.argv = before[0]
        os.chdir(before[1])
        os.environ.pop("COLUMNS")
        if before[2] is not None:
            os.environ["COLUMNS"] = before[2]
        for number, handler in handlers.items():
            signal.signal(number, handler)
    return Outcome(code, out.getvalue(), errors.getvalue())
