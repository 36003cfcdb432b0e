"""softhand grasp: how good the grasp of a scenario is, where the object is held best, better grasps proposed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress, say, say_compiling
from softhand.commands.options import Controller, Json, Law, OutFigure, Plugins, Quiet, Set, Stepper, complete_scenarios
from softhand.commands.places import check_figure, check_new, figure_of, figure_of_run, name_of, write_text
from softhand.commands.runs import load_run
from softhand.commands.scenarios import parse_changes, refuse_changes, scenario_file, with_options
from softhand.errors import ControllerError, GraspError, SofthandError

if TYPE_CHECKING:
    from softhand.closed_loop.grasp_stiffness import GraspStiffness
    from softhand.grasping.proposals import Proposals
    from softhand.numerics.record import Record
    from softhand.scenario.scenario import Scenario

ScenarioOrRun = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        autocompletion=complete_scenarios,
        help="A scenario that ships (see: softhand list), a .toml file, a run's folder; with --stiffness a run.nc.",
    ),
]


@command(
    "softhand grasp target-a --stiffness --set object.mass=0.3; "
    "softhand grasp my.toml --place --propose --write held.toml && softhand simulate held.toml"
)
def grasp(
    scenario: ScenarioOrRun = "target-a",
    changes: Set = [],  # noqa: B006  typer copies it
    law: Law = None,
    controller: Controller = None,
    stepper: Stepper = None,
    place: Annotated[
        bool, typer.Option("--place", help="First move the object to where the fingers have most room.")
    ] = False,
    propose: Annotated[bool, typer.Option("--propose", help="Search for contact points that hold the object.")] = False,
    count: Annotated[int, typer.Option(metavar="N", min=1, max=100, help="Most proposals.")] = 5,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Of the search.")] = 0,
    stiffness: Annotated[
        bool, typer.Option("--stiffness", help="Also how stiff the object is held: what small displacements need.")
    ] = False,
    joints: Annotated[
        str,
        typer.Option(
            metavar="JOINTS", help="With --stiffness: locked, controller, or the stiffness of their springs [N m/rad]."
        ),
    ] = "locked",
    at: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS", help="With --stiffness of a run.nc: at which time; by default where it is quietest [s]."
        ),
    ] = None,
    write: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml", help="Keep the best proposal, or the new place, as a scenario in a new file."
        ),
    ] = None,
    out: OutFigure = None,
    plugins: Plugins = [],  # noqa: B006
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Show how good the grasp at the start is, or propose others.

    Reach, friction, force closure and the least internal forces, finger by finger; with --stiffness the principal
    stiffnesses of the held object, the softest first. With --propose the scenario needs no
    contact points and no internal forces. Exit code 1 where there is no grasp at rest; what is known of it is shown all
    the same.
    """
    if is_recording(scenario):
        refuse_changes(
            scenario, set=changes, law=law, controller=controller, stepper=stepper, place=place, propose=propose,
            write=write,
        )  # fmt: skip
        _of_run(scenario, stiffness, joints, at, out, Printer(quiet, as_json))
        return
    check_figure(out)
    if at is not None:
        raise SofthandError("--at: is a time in a recording; name a run.nc.", value=at)
    if joints != "locked" and not stiffness:
        raise SofthandError("--joints: is for --stiffness; add it.", value=joints)
    if write is not None:
        _check_write(write, place or propose)
    from softhand.scenario.scenario import load_scenario
    from softhand.scenario.ungrasped import without_grasp

    name, printer = name_of(scenario), Printer(quiet, as_json)
    values = parse_changes(changes)
    source = scenario_file(scenario)
    stand_ins = without_grasp(source, values) if propose else {}
    chosen = with_options(load_scenario(source, {**values, **stand_ins}), law, controller, stepper)
    say_compiling(quiet)
    from softhand.assembly.collisions import collisions_at_start
    from softhand.assembly.resolve import resolve
    from softhand.collision.told import told
    from softhand.grasping.quality import grasp_quality
    from softhand.numerics.record import plain
    from softhand.plots.grasp import draw_grasp
    from softhand.plots.style import save_figure

    if place:
        chosen = _placed(chosen, not stand_ins, propose, printer)
    if propose:
        from softhand.grasping.proposals import propose_grasps

        with progress("searching for grasps", 1.0, quiet) as report:
            proposals = propose_grasps(chosen, count, seed, progress=report)
        chosen, quality, title = proposals[0].scenario, proposals[0].quality, f"Best proposal for {name}"
        result: Record = proposals
        _print_proposals(proposals, printer)
    else:
        quality, title = grasp_quality(chosen), f"Grasp of {name}"
        result = quality
    held, refusal = _stiffness(chosen, joints) if stiffness and not quality.refusal else (None, quality.refusal)
    colliding = told(lambda: collisions_at_start(resolve(chosen)))
    printer.json({**plain(result), "collisions": colliding.found, **({"stiffness": held} if held else {})})
    header, *rows = quality.finger_rows()
    printer.table(title, rows, header)
    printer.table("the grasp as a whole", [*quality.rows(), colliding.rows[0]])
    if held:
        printer.table("stiffness of the held object", held.rows(), held.header, " ".join(held.notes()))
    target = figure_of(scenario, "grasp", out)
    save_figure(draw_grasp(quality, title, held), target)
    printer.say(f"wrote {target}")
    if refusal is not None:
        raise refusal
    if write is not None:
        _write(chosen, f"{title}, margin {quality.margin:.3f} N per newton of normal force", write)
        printer.say(f"wrote {write}: softhand simulate {write}")


def is_recording(target: str) -> bool:
    """Whether a file of a recording is named; the folder of a run stands for its scenario."""
    return target.lower().endswith(".nc")


def _of_run(file: str, stiffness: bool, joints: str, at: float | None, out: Path | None, printer: Printer) -> None:
    """How stiff the object is held at a time of a recording."""
    target = figure_of_run(Path(file), "grasp.png", out)
    if not stiffness:
        raise SofthandError(
            f"{file} is a recording, which has no start to judge; add --stiffness, or name a scenario.",
            value=file,
        )  # fmt: skip
    run = load_run(file)
    say_compiling(printer.quiet)
    from softhand.closed_loop.grasp_stiffness import grasp_stiffness
    from softhand.plots.grasp_stiffness import draw_stiffness
    from softhand.plots.style import save_figure

    found = grasp_stiffness(run, at, _number(joints))
    printer.json(found)
    printer.table(f"stiffness of the held object, {file}", found.rows(), found.header, " ".join(found.notes()))
    save_figure(draw_stiffness(run, found, f"How the object of {file} is held at {found.time:g} s"), target)
    printer.say(f"wrote {target}")


def _stiffness(scenario: Scenario, joints: str) -> tuple[GraspStiffness | None, SofthandError | None]:
    """The stiffness of the held object, or why it has none."""
    from softhand.closed_loop.grasp_stiffness import grasp_stiffness

    try:
        return grasp_stiffness(scenario, joints=_number(joints)), None
    except (GraspError, ControllerError) as error:
        return None, error


def _number(joints: str) -> str | float:
    try:
        return float(joints)
    except ValueError:
        return joints


def _check_write(file: Path, finds: bool) -> None:
    if not finds:
        raise SofthandError("--write: keeps what --propose or --place finds; add one of them.", value=str(file))
    if file.suffix.lower() != ".toml":
        raise SofthandError(f"--write: got {file}; the name of a scenario ends with .toml.", value=str(file))
    check_new(file)


def _write(scenario: Scenario, title: str, file: Path) -> None:
    """The scenario as a file, with the files of hand and object beside it named from there."""
    paths = {}
    for urdf in (scenario.hand.urdf, scenario.object.urdf):
        beside = os.path.relpath(urdf, file.absolute().parent) if os.path.isabs(urdf) else ".."
        if not beside.startswith(".."):
            paths[f'urdf = "{urdf}"'] = f'urdf = "{beside}"'
    text = scenario.to_toml()
    for before, after in paths.items():
        text = text.replace(before, after)
    write_text(file, f"# {title}. All units are SI; softhand check {file.name} names them.\n{text}")


def _placed(scenario: Scenario, has_points: bool, propose: bool, printer: Printer) -> Scenario:
    """The object where its grasp has most room; where other points are looked for, else where all fingers reach it."""
    from softhand.grasping.placement import place_object
    from softhand.grasping.reaching import place_in_reach

    with progress("placing the object", 1.0, printer.quiet) as report:
        try:
            placement = place_object(scenario, progress=report) if has_points else None
        except GraspError:
            if not propose:
                raise
            placement = None
        found = placement or place_in_reach(scenario, report)
    for key, value in found.rows():
        printer.say(f"{key} = {value}")
    return found.scenario


def _print_proposals(proposals: Proposals, printer: Printer) -> None:
    header, *rows = proposals.rows()
    printer.table("proposals, best first", rows, header)
    if not (printer.quiet or printer.as_json):
        for k, proposal in enumerate(proposals, start=1):
            say(f"# proposal {k}\n{proposal.section()}")
