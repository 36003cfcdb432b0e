"""softhand film: the 3-D view of a recording as MP4 or GIF."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress
from softhand.commands.options import OutFile, Plugins, Quiet
from softhand.commands.places import beside_run
from softhand.commands.runs import load_run
from softhand.errors import SofthandError


@command("softhand film runs/target-a --out grasp.mp4 --speed 0.25 --size 1920x1080")
def film(
    recordings: Annotated[
        list[Path],
        typer.Argument(metavar="RUN...", help="Recordings, run.nc, or their folders; several are side by side."),
    ],
    out: OutFile = None,
    fps: Annotated[float, typer.Option(metavar="HZ", help="Pictures a second.")] = 30.0,
    size: Annotated[str, typer.Option(metavar="WIDTHxHEIGHT", help="Size in pixels, even numbers.")] = "1280x720",
    speed: Annotated[
        float, typer.Option(metavar="FACTOR", help="Simulated time over time of the film; 0.1 is slow motion.")
    ] = 1.0,
    plugins: Plugins = [],  # noqa: B006  typer copies it
    quiet: Quiet = False,
) -> None:
    """Make a film, .mp4 or .gif.

    Several recordings are side by side. It needs Chromium, and ffmpeg for .mp4. Without --out it is film.mp4 beside the
    first recording.
    """
    from softhand.viewer.report.film import write_film

    pixels = _pixels(size)
    target = beside_run(recordings[0], "film.mp4", out)
    printer = Printer(quiet)
    runs = [load_run(recording) for recording in recordings]
    printer.incomplete(*runs)
    with progress(f"filming {', '.join(map(str, recordings))}", 1.0, quiet) as tell:
        write_film(runs, target, fps, pixels, speed, tell)
    printer.say(f"wrote {target}")


def _pixels(size: str) -> tuple[int, int]:
    width, _, height = size.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise SofthandError(f"size: {size!r} is no size; write it as 1280x720.", value=size)
    return int(width), int(height)
