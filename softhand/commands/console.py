"""What commands share: printing, progress, folders, options."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from softhand.errors import SofthandError

if TYPE_CHECKING:
    from softhand.simulation import Progress

Set = Annotated[
    list[str],
    typer.Option("--set", metavar="KEY=VALUE", help="Change a value of the scenario, in TOML; may be repeated."),
]
Out = Annotated[Path | None, typer.Option(help="Folder for the results; by default a new one below runs/.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]


def console() -> Any:
    """Where results are printed."""
    from rich.console import Console

    return Console()


def error_console() -> Any:
    """Where everything else is printed."""
    from rich.console import Console

    return Console(stderr=True)


def escape(text: str) -> str:
    """Text without meaning to rich."""
    from rich.markup import escape

    return escape(text)


def say_compiling(quiet: bool) -> None:
    """Warn of the wait for the first compilation."""
    from softhand.compiled import is_first_run

    if not quiet and is_first_run():
        error_console().print("First run: compiling the contact kernels, once, for some seconds ...", highlight=False)


@contextmanager
def progress(what: str, total: float, quiet: bool) -> Iterator[Progress | None]:
    """A bar, by a function that takes what is done of `total`; None if quiet."""
    if quiet:
        yield None
        return
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=error_console(), transient=True) as bar:
        task = bar.add_task(what, total=total)
        yield lambda done: bar.update(task, completed=done)


def print_table(title: str, rows: list[tuple[str, str]]) -> None:
    """Rows of name and text below a title."""
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, show_header=False)
    for row in rows:
        table.add_row(*map(escape, row))
    console().print(table)


def new_folder(name: str) -> Path:
    """runs/NAME, or the first of runs/NAME-2, runs/NAME-3, ... that is not there."""
    folder, count = Path("runs") / name, 2
    while folder.exists():
        folder, count = Path("runs") / f"{name}-{count}", count + 1
    return folder


def check_figure(file: Path) -> None:
    """Refuse, before the work, the name of a figure that could not be written after it."""
    from softhand.plots.style import figure_format

    figure_format(file)
    if not file.absolute().parent.is_dir():
        raise SofthandError(f"{file}: there is no folder {file.parent}; make it or choose another with --out.")


def make_folder(folder: Path) -> None:
    """Make a folder with its parents; SofthandError if that cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SofthandError(
            f"{folder}: cannot make this folder: {error.strerror}; choose another with --out."
        ) from error


def write_text(file: Path, text: str) -> None:
    """Write a text; SofthandError if that cannot be."""
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise SofthandError(
            f"{file}: cannot be written: {error.strerror}; choose another folder with --out."
        ) from error
