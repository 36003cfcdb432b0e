"""softhand workspace: the object poses that a hand can hold."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Quiet, Set, check_figure, print_table, progress, say, say_compiling


@app.command(epilog="Example: softhand workspace target-a --phi-max 80 --out reach.pdf")
def workspace(
    scenario: Annotated[
        str, typer.Argument(help="A scenario that ships (see: softhand list) or a .toml file.")
    ] = "target-a",
    changes: Set = [],  # noqa: B006  typer copies it
    out: Annotated[Path, typer.Option(help="Figure to write, .png, .pdf or .svg.")] = Path("workspace.png"),
    phi_min: Annotated[
        float | None, typer.Option(help=r"Least contact angle Phi \[deg]; 0 is the rim of the tip, 1 if not given.")
    ] = None,
    phi_max: Annotated[
        float | None,
        typer.Option(help=r"Greatest contact angle Phi \[deg]; 90 is the apex. 89, or 179 for laws without a pole."),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Find the object poses that can be held with the contacts kept, with rigid tips, beside the paper's workspace."""
    check_figure(out)
    say_compiling(quiet)
    from softhand.grasping.workspace import POSES
    from softhand.grasping.workspace import workspace as find_workspace
    from softhand.plots.style import save_figure
    from softhand.plots.workspace import draw_workspace
    from softhand.scenario.file import parse_override
    from softhand.scenario.scenario import load_scenario

    chosen = load_scenario(scenario, dict(parse_override(change) for change in changes))
    with progress("asking for poses", float(POSES), quiet) as report:
        least, most = (None if angle is None else math.radians(angle) for angle in (phi_min, phi_max))
        found = find_workspace(chosen, (least, most), report)
    save_figure(draw_workspace(found.poses, f"Poses that can be held, about the start of {Path(scenario).stem}"), out)
    if not quiet:
        print_table(f"{scenario}: moves of the object from the start", found.rows())
        say(f"wrote {out}")
