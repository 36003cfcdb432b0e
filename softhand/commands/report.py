"""softhand report: one HTML file with film, curves and numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Quiet, check_file, note_incomplete, progress, say
from softhand.commands.runs import load_run


@app.command(epilog="Example: softhand report runs/target-a/run.nc runs/target-b/run.nc --out both.html")
def report(
    recordings: Annotated[list[Path], typer.Argument(help="Recordings, run.nc; several share one clock.")],
    out: Annotated[
        Path | None, typer.Option(help="File to write; by default report.html beside the first recording.")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Make one HTML file with the 3-D film, curves and numbers; it works offline."""
    from softhand.viewer.report.report import write_report

    target = out or recordings[0].parent / "report.html"
    if out is not None or recordings[0].exists():  # one that is missing is told when it is read
        check_file(target)
    runs = [load_run(recording) for recording in recordings]
    if not quiet:
        note_incomplete(*runs)
    with progress("making the report", 1.0, quiet) as tell:
        write_report(target, *runs, progress=tell or (lambda done: None))
    if not quiet:
        say(f"wrote {target}")
