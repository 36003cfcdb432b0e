"""softhand export: a recording as a file that other programs open."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress
from softhand.commands.options import OutFile, Plugins, Quiet, Run
from softhand.commands.places import beside_run
from softhand.commands.runs import load_run, run_file
from softhand.errors import SofthandError

if TYPE_CHECKING:
    from softhand.recording.recording import Recording

FORMATS = ("mcap", "csv", "rrd")


@command("softhand export runs/target-a --mcap --out run.mcap")
def export(
    recording: Run,
    mcap: Annotated[bool, typer.Option("--mcap", help="MCAP, for Foxglove, Lichtblick and others.")] = False,
    csv: Annotated[bool, typer.Option("--csv", help="CSV: all numbers, a row a sample.")] = False,
    rrd: Annotated[bool, typer.Option("--rrd", help="For the viewer of Rerun.")] = False,
    rate: Annotated[float, typer.Option(metavar="HZ", help="Pictures a second, in MCAP and rrd.")] = 30.0,
    picture: Annotated[
        bool, typer.Option("--picture/--no-picture", help="Take the 3-D scene along, in MCAP and rrd.")
    ] = True,
    out: OutFile = None,
    plugins: Plugins = [],  # noqa: B006  typer copies it
    quiet: Quiet = False,
) -> None:
    """Write a recording as MCAP, CSV or rrd, for other programs.

    The ending of --out may say the format.
    """
    chosen = _format([name for name, asked in zip(FORMATS, (mcap, csv, rrd), strict=True) if asked], out)
    target = beside_run(recording, run_file(recording).with_suffix(f".{chosen}").name, out)
    printer = Printer(quiet)
    run = load_run(recording)
    printer.incomplete(run)
    with progress(f"writing {target}", 1.0, quiet) as tell:
        _write(run, chosen, target, rate, picture, tell)
    printer.say(f"wrote {target}")


def _format(asked: list[str], out: Path | None) -> str:
    """The one that was asked for, or that the ending says."""
    options = ", ".join(f"--{name}" for name in FORMATS)
    if len(asked) > 1:
        raise SofthandError(
            f"format: got {' and '.join(f'--{name}' for name in asked)}; take one of them.", value=asked
        )
    if asked:
        return asked[0]
    ending = "" if out is None else out.suffix.lower().removeprefix(".")
    if ending in FORMATS:
        return ending
    got = (
        "none is given"
        if out is None
        else f"{out} has the unknown ending {out.suffix!r}"
        if ending
        else f"{out} has no ending"
    )
    raise SofthandError(f"format: {got}; choose with {options}.", value=ending)


def _write(
    run: Recording, chosen: str, target: Path, rate: float, picture: bool, tell: Callable[[float], None]
) -> None:
    from softhand.export.writing import write_mcap, write_rrd
    from softhand.recording.whole_file import check_place

    if chosen == "csv":
        check_place(target)
        run.to_csv(target)
        return
    (write_mcap if chosen == "mcap" else write_rrd)(run, target, rate, picture, tell)
