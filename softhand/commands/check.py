"""softhand check: is a URDF, a scenario or a recording sound?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Plugins, Quiet, Set, print_table, say, say_compiling
from softhand.errors import ScenarioError


@app.command(
    epilog="Example: softhand check my_hand.urdf; softhand check my.toml --set stepper.name=rk4; softhand check run.nc"
)
def check(
    target: Annotated[str, typer.Argument(help="A .urdf file, a scenario that ships, a .toml file, or a run.nc.")],
    changes: Set = [],  # noqa: B006  typer copies it
    plugins: Plugins = [],  # noqa: B006
    quiet: Quiet = False,
) -> None:
    """Say what is wrong or doubtful in a URDF, a scenario or a recording; exit code 1 if it cannot be used.

    A scenario is explained: every value with its unit, the start, and what to think of it. A recording is searched for
    what is missing, not a number, uneven or beyond friction.
    """
    ending = Path(target).suffix.lower()
    if changes and ending in (".urdf", ".nc"):
        raise ScenarioError(f"--set changes a scenario; {target} is none.", key="set", value=changes)
    from softhand.scenario.file import parse_override

    values = dict(parse_override(change) for change in changes)
    say_compiling(quiet or ending == ".urdf")
    from softhand.checks.check import check as find_faults

    found = find_faults(target, values)
    if not quiet:
        for title, rows in found.tables(target):
            print_table(title, rows)
        about = f"{target}: " if ending == ".nc" else ""
        for warning in found.warnings:
            say(about + warning, "warning")
    found.raise_errors(target)
    if not quiet:
        count = len(found.warnings)
        say(f"{target}: no errors, {count} warning{'' if count == 1 else 's'}")
