"""softhand push: the worst push that a grasp survives."""

from __future__ import annotations

from typing import Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress, say_compiling
from softhand.commands.options import Controller, Json, Law, OutFigure, Plugins, Quiet, ScenarioName, Set, numbers
from softhand.commands.places import check_figure, figure_of, name_of
from softhand.commands.scenarios import chosen_scenario


@command("softhand push target-a --set fingertip.friction=0.6 --step --out push.pdf")
def push(
    scenario: ScenarioName = "target-a",
    changes: Set = [],  # noqa: B006  typer copies it
    law: Law = None,
    controller: Controller = None,
    moment: Annotated[bool, typer.Option("--moment", help="Push with moments in place of forces.")] = False,
    step: Annotated[
        bool, typer.Option("--step", help="Push all at once, where the overshoot counts, in place of slowly.")
    ] = False,
    count: Annotated[int, typer.Option(metavar="12|42|162", help="Directions that are tried.")] = 42,
    along: Annotated[
        list[str],
        typer.Option(metavar="X,Y,Z", help="Another direction, in base axes, of any length. May be repeated."),
    ] = [],  # noqa: B006
    out: OutFigure = None,
    plugins: Plugins = [],  # noqa: B006
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find the worst push that the start of a scenario survives.

    Each direction is pushed in simulation until a tip slips or lifts off.
    """
    check_figure(out)
    others = [numbers("--along", text, 3) for text in along]
    chosen = chosen_scenario(scenario, changes, law, controller)
    say_compiling(quiet)
    from softhand.holding.worst_push import worst_push
    from softhand.plots.squeeze import draw_push
    from softhand.plots.style import save_figure

    printer = Printer(quiet, as_json)
    with progress(f"pushing {scenario}", 1.0, quiet):
        found = worst_push(chosen, "moment" if moment else "force", "step" if step else "ramp", count, others)
    printer.json(found)
    printer.table(f"{scenario}: worst push", found.rows())
    target = figure_of(scenario, "push", out)
    save_figure(draw_push(found, f"Pushes that {name_of(scenario)} survives"), target)
    printer.say(f"wrote {target}")
