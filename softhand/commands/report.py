"""softhand report: one HTML file with film, curves and numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress
from softhand.commands.options import OutFile, Plugins, Quiet
from softhand.commands.places import beside_run
from softhand.commands.runs import load_run


@command("softhand report runs/target-a runs/target-b --out both.html")
def report(
    recordings: Annotated[
        list[Path],
        typer.Argument(metavar="RUN", help="Recordings, run.nc, or their folders; several share one clock."),
    ],
    out: OutFile = None,
    plugins: Plugins = [],  # noqa: B006  typer copies it
    quiet: Quiet = False,
) -> None:
    """Make one HTML file with film, curves and numbers.

    It works offline. Without --out it is report.html beside the first recording.
    """
    from softhand.viewer.report.report import check_report, write_report

    target = beside_run(recordings[0], "report.html", out)
    check_report(target)
    printer = Printer(quiet)
    runs = [load_run(recording) for recording in recordings]
    printer.incomplete(*runs)
    with progress(f"making {target}", 1.0, quiet) as tell:
        write_report(target, *runs, progress=tell)
    printer.say(f"wrote {target}")
