"""softhand grasp: how good the grasp of a scenario is, where the object is held best, better grasps proposed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Plugins, Quiet, Set, check_figure, print_table, progress, say, say_compiling
from softhand.errors import GraspError

if TYPE_CHECKING:
    from softhand.grasping.proposals import Proposals
    from softhand.scenario.scenario import Scenario


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

    With --propose the scenario needs no contact points and no internal forces.
    Exit code 1 where there is no grasp at rest; what is known of it is shown all the same.
    """
    check_figure(out)
    say_compiling(quiet)
    from softhand.grasping.quality import grasp_quality
    from softhand.plots.grasp import draw_grasp
    from softhand.plots.style import save_figure
    from softhand.scenario.file import parse_override
    from softhand.scenario.scenario import load_scenario
    from softhand.scenario.ungrasped import without_grasp

    name = Path(scenario).stem
    values = dict(parse_override(change) for change in changes)
    stand_ins = without_grasp(scenario, values) if propose else {}
    chosen = load_scenario(scenario, {**values, **stand_ins})
    if place:
        chosen = _placed(chosen, not stand_ins, propose, quiet)
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


def _placed(scenario: Scenario, has_points: bool, propose: bool, quiet: bool) -> Scenario:
    """The object where its grasp has most room; where other points are looked for, else where all fingers reach it."""
    from softhand.grasping.placement import place_object
    from softhand.grasping.reaching import place_in_reach

    with progress("placing the object", 1.0, quiet) as report:
        try:
            placement = place_object(scenario, progress=report) if has_points else None
        except GraspError:
            if not propose:
                raise
            placement = None
        found = placement or place_in_reach(scenario, report)
    if not quiet:
        for key, value in found.rows():
            say(f"{key} = {value}")
    return found.scenario


def _print_proposals(proposals: Proposals) -> None:
    print_table("proposals, best first", proposals.rows())
    for k, proposal in enumerate(proposals, start=1):
        say(f"# proposal {k}\n{proposal.section()}")
