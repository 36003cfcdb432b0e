"""The command `softhand`: its commands, and what becomes of errors.

What a command needs is imported when it runs, so that `--help` answers at once.
"""

from __future__ import annotations

import signal
import sys
import warnings
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import typer

from softhand.commands import (  # noqa: F401  each adds its command
    calibrate,
    check,
    compare,
    design,
    energy,
    equilibrium,
    export,
    film,
    gradient,
    grasp,
    grasps,
    hands,
    identify,
    lyapunov,
    material,
    names,
    new,
    plot,
    push,
    remark3,
    report,
    reproduce,
    schema,
    simulate,
    squeeze,
    stability,
    sweep,
    tune,
    validate,
    view,
    workspace,
)
from softhand.commands.app import app
from softhand.commands.console import say
from softhand.commands.streams import finish_output, give_up, prepare_streams
from softhand.commands.surroundings import check_surroundings, explain
from softhand.errors import SofthandError

INTERRUPTED = 130
UsageError: Any = typer.BadParameter.__mro__[1]  # typer has a name for this one child alone
_LONGEST = 2000  # letters of a line


def main() -> None:
    """Entry point: errors that a user can mend become one message and a nonzero exit code."""
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.default_int_handler)
    warnings.showwarning = _show_warning  # type: ignore[assignment]
    prepare_streams()
    try:
        check_surroundings()
        try:
            code = app(standalone_mode=False, prog_name="softhand")
        finally:
            finish_output()
        if code:
            sys.exit(code)
    except SofthandError as error:
        _say_error(str(error))
        sys.exit(INTERRUPTED if getattr(error, "reason", "") == "interrupted" else 1)
    except UsageError as error:
        _say_error(_with_help(error))
        sys.exit(error.exit_code)
    except (MemoryError, ImportError, OSError) as error:
        _say_error(explain(error))
        sys.exit(1)
    except (KeyboardInterrupt, SystemExit) as end:  # typer makes an exit with this code of Ctrl-C
        if isinstance(end, SystemExit) and end.code != INTERRUPTED:
            raise
        say("interrupted", error=True)
        sys.exit(INTERRUPTED)


def _with_help(error: Any) -> str:
    """What is wrong with a command line, and where to read how it is written."""
    text = " ".join(error.format_message().split())
    got = _given(getattr(getattr(error, "param", None), "opts", ()))
    text = f"{text.rstrip('.')} (got {got})." if got and repr(got) not in text else text
    text = text if text.endswith((".", "?")) else f"{text}."
    path = error.ctx.command_path if error.ctx else "softhand"
    return f"{text} See: {path} --help"


def _given(options: Sequence[str]) -> str:
    """What stands behind one of these options on the command line."""
    for word, following in pairwise([*sys.argv, ""]):
        name, sign, value = word.partition("=")
        if name in options:
            return value if sign else following
    return ""


def _cut(line: str) -> str:
    """A line of an error at a length that can be read: names in files of strangers are as long as they like."""
    return line if len(line) <= _LONGEST else f"{line[:_LONGEST]} ... ({len(line)} letters)"


def _say_error(text: str) -> None:
    try:
        say("\n".join(map(_cut, text.splitlines())), "error", error=True)
    except OSError:  # nobody can be told; the exit code says it
        give_up(sys.stderr)


def _show_warning(message: Warning | str, category: type[Warning], *place: Any) -> None:
    """Warnings in plain words, without the line of code that they come from."""
    say(str(message), "note", error=True)
