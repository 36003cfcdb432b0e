"""softhand workspace: the object poses that a hand can hold."""

from __future__ import annotations

import math
from typing import Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress, say_compiling
from softhand.commands.options import Json, Law, OutFigure, Plugins, Quiet, ScenarioName, Set
from softhand.commands.places import check_figure, figure_of, name_of
from softhand.commands.scenarios import chosen_scenario


@command("softhand workspace target-a --phi-max 80 --out reach.pdf")
def workspace(
    scenario: ScenarioName = "target-a",
    changes: Set = [],  # noqa: B006  typer copies it
    law: Law = None,
    phi_min: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="Least contact angle Phi [deg]; 0 is the rim of the tip, 1 if not given."),
    ] = None,
    phi_max: Annotated[
        float | None,
        typer.Option(
            metavar="DEG",
            help="Greatest contact angle Phi [deg]; 90 is the apex. 89, or 179 for laws without a pole.",
        ),
    ] = None,
    out: OutFigure = None,
    plugins: Plugins = [],  # noqa: B006
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find the object poses that can be held, beside the paper's.

    The contacts are kept, and the tips are taken as rigid.
    """
    check_figure(out)
    chosen = chosen_scenario(scenario, changes, law)
    say_compiling(quiet)
    from softhand.grasping.workspace import POSES
    from softhand.grasping.workspace import workspace as find_workspace
    from softhand.plots.style import save_figure
    from softhand.plots.workspace import draw_workspace

    printer = Printer(quiet, as_json)
    name = name_of(scenario)
    with progress(f"trying {POSES} poses", float(POSES), quiet) as report:
        least, most = (None if angle is None else math.radians(angle) for angle in (phi_min, phi_max))
        found = find_workspace(chosen, (least, most), report)
    target = figure_of(scenario, "workspace", out)
    save_figure(draw_workspace(found.poses, f"Poses that can be held, about the start of {name}"), target)
    printer.json(found)
    printer.table(f"{scenario}: moves of the object from the start", found.rows())
    printer.say(f"wrote {target}")
