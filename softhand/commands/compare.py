"""softhand compare: laws and controllers side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress, say_compiling
from softhand.commands.options import Controllers, Duration, Json, Laws, OutFolder, Plugins, Quiet, ScenarioName, Set
from softhand.commands.options import Stepper as StepperName
from softhand.commands.places import check_folder, make_folder, name_of, new_folder, write_text
from softhand.commands.scenarios import chosen_scenario

if TYPE_CHECKING:
    from softhand.studies.compare import Row


@command('softhand compare target-b --controller "regulation,blind(K_p=400)" --jobs 2')
def compare(
    scenario: ScenarioName = "target-a",
    changes: Set = [],  # noqa: B006  typer copies it
    law: Laws = [],  # noqa: B006
    controller: Controllers = [],  # noqa: B006
    stepper: StepperName = None,
    duration: Duration = None,
    jobs: Annotated[int, typer.Option(metavar="N", min=1, max=256, help="Processes to run in.")] = 1,
    out: OutFolder = None,
    plugins: Plugins = [],  # noqa: B006
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run laws and controllers side by side: a table and a figure.

    Writes comparison.png and comparison.csv. What is not named is that of the scenario. Where neither is, the paper's
    line of work is run: controllers under the law of the scenario, then other laws under its controller.
    """
    check_folder(out)
    task = chosen_scenario(scenario, changes, stepper=stepper, more={"duration": duration})
    say_compiling(quiet)
    from softhand.errors import SimulationStopped
    from softhand.plots.style import save_figure
    from softhand.simulation.interrupts import interrupts_held
    from softhand.studies.compare import compare as run
    from softhand.studies.compare import draw, pairs, split_choices, to_csv

    printer = Printer(quiet, as_json)
    laws = [name for text in law for name in split_choices(text)]
    controllers = [name for text in controller for name in split_choices(text)]
    folder = out or new_folder(f"compare-{name_of(scenario)}")
    is_new = not folder.exists()
    make_folder(folder)
    title = task.description or "softhand comparison"

    def save(rows: list[Row]) -> None:
        with interrupts_held():
            write_text(folder / "comparison.csv", to_csv(rows))
            save_figure(draw(rows, title), folder / "comparison.png")

    count = len(pairs(task, laws, controllers))
    try:
        with progress(f"comparing {count} runs", float(count), quiet) as report:
            rows = run(task, laws, controllers, report, jobs)
    except SimulationStopped as stop:
        if stop.rows:
            save(stop.rows)
            stop.say_more(f" They are in {folder}/.")
        elif is_new:
            folder.rmdir()
        raise
    save(rows)
    _print_rows(rows, printer)
    printer.say(f"wrote comparison.png, comparison.csv in {folder}/")
    if not any(row.performance for row in rows):
        raise typer.Exit(1)


def _print_rows(rows: list[Row], printer: Printer) -> None:
    from softhand.studies.compare import CAPTION, headings, labels

    header, names = headings(rows), labels(rows)
    columns = [name.replace("\n", " ") for name in header]
    printer.json(
        [
            {"law": row.law, "controller": row.controller, **dict(zip(columns, row.numbers(), strict=True)),
             "outcome": row.outcome}
            for row in rows
        ]
    )  # fmt: skip
    cells = [(name, *row.cells()) for name, row in zip(names, rows, strict=True)]
    printer.table("", cells, ("run", *header), CAPTION)
    for name, row in zip(names, rows, strict=True):
        if row.outcome:
            printer.say(f"{name}: {row.outcome}", "note")
