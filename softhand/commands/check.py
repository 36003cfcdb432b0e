"""softhand check: is a URDF, a scenario or a recording sound?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Plugins, Quiet, Set, console, escape, print_table, say_compiling
from softhand.errors import ScenarioError


@app.command(
    epilog="Example: softhand check my_hand.urdf; softhand check my.toml --set stepper.name=rk4; softhand check run.nc"
)
def check(
    target: Annotated[str, typer.Argument(help="A .urdf file, a scenario that ships, a .toml file, or a run.nc.")],
    changes: Set = [],  # noqa: B006  typer copies it
    plugins: Plugins = [],  # noqa: B006
    quiet: Quiet = False,
) -> None:
    """Say what is wrong or doubtful in a URDF, a scenario or a recording; exit code 1 if it cannot be used.

    A scenario is explained: every value with its unit, the start, and what to think of it. A recording is searched for
    what is missing, not a number, uneven or beyond friction.
    """
    ending = Path(target).suffix.lower()
    if changes and ending in (".urdf", ".nc"):
        raise ScenarioError(f"--set changes a scenario; {target} is none.", key="set", value=changes)
    if ending == ".urdf":
        _check_urdf(Path(target), quiet)
    elif ending == ".nc":
        _check_recording(Path(target), quiet)
    else:
        _check_scenario(target, changes, quiet)


def _check_urdf(file: Path, quiet: bool) -> None:
    from softhand.checks.urdf import doubts_of_shape
    from softhand.model.urdf.document import read_text
    from softhand.model.urdf.examination import examine
    from softhand.model.urdf.pinocchio_model import build_model
    from softhand.model.urdf.urdf import Urdf

    examination = examine(read_text(file), file, folder=file.parent)
    if not quiet:
        _print_warnings([f"{file}, {finding}" for finding in examination.findings.warnings])
    urdf = Urdf.of(examination)
    model = build_model(urdf)
    if quiet:
        return
    _print_warnings(doubts_of_shape(urdf, model))
    moving, joints = urdf.moving_joints, urdf.tree.joints
    rows = [
        ("kind", "object" if urdf.is_object else "hand"),
        ("links", f"{len(urdf.tree.links)}, root {urdf.tree.root}"),
        ("joints", f"{len(moving)} moving, {len(joints) - len(moving)} fixed"),
        ("moving mass", f"{sum(inertia.mass for inertia in list(model.inertias)[1:]):.4g} kg"),
    ]
    if moving:
        rows.append(("ends", ", ".join(urdf.ends)))
    print_table(str(file), rows)
    console().print(f"{escape(str(file))}: no errors", highlight=False)


def _check_scenario(target: str, changes: list[str], quiet: bool) -> None:
    from softhand.scenario.file import parse_override
    from softhand.scenario.scenario import load_scenario

    scenario = load_scenario(target, dict(parse_override(change) for change in changes))
    say_compiling(quiet)
    from softhand.checks.scenario import check_scenario

    checkup = check_scenario(scenario)
    if quiet:
        return
    print_table(
        target, [(key, value if unit in ("", "1") else f"{value} {unit}") for key, value, unit in checkup.values]
    )
    print_table("at the start", checkup.start)
    _print_warnings(checkup.warnings)
    _print_verdict(target, len(checkup.warnings))


def _check_recording(file: Path, quiet: bool) -> None:
    from softhand.recording.recording import Recording

    recording = Recording.load(file)
    say_compiling(quiet)
    from softhand.checks.recording import check_recording

    checkup = check_recording(recording)
    if not quiet:
        print_table(str(file), checkup.rows)
        _print_warnings([f"{file}: {warning}" for warning in checkup.warnings])
    checkup.raise_errors(str(file))
    if not quiet:
        _print_verdict(str(file), len(checkup.warnings))


def _print_verdict(target: str, warnings: int) -> None:
    text = f"{target}: no errors, {warnings} warning{'' if warnings == 1 else 's'}"
    console().print(escape(text), highlight=False)


def _print_warnings(warnings: list[str]) -> None:
    for warning in warnings:
        console().print(f"[yellow]warning:[/] {escape(warning)}", highlight=False, soft_wrap=True)
