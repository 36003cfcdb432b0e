"""softhand grasps: thousands of grasps at rest of a hand and an object, as one data set."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress, say_compiling
from softhand.commands.options import Json, Law, Plugins, Quiet, ScenarioName, Set
from softhand.commands.places import check_file, name_of
from softhand.commands.scenarios import chosen_scenario


@command("softhand grasps target-a --count 10000 --out grasps.nc --jobs 2")
def grasps(
    scenario: ScenarioName = "target-a",
    count: Annotated[int, typer.Option(metavar="N", min=1, help="Grasps.")] = 10_000,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Of the sampling.")] = 0,
    position: Annotated[
        float, typer.Option(metavar="METRES", help="Largest way of the object along each axis [m].")
    ] = 0.01,
    turn: Annotated[float, typer.Option(metavar="RADIANS", help="Largest turn of the object [rad].")] = 0.3,
    jobs: Annotated[int, typer.Option(metavar="N", min=1, max=256, help="Processes to work in.")] = 1,
    changes: Set = [],  # noqa: B006  typer copies it
    law: Law = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE.nc", help="Where to write; a file of the same call goes on. Else grasps-NAME.nc."),
    ] = None,
    plugins: Plugins = [],  # noqa: B006
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Sample thousands of grasps at rest, as one data set.

    Random poses of the object, places that the fingers reach, and squeezes; each is brought to rest and has the figures
    of softhand grasp. xarray opens the file. After Ctrl-C the same command goes on.
    """
    file = out or Path(f"grasps-{name_of(scenario)}.nc")
    check_file(file)
    chosen = chosen_scenario(scenario, changes, law)
    say_compiling(quiet)
    from softhand.studies.grasps.sample import sample_grasps

    printer = Printer(quiet, as_json)
    with progress(f"sampling {count} grasps of {scenario}", float(count), quiet) as report:
        found = sample_grasps(
            chosen, count, seed, position=position, turn=turn, file=file, jobs=jobs, progress=report
        )  # fmt: skip
    head, *rows = found.rows()
    printer.json({"grasps": len(found), "poses": found.poses, "refused": found.refused, "file": str(file)})
    told = ", ".join(f"{what} {times}" for what, times in sorted(found.refused.items(), key=lambda one: -one[1]))
    printer.table(
        f"{len(found)} grasps from {found.poses} poses of the object", rows, head,
        f"What stood in the way of others, in numbers of choices: {told}." if told else "",
    )  # fmt: skip
    printer.say(f"wrote {file}")
