"""softhand grasp: how good the grasp of a scenario is, where the object is held best, better grasps proposed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Plugins, Quiet, Set, check_figure, print_table, progress, say, say_compiling

if TYPE_CHECKING:
    from softhand.grasping.proposals import Proposals


@app.command(epilog="Example: softhand grasp target-a --set object.mass=0.3; softhand grasp my.toml --place --propose")
def grasp(
    scenario: Annotated[
        str, typer.Argument(help="A scenario that ships (see: softhand list) or a .toml file.")
    ] = "target-a",
    changes: Set = [],  # noqa: B006  typer copies it
    out: Annotated[Path, typer.Option(help="Figure to write, .png, .pdf or .svg.")] = Path("grasp.png"),
    place: Annotated[
        bool, typer.Option("--place", help="First move the object to where the fingers have most room.")
    ] = False,
    propose: Annotated[bool, typer.Option("--propose", help="Search for contact points that hold the object.")] = False,
    count: Annotated[int, typer.Option(min=1, max=100, help="Most proposals.")] = 5,
    seed: Annotated[int, typer.Option(min=0, help="Of the search.")] = 0,
    plugins: Plugins = [],  # noqa: B006
    quiet: Quiet = False,
) -> None:
    """Show the grasp at the start: reach, friction, force closure, least internal force; or propose others.

    Exit code 1 where there is no grasp at rest; what is known of it is shown all the same.
    """
    check_figure(out)
    say_compiling(quiet)
    from softhand.grasping.quality import grasp_quality
    from softhand.plots.grasp import draw_grasp
    from softhand.plots.style import save_figure
    from softhand.scenario.file import parse_override
    from softhand.scenario.scenario import load_scenario

    name = Path(scenario).stem
    chosen = load_scenario(scenario, dict(parse_override(change) for change in changes))
    if place:
        from softhand.grasping.placement import place_object

        with progress("placing the object", 1.0, quiet) as report:
            placement = place_object(chosen, progress=report)
        chosen = placement.scenario
        if not quiet:
            for key, value in placement.rows():
                say(f"{key} = {value}")
    if propose:
        from softhand.grasping.proposals import propose_grasps

        with progress("searching for grasps", 1.0, quiet) as report:
            proposals = propose_grasps(chosen, count, seed, progress=report)
        quality, title = proposals[0].quality, f"Best proposal for {name}"
        if not quiet:
            _print_proposals(proposals)
    else:
        quality, title = grasp_quality(chosen), f"Grasp of {name}"
    if not quiet:
        print_table(title, quality.finger_rows())
        print_table("the grasp as a whole", quality.rows())
    save_figure(draw_grasp(quality, title), out)
    if not quiet:
        say(f"wrote {out}")
    if quality.refusal is not None:
        raise quality.refusal


def _print_proposals(proposals: Proposals) -> None:
    print_table("proposals, best first", proposals.rows())
    for k, proposal in enumerate(proposals, start=1):
        say(f"# proposal {k}\n{proposal.section()}")
