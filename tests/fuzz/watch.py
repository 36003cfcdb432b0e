"""One input under watch: it is taken or refused in words; no traceback, no hang, no gigabyte, no NaN for a result."""

from __future__ import annotations

import re
import resource
import signal
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from commands import run_command

from softhand.errors import SofthandError

CPU, CLOCK = 10.0, 60.0  # [s] at most; the clock on the wall also counts what others do with the machine
MEMORY = 1_000_000  # kB
LONGEST = 6000  # letters of a refusal

_NOT_A_NUMBER = re.compile(r"(?<![\w.])[-+]?(?:nan|inf)(?![\w-])", re.IGNORECASE)


class Hang(BaseException):
    """The time is over."""


class Fault(Exception):
    """What must not be, in a line."""


def command(folder: Path, *arguments: str, echoes: bool = False) -> str:
    """Run a command; "taken" or "refused", and a Fault if it ends in another way.

    Args:
        folder: to run in.
        arguments: of `softhand`.
        echoes: whether the output repeats words of the input, among which NaN may be.
    """
    outcome = run_command(*arguments, folder=folder)
    if outcome.returncode == 0:
        found = None if echoes else _NOT_A_NUMBER.search(outcome.stdout)
        if found:
            raise Fault(f"NaN in a result: {outcome.stdout[max(0, found.start() - 120) : found.end() + 20]!r}")
        return "taken"
    if not re.search("error|Error|Usage", outcome.stderr):
        raise Fault(f"exit code {outcome.returncode} without a word: {outcome.stderr[-300:]!r}")
    if len(outcome.stderr) > LONGEST:
        raise Fault(f"an error of {len(outcome.stderr)} letters: {outcome.stderr[:300]!r}")
    return "refused"


def watched(try_input: Callable[[], str]) -> tuple[str, str]:
    """How an input ends: taken, refused, or traceback, hang, memory or fault with the details."""
    before = {number: signal.signal(number, _raise) for number in (signal.SIGPROF, signal.SIGALRM)}
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    signal.setitimer(signal.ITIMER_PROF, CPU)
    signal.setitimer(signal.ITIMER_REAL, CLOCK)
    try:
        ended = try_input(), ""
    except SofthandError as error:
        ended = "refused", str(error)
    except Fault as fault:
        ended = "fault", str(fault)
    except Hang:
        ended = "hang", traceback.format_exc()
    except (Exception, SystemExit):
        ended = "traceback", traceback.format_exc()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number, handler in before.items():
            signal.signal(number, handler)
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    if used - most > MEMORY and ended[0] in ("taken", "refused"):
        return "memory", f"{used // 1000} MB"
    return ended


def _raise(*_: Any) -> None:
    raise Hang
