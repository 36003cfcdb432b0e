"""softhand reproduce: the paper's simulation figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from softhand.commands.app import command
from softhand.commands.console import Printer, progress, say_compiling
from softhand.commands.options import Json, OutFolder, Quiet
from softhand.commands.places import check_folder, make_folder, new_folder

if TYPE_CHECKING:
    from softhand.studies.reproduce import Case


@command("softhand reproduce --out paper")
def reproduce(out: OutFolder = None, as_json: Json = False, quiet: Quiet = False) -> None:
    """Make the paper's simulation figure anew.

    Targets A and B, with and without torsion compensation; writes minimum-jerk.png and step.png.
    """
    check_folder(out)
    say_compiling(quiet)
    from softhand.plots.style import save_figure
    from softhand.studies.reproduce import CAPTION, COLUMNS, RUNS, draw, reproduce

    printer = Printer(quiet, as_json)
    folder = out or new_folder("reproduce")
    make_folder(folder)
    with progress(f"reproducing {RUNS} runs", float(RUNS), quiet) as report:
        result = reproduce(report)
    for name, figure in draw(result).items():
        save_figure(figure, folder / f"{name}.png")
    printer.json([_entries(case) for case in result.cases])
    printer.table("", result.rows(), COLUMNS, CAPTION)
    printer.say(f"wrote minimum-jerk.png, step.png in {folder}/")


def _entries(case: Case) -> dict[str, Any]:
    errors = {name: getattr(case, name) for name in ("position", "orientation", "force")}
    return {
        "target": case.target,
        "reference": case.reference,
        "compensated": case.compensated,
        **{f"{name}_error": error.mean for name, error in errors.items()},
        **{f"{name}_swing": error.swing for name, error in errors.items()},
        "friction_use": case.friction_use,
        "outcome": case.outcome,
        "units": {
            f"{name}_{what}": unit
            for name, unit in (("position", "mm"), ("orientation", "deg"), ("force", "N"))
            for what in ("error", "swing")
        },
    }
