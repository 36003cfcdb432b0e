"""What commands print: results, notes, tables, JSON, and how far they are."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import sys
import time
import unicodedata
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import typer

from softhand.commands.layout import lay_out
from softhand.numerics.waiting import tell_of_compiling

if TYPE_CHECKING:
    from softhand.recording.events import Event
    from softhand.recording.recording import Recording

_STYLES: dict[str, dict[str, Any]] = {
    "error": {"fg": typer.colors.RED, "bold": True},
    "warning": {"fg": typer.colors.YELLOW},
    "note": {"fg": typer.colors.YELLOW},
}


def visible(text: object) -> str:
    r"""Text of anybody for the console: what a terminal would obey or hide is shown as \x1b and the like."""
    return "".join(map(_visible, str(text)))


def _visible(letter: str) -> str:
    is_hidden = unicodedata.category(letter) in ("Cc", "Cf", "Cs") and letter not in "\n\t"
    return letter.encode("unicode_escape").decode() if is_hidden else letter


def _styled(text: str, **style: Any) -> str:
    return text if os.environ.get("NO_COLOR") else typer.style(text, **style)


def say(text: str, mark: str = "", error: bool = False) -> None:
    """Print a line, whatever is in it.

    Args:
        text: of anybody; it is not broken, so that a path in it can be copied.
        mark: `error`, `warning` or `note`, put before it.
        error: print it where no results are printed.
    """
    before = f"{_styled(f'{mark}:', **_STYLES[mark])} " if mark else ""
    typer.echo(before + visible(text), err=error)


def print_table(title: str, rows: Sequence[Sequence[str]], header: Sequence[str] = (), caption: str = "") -> None:
    """Rows of texts below a title, which is often a path and stays on one line."""
    width = shutil.get_terminal_size().columns
    shown = [[visible(cell) for cell in row] for row in rows]
    if title:
        typer.echo(_styled(visible(title), bold=True))
    lines = lay_out(shown, [visible(name) for name in header], width)
    if caption:
        lines += ["", *lay_out([[visible(caption)]], (), min(width, 100))]
    typer.echo("\n".join(["", *lines, ""] if title else [*lines, ""]))


@dataclass(frozen=True)
class Printer:
    """What a command prints of its results, as --quiet and --json ask for it."""

    quiet: bool = False
    as_json: bool = False

    def table(self, title: str, rows: Sequence[Sequence[str]], header: Sequence[str] = (), caption: str = "") -> None:
        """A table, which --json replaces."""
        if not (self.quiet or self.as_json):
            print_table(title, rows, header, caption)

    def say(self, text: str, mark: str = "") -> None:
        """A line; beside JSON it goes where no results are printed."""
        if not self.quiet:
            say(text, mark, error=self.as_json)

    def json(self, value: Any) -> None:
        """The result, if it is asked for as JSON: records, numbers, texts, and mappings and sequences of them."""
        if self.as_json:
            from softhand.numerics.record import plain

            text = json.dumps(plain(value), allow_nan=False, ensure_ascii=False, indent=2)
            typer.echo(_INNERMOST.sub(lambda found: f"[{_BREAK.sub(' ', found[1])}]", text))

    def incomplete(self, *recordings: Recording) -> None:
        """Say of each recording that ended early how far it goes."""
        for run in recordings:
            if not run.complete:
                self.say(f"incomplete recording, goes to {run.stop_time:g} s: {run.reason}", "note")

    def events(self, events: Sequence[Event]) -> None:
        """A line an event, the first of many."""
        rows = [(f"{event.time:.4g} s", event.kind, event.finger, event.text) for event in events[:_MOST_EVENTS]]
        if rows:
            self.table("events", rows)
        if len(events) > _MOST_EVENTS and not self.as_json:
            self.say(f"and {len(events) - _MOST_EVENTS} more; all are in run.nc")


_MOST_EVENTS = 12
_INNERMOST = re.compile(r"\[\n\s+([^\[\]{}]*?)\n\s+\]")  # a list of numbers: on one line; in texts no line is broken
_BREAK = re.compile(r"\n\s+")


def say_compiling(quiet: bool) -> None:
    """Say so if kernels have to be compiled for more than two seconds."""
    words = "Compiling kernels for this kind of hand, object and law, once ..."
    tell_of_compiling(None if quiet else lambda: say(words, error=True))


@contextmanager
def progress(what: str, total: float, quiet: bool) -> Iterator[Callable[[float], None]]:
    """Say at once what begins, and then how far it is: a bar, or lines where nobody looks at a terminal.

    Yields:
        Function that takes what is done of `total`.
    """
    if quiet:
        yield lambda done: None
    elif sys.stderr.isatty():
        yield from _bar(what, total)
    else:
        say(f"{what} ...", error=True)
        yield _Lines(what, total)


def _bar(what: str, total: float) -> Iterator[Callable[[float], None]]:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:  # gone before an error is told
        task = bar.add_task(visible(what), total=total)
        yield lambda done: bar.update(task, completed=done)


class _Lines:
    """How far something is, on a line now and then."""

    every = 30.0  # [s]

    def __init__(self, what: str, total: float) -> None:
        self._what, self._total = what, total
        self._begun = self._told = time.monotonic()

    def __call__(self, done: float) -> None:
        now = time.monotonic()
        if now - self._told >= self.every:
            self._told = now
            rest = (now - self._begun) * (self._total / done - 1.0) if done > 0.0 else math.inf
            left = f", {_duration(rest)} left" if 0.0 < rest < math.inf else ""
            say(f"{self._what}: {100.0 * done / self._total:.0f} %{left}", error=True)


def _duration(seconds: float) -> str:
    """A time in the unit in which it is a small number."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
