"""softhand compare: laws and controllers side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import (
    Out,
    Plugins,
    Quiet,
    Set,
    check_folder,
    console,
    make_folder,
    new_folder,
    plain,
    progress,
    say,
    say_compiling,
    write_text,
)

if TYPE_CHECKING:
    from softhand.studies.compare import Row

_NAMES = "NAME,NAME,..."


@app.command(epilog='Example: softhand compare target-b --controller "regulation,blind(K_p=400)" --jobs 2')
def compare(
    scenario: Annotated[
        str, typer.Argument(help="A scenario that ships (see: softhand list) or a .toml file.")
    ] = "target-a",
    law: Annotated[
        list[str],
        typer.Option(metavar=_NAMES, help="Fingertip laws, settings in brackets."),
    ] = [],  # noqa: B006  typer copies it
    controller: Annotated[
        list[str],
        typer.Option(metavar=_NAMES, help="Controllers, settings in brackets."),
    ] = [],  # noqa: B006
    changes: Set = [],  # noqa: B006
    duration: Annotated[float | None, typer.Option(help=r"Simulated time \[s].")] = None,
    out: Out = None,
    jobs: Annotated[int, typer.Option(min=1, max=256, help="Processes to run in.")] = 1,
    plugins: Plugins = [],  # noqa: B006
    quiet: Quiet = False,
) -> None:
    """Run every law with every controller; prints a table, writes comparison.png and comparison.csv.

    What is not named is that of the scenario. Where neither is, the paper's line of work is run: controllers under the
    law of the scenario, then other laws under its controller.
    """
    check_folder(out)
    say_compiling(quiet)
    from softhand.errors import SimulationStopped
    from softhand.plots.style import save_figure
    from softhand.scenario.file import parse_override
    from softhand.scenario.scenario import load_scenario
    from softhand.simulation.interrupts import interrupts_held
    from softhand.studies.compare import compare as run
    from softhand.studies.compare import draw, pairs, split_choices, to_csv

    values = dict(parse_override(change) for change in changes)
    if duration is not None:
        values["duration"] = duration
    task = load_scenario(scenario, values)
    laws = [name for text in law for name in split_choices(text)]
    controllers = [name for text in controller for name in split_choices(text)]
    folder = out or new_folder(f"compare-{Path(scenario).stem}")
    is_new = not folder.exists()
    make_folder(folder)
    title = task.description or "softhand comparison"

    def save(rows: list[Row]) -> None:
        with interrupts_held():
            write_text(folder / "comparison.csv", to_csv(rows))
            save_figure(draw(rows, title), folder / "comparison.png")

    try:
        with progress("comparing", float(len(pairs(task, laws, controllers))), quiet) as report:
            rows = run(task, laws, controllers, report, jobs)
    except SimulationStopped as stop:
        if stop.rows:
            save(stop.rows)
            stop.say_more(f" They are in {folder}/.")
        elif is_new:
            folder.rmdir()
        raise
    save(rows)
    if not quiet:
        _print_rows(rows)
        say(f"wrote comparison.png, comparison.csv in {folder}/")
    if not any(row.performance for row in rows):
        raise typer.Exit(1)


def _print_rows(rows: list[Row]) -> None:
    from rich.table import Table

    from softhand.studies.compare import CAPTION, headings, labels

    table = Table(box=None, padding=(0, 1, 0, 0), caption=f"\n{CAPTION}", caption_justify="left", caption_style="dim")
    table.add_column("run", overflow="fold", min_width=18)
    for name in headings(rows):
        table.add_column(plain(name), justify="right", no_wrap=True)
    names = labels(rows)
    for name, row in zip(names, rows, strict=True):
        table.add_row(plain(name), *map(plain, row.cells()))
    console().print(table)
    for name, row in zip(names, rows, strict=True):
        if row.outcome:
            say(f"{name}: {row.outcome}", "note")
