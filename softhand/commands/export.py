"""softhand export: a recording as a file that other programs open."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Quiet, note_incomplete, progress, say
from softhand.commands.runs import load_run
from softhand.errors import SofthandError

if TYPE_CHECKING:
    from softhand.recording.recording import Recording
    from softhand.simulation.simulation import Progress

FORMATS = ("mcap", "csv", "rrd")


@app.command(epilog="Example: softhand export runs/target-a/run.nc --mcap --out run.mcap")
def export(
    recording: Annotated[Path, typer.Argument(help="A recording, run.nc, or its folder.")],
    mcap: Annotated[bool, typer.Option("--mcap", help="MCAP, for Foxglove, Lichtblick and others.")] = False,
    csv: Annotated[bool, typer.Option("--csv", help="CSV: all numbers, a row a sample.")] = False,
    rrd: Annotated[bool, typer.Option("--rrd", help="For the viewer of Rerun.")] = False,
    out: Annotated[
        Path | None, typer.Option(help="File to write; by default beside the recording. Its ending may say the format.")
    ] = None,
    rate: Annotated[float, typer.Option(help="Pictures a second, in MCAP and rrd.")] = 30.0,
    picture: Annotated[
        bool, typer.Option("--picture/--no-picture", help="Take the 3-D scene along, in MCAP and rrd.")
    ] = True,
    quiet: Quiet = False,
) -> None:
    """Write a recording as MCAP, CSV or rrd, for other programs."""
    chosen = _format([name for name, asked in zip(FORMATS, (mcap, csv, rrd), strict=True) if asked], out)
    run = load_run(recording)
    beside = recording / "run.nc" if recording.is_dir() else recording
    target = out or beside.with_suffix(f".{chosen}")
    if not quiet:
        note_incomplete(run)
    with progress("exporting", 1.0, quiet) as tell:
        _write(run, chosen, target, rate, picture, tell or (lambda done: None))
    if not quiet:
        say(f"wrote {target}")


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


def _write(run: Recording, chosen: str, target: Path, rate: float, picture: bool, tell: Progress) -> None:
    from softhand.export.writing import write_mcap, write_rrd
    from softhand.recording.whole_file import check_place

    if chosen == "csv":
        check_place(target)
        run.to_csv(target)
        return
    (write_mcap if chosen == "mcap" else write_rrd)(run, target, rate, picture, tell)
