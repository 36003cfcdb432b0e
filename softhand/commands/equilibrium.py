"""softhand equilibrium: where hand and object come to rest, and which limits they are at there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress, say_compiling
from softhand.commands.options import Controller, Json, Law, Plugins, Quiet, ScenarioOrRun, Set
from softhand.commands.runs import is_run, load_run
from softhand.commands.scenarios import chosen_scenario, refuse_changes
from softhand.errors import ScenarioError

if TYPE_CHECKING:
    from softhand.recording.recording import Recording
    from softhand.scenario.scenario import Scenario


@command("softhand equilibrium target-a --set object.mass=0.3; softhand equilibrium runs/hold --sample 1000 --json")
def equilibrium(
    scenario: ScenarioOrRun = "target-a",
    sample: Annotated[
        int, typer.Option(metavar="N", help="Begin at this sample of the run; from the end if negative.")
    ] = 0,
    time: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", help="Follow the reference to there [s]; by default to where it rests."),
    ] = None,
    torque: Annotated[
        str | None,
        typer.Option(
            metavar="N,...",
            help="Hold these joint torques [N m, N] in place of the controller's; one for each joint.",
        ),
    ] = None,
    changes: Set = [],  # noqa: B006  typer copies it
    law: Law = None,
    controller: Controller = None,
    plugins: Plugins = [],  # noqa: B006
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say where hand and object come to rest, and at which limits.

    From the start or a sample of a run, under the controller at the end of the reference, or under held torques. Exit
    code 1 where there is no rest; what is left there is shown all the same.
    """
    torques = None if torque is None else _numbers(torque)
    source: Recording | Scenario
    if is_run(scenario):
        refuse_changes(scenario, set=changes, law=law, controller=controller)
        source = load_run(scenario)
    else:
        source = chosen_scenario(scenario, changes, law, controller)
    say_compiling(quiet)
    from softhand.resting.equilibrium import equilibrium as find_equilibrium

    printer = Printer(quiet, as_json)
    with progress("coming to rest", 1.0, quiet) as told:
        found = find_equilibrium(source, sample, time=time, torque=torques, progress=told)
    printer.json(found)
    printer.table(f"Rest of {scenario}", found.rows())
    printer.table("fingertips", found.tip_rows(), ("", *found.header), " ".join(found.notes()))
    if found.refusal is not None:
        raise found.refusal


def _numbers(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise ScenarioError(
            f"--torque: got {text!r}; give numbers divided by commas, one a joint, such as 0.1,-0.2,0.3.",
            key="torque", value=text,
        ) from None  # fmt: skip
