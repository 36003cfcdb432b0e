"""softhand remark3: the force along the finger's axis against the contact angle."""

from __future__ import annotations

from softhand.commands.app import command
from softhand.commands.console import Printer
from softhand.commands.options import Law, OutFigure, Plugins, Quiet, ScenarioName, Set
from softhand.commands.places import check_figure, figure_of
from softhand.commands.scenarios import chosen_scenario


@command("softhand remark3 target-a --out angle.pdf")
def remark3(
    scenario: ScenarioName = "target-a",
    changes: Set = [],  # noqa: B006  typer copies it
    law: Law = None,
    out: OutFigure = None,
    plugins: Plugins = [],  # noqa: B006
    quiet: Quiet = False,
) -> None:
    """Draw the force along the finger against the tilt (Remark 3).

    For the fingertip of the scenario, beside the radial model.
    """
    check_figure(out)
    chosen = chosen_scenario(scenario, changes, law)
    from softhand.assembly.parts import read_law
    from softhand.plots.angle_force import draw_angle_force
    from softhand.plots.style import save_figure

    figure = draw_angle_force(read_law(chosen))
    target = figure_of(scenario, "remark3", out)
    save_figure(figure, target)
    Printer(quiet).say(f"wrote {target}")
