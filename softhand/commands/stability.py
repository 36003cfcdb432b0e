"""softhand stability: how fast small motions grow about a start or the end of a run, and where K_O loses the object."""

from __future__ import annotations

from typing import Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress, say_compiling
from softhand.commands.options import Controller, Json, Law, OutFigure, Plugins, Quiet, Set, complete_scenarios
from softhand.commands.places import check_figure, figure_of, name_of
from softhand.commands.runs import is_run, load_run
from softhand.commands.scenarios import chosen_scenario, refuse_changes


@command(
    "softhand stability target-a --set controller.K_O_orientation=0.2 --out scan.pdf; softhand stability runs/hold"
)
def stability(
    scenario: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO",
            autocompletion=complete_scenarios,
            help="A scenario that ships (see: softhand list), a .toml file, or a run.nc or its folder.",
        ),
    ] = "target-a",
    changes: Set = [],  # noqa: B006  typer copies it
    law: Law = None,
    controller: Controller = None,
    out: OutFigure = None,
    plugins: Plugins = [],  # noqa: B006
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say how fast small motions grow, about a start or a run's end.

    With regulation the gain K_O is scanned against the stiffness of the tips, about the start of a scenario, and the
    scan is drawn.
    """
    of_run = is_run(scenario)
    if of_run:
        refuse_changes(scenario, set=changes, law=law, controller=controller)
    check_figure(out)
    printer = Printer(quiet, as_json)
    if of_run:
        say_compiling(quiet)
        from softhand.closed_loop.stability import stability as find_stability

        found = find_stability(load_run(scenario))
        printer.json(found)
        printer.table(scenario, found.rows())
        return
    chosen = chosen_scenario(scenario, changes, law, controller)
    say_compiling(quiet)
    from softhand.closed_loop.stability import stability as find_stability
    from softhand.plots.stability import draw_scan
    from softhand.plots.style import save_figure

    with progress(f"linearising {scenario}", 1.0, quiet) as report:
        found = find_stability(chosen, progress=report)
    printer.json(found)
    printer.table(scenario, found.rows())
    if found.scan is not None:
        target = figure_of(scenario, "stability", out)
        title = f"Where regulation is lost, about the start of {name_of(scenario)}"
        save_figure(draw_scan(found.scan, title, found.period), target)
        printer.say(f"wrote {target}")
