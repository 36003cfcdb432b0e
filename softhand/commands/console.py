"""What commands share: printing, progress, folders, options."""

from __future__ import annotations

import itertools
import os
import unicodedata
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from softhand.errors import SofthandError
from softhand.numerics.waiting import tell_of_compiling

if TYPE_CHECKING:
    from softhand.recording.events import Event
    from softhand.recording.recording import Recording
    from softhand.simulation.simulation import Progress

Set = Annotated[
    list[str],
    typer.Option("--set", metavar="KEY=VALUE", help="Change a value of the scenario, in TOML; may be repeated."),
]
Out = Annotated[Path | None, typer.Option(help="Folder for the results; by default a new one below runs/.")]


def _load_plugins(files: Any) -> Any:  # on Python 3.10 typer takes list[Path] for a class
    if files:
        from softhand.plugins import load_plugin_files

        load_plugin_files(files)
    return files


Plugins = Annotated[
    list[Path],
    typer.Option(
        "--plugin",
        metavar="FILE.py",
        callback=_load_plugins,
        help="Python file with laws, dampings, controllers or steppers of your own, by their names in small letters "
        "with hyphens; it is run. May be repeated.",
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]


_STYLES = {"error": "bold red", "warning": "yellow", "note": "yellow"}


def console(error: bool = False) -> Any:
    """Where results are printed, or where everything else is. No text has a meaning to it: no markup, no emoji."""
    from rich.console import Console

    return Console(stderr=error, markup=False, emoji=False, highlight=False)


def plain(text: object) -> Any:
    r"""Text of anybody for the console: what a terminal would obey or hide is shown as \x1b and the like."""
    from rich.text import Text

    return Text("".join(map(_visible, str(text))))


def _visible(letter: str) -> str:
    is_hidden = unicodedata.category(letter) in ("Cc", "Cf", "Cs") and letter not in "\n\t"
    return letter.encode("unicode_escape").decode() if is_hidden else letter


def say(text: str, mark: str = "", error: bool = False) -> None:
    """Print a line, whatever is in it.

    Args:
        text: of anybody; it is not broken, so that a path in it can be copied.
        mark: `error`, `warning` or `note`, put before it.
        error: print it where no results are printed.
    """
    from rich.text import Text

    line = Text.assemble((f"{mark}:", _STYLES[mark]), " ", plain(text)) if mark else plain(text)
    console(error).print(line, soft_wrap=True)


def say_compiling(quiet: bool) -> None:
    """Say so if kernels have to be compiled for more than two seconds."""
    if not quiet:
        tell_of_compiling(lambda: say("Compiling kernels for this kind of hand, object and law, once ...", error=True))


def note_incomplete(*recordings: Recording) -> None:
    """Say of each recording that ended early how far it goes."""
    for run in recordings:
        if not run.complete:
            say(f"incomplete recording, goes to {run.stop_time:g} s: {run.reason}", "note")


@contextmanager
def progress(what: str, total: float, quiet: bool) -> Iterator[Progress | None]:
    """A bar, by a function that takes what is done of `total`; None if quiet."""
    if quiet:
        yield None
        return
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    bar = Progress(*columns, console=console(error=True), transient=True)
    task = bar.add_task(what, total=total)

    def report(done: float) -> None:
        bar.start()  # not before there is something to tell: an error of the first steps stands alone
        bar.update(task, completed=done)

    try:
        yield report
    finally:
        if bar.live.is_started:
            bar.stop()


_WORD = 20  # letters of a label that stay on one line in a narrow console


def print_table(title: str, rows: Sequence[tuple[str, ...]]) -> None:
    """Rows of texts below a title, which is often a path and stays on one line."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, show_header=False)
    for k in range(len(rows[0]) if rows else 0):
        longest = max(len(word) for row in rows for word in row[k].split() or [""])
        table.add_column(overflow="fold", min_width=min(longest, _WORD) if k == 0 else None)
    for row in rows:
        table.add_row(*map(plain, row))
    console().print(plain(title), style="bold", soft_wrap=True)
    console().print(table)


_MOST_EVENTS = 12


def print_events(events: list[Event]) -> None:
    """A line an event, the first of many."""
    if not events:
        return
    rows = [(f"{event.time:.4g} s", event.kind, event.finger, event.text) for event in events[:_MOST_EVENTS]]
    print_table("events", rows)
    if len(events) > _MOST_EVENTS:
        say(f"and {len(events) - _MOST_EVENTS} more; all are in run.nc")


def new_folder(name: str) -> Path:
    """runs/NAME, or the first of runs/NAME-2, runs/NAME-3, ... that is not there; made, so that nobody else takes it.

    Raises:
        SofthandError: it cannot be made.
    """
    make_folder(Path("runs"))
    for count in itertools.count(1):
        folder = Path("runs") / (name if count == 1 else f"{name}-{count}")
        try:
            folder.mkdir()
        except FileExistsError:
            continue
        except OSError as error:
            raise SofthandError(
                f"{folder}: cannot make this folder: {error.strerror}; choose one with --out."
            ) from error
        return folder
    raise AssertionError


def check_figure(file: Path) -> None:
    """Refuse, before the work, the name of a figure that could not be written after it."""
    from softhand.plots.style import figure_format

    figure_format(file)
    check_file(file)


def figure_beside(recording: Path, name: str, out: Path | None) -> Path:
    """The figure to write: that of --out, or one beside the recording; refused as by `check_figure`."""
    target = out or recording.parent / name
    if out is not None or recording.exists():  # one that is missing is told when it is read
        check_figure(target)
    return target


def check_file(file: Path) -> None:
    """Refuse, before the work, a file that could not be written after it."""
    from softhand.recording.whole_file import check_place

    if not file.absolute().parent.is_dir():
        raise SofthandError(f"{file}: there is no folder {file.parent}; make it or choose another with --out.")
    check_place(file)


def check_folder(out: Path | None) -> None:
    """Refuse, before the work, a folder of results that could not be made or written to; runs/ if not given."""
    folder = out or Path("runs")
    try:
        there = next(place for place in (folder.absolute(), *folder.absolute().parents) if place.exists())
        why = "" if there.is_dir() else f"{there} is no folder"
        why = why or ("" if os.access(there, os.W_OK | os.X_OK) else f"nothing can be written into {there}")
    except OSError as error:
        why = error.strerror or str(error)
    if why:
        raise SofthandError(f"{folder}: cannot make this folder: {why}; choose another with --out.")


def make_folder(folder: Path) -> None:
    """Make a folder with its parents; SofthandError if that cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SofthandError(
            f"{folder}: cannot make this folder: {error.strerror}; choose another with --out."
        ) from error


def remove_old(folder: Path, *names: str) -> None:
    """Remove results of an older run, beside which those of a new one would be taken for theirs.

    Raises:
        SofthandError: one cannot be removed.
    """
    for name in names:
        try:
            (folder / name).unlink(missing_ok=True)
        except OSError as error:
            raise SofthandError(
                f"{folder / name}: cannot be replaced: {error.strerror}; choose another folder with --out."
            ) from error


def write_text(file: Path, text: str) -> None:
    """Write a text, whole or not at all; RecordingError if that cannot be."""
    from softhand.recording.whole_file import write_whole

    write_whole(file, lambda: text.encode())
