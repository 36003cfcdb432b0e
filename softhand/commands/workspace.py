"""softhand workspace: the object poses that a hand can hold."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Quiet, Set, check_figure, console, print_table, progress, say_compiling
from softhand.errors import ScenarioError

if TYPE_CHECKING:
    from softhand.grasping.workspace import Workspace

_POSES = 32768


@app.command(epilog="Example: softhand workspace target-a --phi-max 80 --out reach.pdf")
def workspace(
    scenario: Annotated[
        str, typer.Argument(help="A scenario that ships (see: softhand list) or a .toml file.")
    ] = "target-a",
    changes: Set = [],  # noqa: B006  typer copies it
    out: Annotated[Path, typer.Option(help="Figure to write, .png, .pdf or .svg.")] = Path("workspace.png"),
    phi_min: Annotated[float, typer.Option(help=r"Least contact angle Phi \[deg]; 0 is the rim of the tip.")] = 1.0,
    phi_max: Annotated[float, typer.Option(help=r"Greatest contact angle Phi \[deg]; 90 is the apex.")] = 89.0,
    quiet: Quiet = False,
) -> None:
    """Find the object poses that can be held with the contacts kept, with rigid tips, beside the paper's workspace."""
    if not 0.0 <= phi_min < phi_max <= 180.0:
        raise ScenarioError(
            f"--phi-min {phi_min:g} and --phi-max {phi_max:g} must be from 0 to 180 deg, the first the smaller.",
            key="phi", value=(phi_min, phi_max),
        )  # fmt: skip
    check_figure(out)
    say_compiling(quiet)
    from softhand.grasping.workspace import Workspace
    from softhand.plots.style import save_figure
    from softhand.plots.workspace import draw_workspace
    from softhand.scenario.file import parse_override
    from softhand.scenario.scenario import load_scenario

    chosen = load_scenario(scenario, dict(parse_override(change) for change in changes))
    space = Workspace(chosen, (math.radians(phi_min), math.radians(phi_max)))
    with progress("asking for poses", float(_POSES), quiet) as report:
        held, reasons = space.share(samples=_POSES, progress=report)
    save_figure(draw_workspace(space, f"Poses that can be held, about the start of {Path(scenario).stem}"), out)
    if not quiet:
        _print(space, scenario, held, reasons)
        console().print(f"wrote {out}", highlight=False)


def _print(space: Workspace, name: str, held: float, reasons: dict[str, float]) -> None:
    from softhand.grasping.workspace import PAPER_ANGLE, PAPER_POSITION

    rows: list[tuple[str, str]] = []
    for way in space.ranges():
        scale, unit, paper = (1e3, "mm", PAPER_POSITION) if way.name in "xyz" else (180.0 / math.pi, "deg", PAPER_ANGLE)
        for end, far, why in (("-", way.lower, way.lower_end), ("+", way.upper, way.upper_end)):
            short = ", less than the paper's" if abs(far) < paper else ""
            rows.append((f"{end}{way.name} alone", f"{scale * far:+.1f} {unit}  ({why}{short})"))
    box = f"±{1e3 * PAPER_POSITION:g} mm, ±{math.degrees(PAPER_ANGLE):g} deg"
    rows.append((f"held within {box}", f"{100.0 * held:.1f} % of all poses"))
    rows += [("" if k else "of the others", f"{100.0 * share:.1f} %  {why}")
             for k, (why, share) in enumerate(list(reasons.items())[:3])]  # fmt: skip
    factor = space.largest_box()
    far, turn = 1e3 * factor * PAPER_POSITION, math.degrees(factor * PAPER_ANGLE)
    rows.append(("all held within", f"±{far:.3g} mm, ±{turn:.3g} deg"))
    print_table(f"{name}: moves of the object from the start", rows)
