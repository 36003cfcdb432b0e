"""softhand plot: the figure of a recording."""

from __future__ import annotations

from softhand.commands.app import command
from softhand.commands.console import Printer
from softhand.commands.options import OutBesideRun, Plugins, Quiet, Run
from softhand.commands.places import figure_of_run
from softhand.commands.runs import load_run


@command("softhand plot runs/target-a --out grasp.pdf")
def plot(
    recording: Run,
    out: OutBesideRun = None,
    plugins: Plugins = [],  # noqa: B006  typer copies it
    quiet: Quiet = False,
) -> None:
    """Draw the figure of a recording."""
    target = figure_of_run(recording, "figure.png", out)
    from softhand.plots.run import draw_run
    from softhand.plots.style import save_figure

    printer = Printer(quiet)
    run = load_run(recording)
    printer.incomplete(run)
    save_figure(draw_run(run), target)
    printer.say(f"wrote {target}")
