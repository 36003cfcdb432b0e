"""softhand film: the 3-D view of a recording as MP4 or GIF."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Quiet, check_file, note_incomplete, progress, say
from softhand.commands.runs import load_run
from softhand.errors import SofthandError


@app.command(epilog="Example: softhand film runs/target-a/run.nc runs/target-b/run.nc both.mp4 --size 1920x1080")
def film(
    recordings: Annotated[list[Path], typer.Argument(help="Recordings, run.nc; several are side by side.")],
    out: Annotated[Path, typer.Argument(help="Film to write, .mp4 or .gif.")],
    fps: Annotated[float, typer.Option(help="Pictures a second.")] = 30.0,
    size: Annotated[str, typer.Option(metavar="WIDTHxHEIGHT", help="Size in pixels, even numbers.")] = "1280x720",
    speed: Annotated[float, typer.Option(help="Simulated time over time of the film; 0.1 is slow motion.")] = 1.0,
    quiet: Quiet = False,
) -> None:
    """Make a film of a recording, or of several side by side; needs Chromium, and ffmpeg for .mp4."""
    from softhand.viewer.report.film import write_film

    pixels = _pixels(size)
    check_file(out)
    runs = [load_run(recording) for recording in recordings]
    for run in () if quiet else runs:
        note_incomplete(run)
    with progress("filming", 1.0, quiet) as tell:
        write_film(runs, out, fps, pixels, speed, tell or (lambda done: None))
    if not quiet:
        say(f"wrote {out}")


def _pixels(size: str) -> tuple[int, int]:
    width, _, height = size.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise SofthandError(f"size: {size!r} is no size; write it as 1280x720.", value=size)
    return int(width), int(height)
