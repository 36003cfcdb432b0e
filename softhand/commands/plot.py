"""softhand plot: the figure of a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import figure_beside, note_incomplete, say
from softhand.commands.runs import load_run


@app.command(epilog="Example: softhand plot runs/target-a/run.nc --out grasp.pdf")
def plot(
    recording: Annotated[Path, typer.Argument(help="A recording, run.nc.")],
    out: Annotated[
        Path | None,
        typer.Option(help="Figure to write, .png, .pdf or .svg; by default figure.png beside the recording."),
    ] = None,
) -> None:
    """Draw the figure of a recording."""
    target = figure_beside(recording, "figure.png", out)
    from softhand.plots.run import draw_run
    from softhand.plots.style import save_figure

    run = load_run(recording)
    note_incomplete(run)
    save_figure(draw_run(run), target)
    say(f"wrote {target}")
