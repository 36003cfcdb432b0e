"""softhand reproduce: the paper's simulation figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from softhand.commands.app import app
from softhand.commands.console import (
    Out,
    Quiet,
    check_folder,
    console,
    make_folder,
    new_folder,
    plain,
    progress,
    say,
    say_compiling,
)

if TYPE_CHECKING:
    from softhand.studies.reproduce import Reproduction


@app.command(epilog="Example: softhand reproduce --out paper")
def reproduce(out: Out = None, quiet: Quiet = False) -> None:
    """Make the paper's simulation figure anew: targets A and B, with and without torsion compensation."""
    check_folder(out)
    say_compiling(quiet)
    from softhand.plots.style import save_figure
    from softhand.studies.reproduce import RUNS, draw, reproduce

    folder = out or new_folder("reproduce")
    make_folder(folder)
    with progress("reproducing", float(RUNS), quiet) as report:
        result = reproduce(report)
    for name, figure in draw(result).items():
        save_figure(figure, folder / f"{name}.png")
    if not quiet:
        _print_reproduction(result)
        say(f"wrote {folder}/minimum-jerk.png, step.png")


def _print_reproduction(result: Reproduction) -> None:
    from rich import box
    from rich.table import Table

    from softhand.studies.reproduce import CAPTION, COLUMNS

    table = Table(box=box.SIMPLE_HEAD, caption=CAPTION, caption_justify="left", caption_style="dim")
    for name in COLUMNS:
        table.add_column(plain(name), no_wrap=name != COLUMNS[-1])
    for row in result.rows():
        table.add_row(*map(plain, row), style="" if any(row[1:]) else "bold")
    console().print(table)
