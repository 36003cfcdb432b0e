"""softhand new: a scenario to begin from, with comments."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer
from softhand.commands.options import Quiet, complete_scenarios
from softhand.commands.places import check_new, write_text
from softhand.errors import ScenarioError


@command("softhand new my.toml --like gripper; softhand new my.toml --hand my_hand.urdf")
def new(
    file: Annotated[Path, typer.Argument(metavar="FILE.toml", help="Scenario to write; one that is there stays.")],
    like: Annotated[
        str | None,
        typer.Option(
            metavar="SCENARIO",
            autocompletion=complete_scenarios,
            help="A scenario that ships, of which it is a copy; target-a if there is no --hand.",
        ),
    ] = None,
    hand: Annotated[
        Path | None,
        typer.Option(metavar="FILE.urdf", help="A hand of your own, whose ends become the fingertips, holding a box."),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Write a scenario to begin from, with comments.

    It is a copy of one that ships, or is made for a hand of your own. Then the grasp is left open; softhand grasp finds
    one, and where to put the object.
    """
    if file.suffix.lower() != ".toml":
        raise ScenarioError(f"{file}: the name of a scenario ends with .toml.", key="scenario", value=str(file))
    if like and hand:
        raise ScenarioError("--like and --hand: take one of them.", key="hand", value=str(hand))
    check_new(file)
    remedies: list[str] = []
    if hand is None:
        text, then = _copy(like or "target-a"), f"softhand simulate {file}"
    else:
        from softhand.scenario.blank import blank_scenario

        held = file.with_name(f"{file.stem}-held.toml")
        text, remedies = blank_scenario(hand, file)
        then = f"softhand grasp {file} --place --propose --write {held}"
        if "\n# contact_points = " in text:  # of coupled joints, for which nothing searches
            then = f"give [grasp] of {file} its points; then softhand check {file}"
    write_text(file, text)
    for line in remedies:
        key, _, why = line.partition("#")
        Printer(quiet).say(f"{file}: hand.{key.strip()}: {why.strip()}", "warning")
    Printer(quiet).say(f"wrote {file}; now: {then}")


def _copy(name: str) -> str:
    """The text of a scenario that ships."""
    from softhand.files import read_regular
    from softhand.scenario.file import find_scenario, scenario_names
    from softhand.settings.toml import LONGEST

    if name not in scenario_names():
        find_scenario(name)  # refuses what is no path, with the nearest name
        raise ScenarioError(f"--like: {name} is none that ships; copy the file itself.", key="scenario", value=name)
    text = read_regular(find_scenario(name), LONGEST).decode()
    return f"# As {name}, which ships with softhand; docs/scenario.md lists all keys.\n{text}"
