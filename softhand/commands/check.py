"""softhand check: is a URDF, a scenario or a recording sound?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, say_compiling
from softhand.commands.options import Controller, Json, Law, Plugins, Quiet, Set, Stepper, complete_scenarios
from softhand.commands.runs import is_run, run_file
from softhand.commands.scenarios import chosen_scenario, refuse_changes


@command("softhand check my_hand.urdf; softhand check my.toml --set stepper.name=rk4; softhand check runs/target-a")
def check(
    target: Annotated[
        str,
        typer.Argument(
            metavar="TARGET",
            autocompletion=complete_scenarios,
            help="A .urdf file, a scenario that ships, a .toml file, a run.nc or its folder.",
        ),
    ],
    changes: Set = [],  # noqa: B006  typer copies it
    law: Law = None,
    controller: Controller = None,
    stepper: Stepper = None,
    plugins: Plugins = [],  # noqa: B006
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say what is wrong or doubtful in a URDF, a scenario or a run.

    Exit code 1 if it cannot be used.

    A scenario is explained: every value with its unit, the start, and what to think of it. A recording is searched for
    what is missing, not a number, uneven or beyond friction.
    """
    printer = Printer(quiet, as_json)
    is_urdf, of_run = Path(target).suffix.lower() == ".urdf", is_run(target)
    if is_urdf or of_run:
        refuse_changes(target, set=changes, law=law, controller=controller, stepper=stepper)
        asked: object = run_file(target) if of_run else target
    else:
        asked = chosen_scenario(target, changes, law, controller, stepper)
    say_compiling(quiet or is_urdf)
    from softhand.checks.check import check as find_faults

    found = find_faults(asked)  # type: ignore[arg-type]
    printer.json(found)
    for title, rows in found.tables(target):
        printer.table(title, rows)
    about = f"{target}: " if of_run else ""
    for warning in found.warnings:
        printer.say(about + warning, "warning")
    found.raise_errors(target)
    count = len(found.warnings)
    printer.say(f"{target}: no errors, {count} warning{'' if count == 1 else 's'}")
