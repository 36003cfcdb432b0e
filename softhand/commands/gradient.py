"""softhand gradient: what each parameter of a scenario does to the cost of its run."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, say_compiling
from softhand.commands.options import (
    Controller,
    Duration,
    Json,
    Law,
    OutFigure,
    Plugins,
    Quiet,
    ScenarioName,
    Set,
)
from softhand.commands.places import check_figure, figure_of, name_of
from softhand.commands.scenarios import chosen_scenario

if TYPE_CHECKING:
    from softhand.derivatives.costs import QuadraticCost

_COST = re.compile(r"(?P<variable>\w+)(=(?P<wanted>[^*@]+))?(\*(?P<weight>[^@]+))?(?P<end>@end)?")


@command(
    "softhand gradient target-a --cost object_position=object_position_desired*1e6@end --parameter mass --parameter K_v"
)
def gradient(
    scenario: ScenarioName = "target-a",
    cost: Annotated[
        list[str],
        typer.Option(
            metavar="VARIABLE[=WANTED][*WEIGHT][@end]",
            help="A term of the cost: weight times the square of what a variable of a recording is off from a number "
            "or another variable, over the whole run or at its end. May be repeated; by default the error of the "
            "object's position in mm^2 s.",
        ),
    ] = [],  # noqa: B006  typer copies it
    parameter: Annotated[
        list[str],
        typer.Option(
            metavar="KEY",
            help="A number of the scenario by its key or the last part of it, or wrench. May be repeated; by default "
            "mass, friction and the numbers of the controller.",
        ),
    ] = [],  # noqa: B006
    duration: Duration = None,
    changes: Set = [],  # noqa: B006
    law: Law = None,
    controller: Controller = None,
    out: OutFigure = None,
    plugins: Plugins = [],  # noqa: B006
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find how the cost of a run goes with numbers of its scenario.

    By the adjoint of all its steps, through contact and slip, at about the price of three runs for any number of them.
    """
    terms = [_term(text) for text in cost or ["object_position=object_position_desired*1e6"]]
    check_figure(out)
    chosen = chosen_scenario(scenario, changes, law, controller)
    if duration is not None:
        chosen = chosen.with_values({"duration": duration})
    say_compiling(quiet)
    from softhand.derivatives.gradient import gradient as find_gradient
    from softhand.plots.gradient import draw_gradient
    from softhand.plots.style import save_figure

    gains = [
        f"controller.{name}"
        for name, value in chosen.controller.parameters.items()
        if isinstance(value, float)
        or (isinstance(value, list | tuple) and all(isinstance(one, float) for one in value))
    ]
    printer = Printer(quiet, as_json)
    found = find_gradient(chosen, terms, parameter or ["mass", "friction", *gains])
    printer.json(found)
    rows = found.rows()
    printer.table(
        f"Cost of {scenario}: {found.value:.6g}",
        [(row["parameter"], f"{row['value']:.6g}", row["unit"], f"{row['slope']:.6g}", f"{row['one percent']:+.3g}")
         for row in rows],
        ("parameter", "value", "unit", "slope", "one percent more"),
        f"{len(found.switches)} switches of contacts and limits were crossed; the slopes are those of runs that cross "
        "them at the same steps." if found.switches else "",
    )  # fmt: skip
    target = figure_of(scenario, "gradient", out)
    save_figure(draw_gradient(found, f"Cost of {name_of(scenario)}"), target)
    printer.say(f"wrote {target}")


def _term(text: str) -> QuadraticCost:
    """A term of the cost as it is typed."""
    from softhand.derivatives.costs import QuadraticCost

    found = _COST.fullmatch(text.replace(" ", ""))
    try:
        if found is None:
            raise ValueError
        wanted = found["wanted"] or "0"
        return QuadraticCost(
            found["variable"],
            wanted if wanted.isidentifier() else float(wanted),
            float(found["weight"] or "1"),
            terminal=found["end"] is not None,
        )
    except ValueError:
        raise typer.BadParameter(
            f"got {text!r}; give VARIABLE[=WANTED][*WEIGHT][@end], such as joint_velocity*0.01 or "
            "object_position=object_position_desired*1e6@end.",
            param_hint="--cost",
        ) from None
