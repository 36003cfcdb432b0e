"""softhand design: gains for a grasp at rest, linear-quadratic or by bandwidth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from softhand.commands.app import app
from softhand.commands.console import Printer, progress, say_compiling
from softhand.commands.help import Command, Group
from softhand.commands.options import Json, Law, OutFigure, Plugins, Quiet, Set, complete_scenarios
from softhand.commands.places import check_figure, check_new, figure_of, free_file, name_of
from softhand.commands.scenarios import chosen_scenario
from softhand.errors import ScenarioError

if TYPE_CHECKING:
    from softhand.design.gain_design import GainDesign
    from softhand.design.lqr import LqrDesign


class _Designs(Group):
    """The ways to design."""

    tasks = {"Design": ("lqr", "gains")}  # noqa: RUF012  as in the base


design = typer.Typer(
    name="design",
    cls=_Designs,
    help="Find gains of a controller for a grasp at rest.",
    epilog="Example: softhand design lqr target-a",
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
)
app.add_typer(design)

_Scenario = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        autocompletion=complete_scenarios,
        help="A scenario that ships (see: softhand list), a .toml file, or the folder of a run.",
    ),
]


@design.command(
    cls=Command,
    epilog="Example: softhand design lqr target-a; softhand design lqr hold --weight object_position=4e6 "
    "--weight object_position_integral=1e7 --gains gains.toml; "
    'softhand simulate hold --set \'controller={name="state-feedback",gain_file="gains.toml"}\'',
)
def lqr(
    scenario: _Scenario = "target-a",
    weight: Annotated[
        list[str],
        typer.Option(
            metavar="NAME=VALUE",
            help="What a unit squared costs a second, as object_position=1e6; a number or a list. May be repeated.",
        ),
    ] = [],  # noqa: B006  typer copies it
    gains: Annotated[
        Path | None,
        typer.Option(metavar="FILE.toml", help="Gain file to write; by default a new one beside the figure."),
    ] = None,
    changes: Set = [],  # noqa: B006
    law: Law = None,
    out: OutFigure = None,
    plugins: Plugins = [],  # noqa: B006
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Design a linear-quadratic state feedback about the rest where a reference ends.

    Writes a gain file for the controller state-feedback, and a figure of the motions before and after.
    """
    check_figure(out)
    if gains is not None:
        check_new(gains)
    weights = _weights(weight)
    source = chosen_scenario(scenario, changes, law)
    say_compiling(quiet)
    from softhand.design.lqr import design_lqr

    printer = Printer(quiet, as_json)
    found = design_lqr(source, weights)
    printer.json(found)
    printer.table(f"Linear-quadratic regulator of {scenario}, about {found.where}", found.rows(), ("", *found.header))
    target = _draw(found, scenario, (found.controller, "state-feedback"), out, printer)
    file = gains or free_file(target.with_name("gains.toml"))
    found.save(file)
    printer.say(f"wrote {file}, for controller.gain_file of the controller state-feedback")


@design.command(
    cls=Command,
    epilog="Example: softhand design gains target-a --bandwidth 2; "
    "softhand design gains target-a --controller object-impedance --bandwidth 4 --damping 0.2 --json",
)
def gains(
    scenario: _Scenario = "target-a",
    bandwidth: Annotated[
        float, typer.Option(metavar="HZ", help="Up to which the pose follows what is asked for, to 71 % [Hz].")
    ] = 2.0,
    damping: Annotated[
        float, typer.Option(metavar="RATIO", help="Least damping ratio of the motions of the pose.")
    ] = 0.3,
    delay: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            help="Between sample and torque, that the loop has to bear [s]; by default a tenth of a control period.",
        ),
    ] = None,
    controller: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="regulation, object-impedance or computed-torque; by default the scenario's."
        ),
    ] = None,
    changes: Set = [],  # noqa: B006
    law: Law = None,
    out: OutFigure = None,
    plugins: Plugins = [],  # noqa: B006
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find gains for a bandwidth, a damping ratio and a margin for delay.

    Checked on the linear loop with its samples and soft tips, where the scenario starts and where its reference ends.
    """
    check_figure(out)
    source = chosen_scenario(scenario, changes, law)
    say_compiling(quiet)
    from softhand.design.gains import design_gains

    printer = Printer(quiet, as_json)
    with progress(f"turning gains of {scenario}", 1.0, quiet) as report:
        found = design_gains(source, bandwidth, damping, controller=controller, delay=delay, progress=report)
    printer.json(found)
    printer.table(f"Gains for {scenario}, at {' and '.join(found.poses)}", found.rows(), ("", *found.header))
    if not as_json:
        printer.say(found.toml())
    _draw(found, scenario, (found.before, found.name), out, printer)


def _draw(
    found: LqrDesign | GainDesign, scenario: str, names: tuple[str, str], out: Path | None, printer: Printer
) -> Path:
    from softhand.plots.design import draw_design
    from softhand.plots.style import save_figure

    target = figure_of(scenario, "design", out)
    title = f"Motions of {name_of(scenario)}, before and after the design"
    save_figure(draw_design(found.modes_before, found.modes, title, names), target)
    printer.say(f"wrote {target}")
    return target


def _weights(texts: list[str]) -> dict[str, Any]:
    from softhand.scenario.file import parse_override

    found = dict(parse_override(text, "object_position=1e6") for text in texts)
    for name, value in found.items():
        if isinstance(value, str):
            raise ScenarioError(
                f"--weight: {name} has {value!r}, which is no number; write it as {name}=1e6.", key=name, value=value
            )
    return found
