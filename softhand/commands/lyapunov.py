"""softhand lyapunov: the function V of Theorem 1 along a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Quiet, figure_beside, print_table, progress, say, say_compiling
from softhand.commands.runs import load_run


@app.command(epilog="Example: softhand lyapunov runs/target-a/run.nc")
def lyapunov(
    recording: Annotated[Path, typer.Argument(help="A recording, run.nc, of a run with the controller regulation.")],
    out: Annotated[
        Path | None,
        typer.Option(help="Figure to write, .png, .pdf or .svg; by default lyapunov.png beside the recording."),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Evaluate V of Theorem 1 along a run: its rate against the paper's (70), where it rises, and L of (60)."""
    target = figure_beside(recording, "lyapunov.png", out)
    say_compiling(quiet)
    from softhand.closed_loop.lyapunov import lyapunov as find_lyapunov
    from softhand.plots.lyapunov import draw_lyapunov
    from softhand.plots.style import save_figure
    from softhand.recording.recorded import scenario_of

    run = load_run(recording)
    with progress("evaluating V and L", float(len(run)), quiet) as report:
        found = find_lyapunov(run, progress=report)
    save_figure(draw_lyapunov(found, found.invariant, scenario_of(run).title), target)
    if not quiet:
        print_table(f"{recording}", found.rows())
        for note in found.notes():
            say(note, "note")
        say(f"wrote {target}")
