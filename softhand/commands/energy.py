"""softhand energy: where the work of the joints went."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Quiet, figure_beside, print_table, say, say_compiling
from softhand.commands.runs import load_run

_POINTS = 201


@app.command(epilog="Example: softhand energy runs/target-a/run.nc")
def energy(
    recording: Annotated[Path, typer.Argument(help="A recording, run.nc.")],
    out: Annotated[
        Path | None,
        typer.Option(help="Figure to write, .png, .pdf or .svg; by default energy.png beside the recording."),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Draw the energy ledger of a run: work of the joints, kinetic, height, tips, damping, slip, and what is left."""
    target = figure_beside(recording, "energy.png", out)
    say_compiling(quiet)
    import numpy as np

    from softhand.analysis.energy import energy_ledger
    from softhand.plots.energy import draw_energy
    from softhand.plots.style import save_figure
    from softhand.recording.recorded import scenario_of

    run = load_run(recording)
    samples = np.unique(np.linspace(0, len(run) - 1, _POINTS).round().astype(int))
    ledger = energy_ledger(run, samples=samples)
    save_figure(draw_energy(ledger, scenario_of(run).title), target)
    if not quiet:
        print_table(f"{recording}", ledger.rows())
        say(f"wrote {target}")
