"""softhand squeeze: the least and the largest squeeze that hold a set of loads, and the margin to slip along a run."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, say_compiling
from softhand.commands.options import Controller, Json, Law, OutFigure, Plugins, Quiet, ScenarioOrRun, Set, numbers
from softhand.commands.places import check_figure, figure_of, figure_of_run, name_of
from softhand.commands.runs import is_run, load_run
from softhand.commands.scenarios import chosen_scenario, refuse_changes


@command("softhand squeeze target-a --any-attitude --margin 0.3; softhand squeeze runs/target-a --warning 0.1")
def squeeze(
    scenario: ScenarioOrRun = "target-a",
    changes: Set = [],  # noqa: B006  typer copies it
    law: Law = None,
    controller: Controller = None,
    any_attitude: Annotated[bool, typer.Option("--any-attitude", help="Hold gravity in any attitude.")] = False,
    attitude: Annotated[
        list[str],
        typer.Option(metavar="R,P,Y", help="An attitude of the hand: roll, pitch, yaw [deg]. May be repeated."),
    ] = [],  # noqa: B006
    wrench: Annotated[
        list[str],
        typer.Option(
            metavar="FX,FY,FZ,MX,MY,MZ",
            help="A push on the object about its centre of mass, in base axes [N, N m]. May be repeated.",
        ),
    ] = [],  # noqa: B006
    force: Annotated[float, typer.Option(metavar="N", help="Hold forces up to so large in any direction [N].")] = 0.0,
    moment: Annotated[float, typer.Option(metavar="N*M", help="Moments up to so large about any axis [N m].")] = 0.0,
    acceleration: Annotated[
        float, typer.Option(metavar="M/S2", help="Accelerations of the hand up to so large [m/s^2].")
    ] = 0.0,
    margin: Annotated[
        float, typer.Option(metavar="SHARE", help="Share of the limit surface that is left free, 0 to below 1.")
    ] = 0.2,
    friction: Annotated[
        float | None, typer.Option(metavar="MU", help="Friction at all contacts in place of the scenario's.")
    ] = None,
    at: Annotated[
        float | None, typer.Option(metavar="SECONDS", help="Sample of a run; the quietest at its goal by default [s].")
    ] = None,
    warning: Annotated[
        float, typer.Option(metavar="SHARE", help="Margin of a run below which a tip warns, 0 to 1.")
    ] = 0.2,
    out: OutFigure = None,
    plugins: Plugins = [],  # noqa: B006
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find the squeeze that holds a set of loads, and what limits it.

    Of a run also the margin to slip against time, with the time that it will last. Exit code 1 if no squeeze holds.
    """
    of_run = is_run(scenario)
    if of_run:
        refuse_changes(scenario, set=changes, law=law, controller=controller)
    attitudes = [numbers("--attitude", text, 3, math.pi / 180.0) for text in attitude]
    wrenches = [numbers("--wrench", text, 6) for text in wrench]
    if any_attitude and attitudes:
        raise typer.BadParameter(
            "any attitude has all others in it; leave one of the two out.", param_hint="--attitude"
        )
    if of_run:
        target = figure_of_run(Path(scenario), "squeeze.png", out)
    else:
        check_figure(out)
    source = load_run(scenario) if of_run else chosen_scenario(scenario, changes, law, controller)
    say_compiling(quiet)
    from softhand.holding.margin import slip_margin
    from softhand.holding.squeeze import squeeze as find_squeeze
    from softhand.plots.squeeze import draw_margin, draw_squeeze
    from softhand.plots.style import save_figure
    from softhand.recording.recording import Recording

    printer, name = Printer(quiet, as_json), name_of(scenario)
    slip = slip_margin(source, warning) if isinstance(source, Recording) else None
    asked: dict[str, Any] = {
        "attitudes": "any" if any_attitude else attitudes or None, "wrenches": wrenches, "force": force,
        "moment": moment, "acceleration": acceleration, "margin": margin, "friction": friction,
    }  # fmt: skip
    found = find_squeeze(source, at, **asked)
    printer.json(found if slip is None else {"squeeze": found, "slip_margin": slip})
    printer.table(f"{scenario}: squeeze", found.rows())
    if slip is not None:
        printer.table(f"{scenario}: margin to slip", slip.rows())
    if found.refusal is not None:
        raise found.refusal
    if slip is not None:
        figure = draw_margin(slip, f"Margin to slip of {name}")
    else:
        target = figure_of(scenario, "squeeze", out)
        figure = draw_squeeze(found.curve(), f"Squeeze that holds the loads, by the margin: {name}")
    save_figure(figure, target)
    printer.say(f"wrote {target}")
