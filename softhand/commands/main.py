"""The command `softhand`: its commands, and what becomes of errors.

What a command needs is imported when it runs, so that `--help` answers at once.
"""

from __future__ import annotations

import signal
import sys
import warnings
from typing import Any

from softhand.commands import (  # noqa: F401  each adds its command
    check,
    compare,
    energy,
    export,
    film,
    grasp,
    hands,
    identify,
    lyapunov,
    names,
    plot,
    remark3,
    report,
    reproduce,
    schema,
    simulate,
    stability,
    validate,
    view,
    workspace,
)
from softhand.commands.app import app
from softhand.commands.console import error_console, escape
from softhand.errors import SofthandError

INTERRUPTED = 130


def main() -> None:
    """Entry point: errors that a user can mend become one message and a nonzero exit code."""
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.default_int_handler)
    warnings.showwarning = _show_warning  # type: ignore[assignment]
    try:
        app()
    except SofthandError as error:
        error_console().print(f"[bold red]error:[/] {escape(str(error))}", highlight=False, soft_wrap=True)
        sys.exit(INTERRUPTED if getattr(error, "reason", "") == "interrupted" else 1)
    except (KeyboardInterrupt, SystemExit) as end:  # typer makes an exit with this code of Ctrl-C
        if isinstance(end, SystemExit) and end.code != INTERRUPTED:
            raise
        error_console().print("interrupted", highlight=False)
        sys.exit(INTERRUPTED)


def _show_warning(message: Warning | str, category: type[Warning], *place: Any) -> None:
    """Warnings in plain words, without the line of code that they come from."""
    error_console().print(f"[yellow]note:[/] {escape(str(message))}", highlight=False, soft_wrap=True)
