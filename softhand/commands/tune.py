"""softhand tune: numbers of a scenario turned until its runs cost less in many worlds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress, say_compiling
from softhand.commands.options import Json, OutFolder, Plugins, Quiet
from softhand.commands.places import check_folder, make_folder, name_of, new_folder, write_text

if TYPE_CHECKING:
    from softhand.tuning.record import Tuning


@command("softhand tune study.toml --out tuned")
def tune(
    study: Annotated[
        Path, typer.Argument(metavar="STUDY.toml", help="What is turned, what it costs, in which worlds.")
    ],
    threads: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, max=256, help="At work at the same time; as many as processors if not given."),
    ] = None,
    anyway: Annotated[
        bool, typer.Option("--anyway", help="Write what was found even if it is no better in other worlds.")
    ] = False,
    out: OutFolder = None,
    plugins: Plugins = [],  # noqa: B006  typer copies it
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Turn gains and other numbers until runs cost less.

    In many worlds at once, and judged in others that the search has not seen. Writes the scenario as tuned.toml, the
    figures of each world as tuning.csv, and tuning.png; nothing if it is no better there.
    """
    check_folder(out)
    say_compiling(quiet)
    from softhand.plots.style import save_figure
    from softhand.tuning.drawing import draw
    from softhand.tuning.tune import tune as run

    printer = Printer(quiet, as_json)
    with progress(f"tuning {study}", 1.0, quiet) as report:
        found = run(study, threads, report)
    _print(found, printer)
    if not (found.is_better or anyway):
        printer.say("nothing was written; --anyway writes what was found.")
        raise typer.Exit(1)
    folder = out or new_folder(f"tune-{name_of(str(study))}")
    make_folder(folder)
    write_text(folder / "tuned.toml", found.to_toml())
    write_text(folder / "tuning.csv", found.to_csv())
    save_figure(draw(found, f"Tuning of {found.before.description or study.stem}"), folder / "tuning.png")
    printer.say(f"wrote tuned.toml, tuning.csv, tuning.png in {folder}/")


def _print(found: Tuning, printer: Printer) -> None:
    printer.json(found)
    search, held_out = found.worlds
    printer.table(
        "", found.number_rows(), ("number", "unit", "before", "after", "bounds"),
    )  # fmt: skip
    printer.table(
        f"In {held_out} worlds that the search has not seen", found.rows(),
        ("", "before", "after", "change", "limit"),
        f"Searched by {found.method} in {search} worlds, {found.runs[0]} runs; judged in {held_out} others. Change: "
        "mean of after less before, world by world, and its interval of 95 %. Lost runs are in no mean. Astray: "
        "lost or not settled in a longer run.",
    )  # fmt: skip
    for reason in found.reasons:
        printer.say(f"no better than before: {reason}", "note")
