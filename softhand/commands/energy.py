"""softhand energy: where the work of the joints went."""

from __future__ import annotations

from softhand.commands.app import command
from softhand.commands.console import Printer, progress, say_compiling
from softhand.commands.options import Json, OutBesideRun, Plugins, Quiet, Run
from softhand.commands.places import figure_of_run
from softhand.commands.runs import load_run

_POINTS = 201


@command("softhand energy runs/target-a")
def energy(
    recording: Run,
    out: OutBesideRun = None,
    plugins: Plugins = [],  # noqa: B006  typer copies it
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Draw where the work of the joints went.

    Into motion, height, the tips, their damping and slip; and what is left.
    """
    target = figure_of_run(recording, "energy.png", out)
    say_compiling(quiet)
    import numpy as np

    from softhand.analysis.energy import energy_ledger
    from softhand.plots.energy import draw_energy
    from softhand.plots.style import save_figure
    from softhand.recording.recorded import scenario_of

    printer = Printer(quiet, as_json)
    run = load_run(recording)
    printer.incomplete(run)
    samples = np.unique(np.linspace(0, len(run) - 1, _POINTS).round().astype(int))
    with progress(f"summing the energy of {recording}", 1.0, quiet):
        ledger = energy_ledger(run, samples=samples)
    save_figure(draw_energy(ledger, scenario_of(run).title), target)
    printer.json(ledger)
    printer.table(f"{recording}", ledger.rows())
    printer.say(f"wrote {target}")
