"""softhand lyapunov: the function V of Theorem 1 along a run."""

from __future__ import annotations

from softhand.commands.app import command
from softhand.commands.console import Printer, progress, say_compiling
from softhand.commands.options import Json, OutBesideRun, Plugins, Quiet, Run
from softhand.commands.places import figure_of_run
from softhand.commands.runs import load_run


@command("softhand lyapunov runs/target-a")
def lyapunov(
    recording: Run,
    out: OutBesideRun = None,
    plugins: Plugins = [],  # noqa: B006  typer copies it
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Evaluate V of Theorem 1 along a run.

    Its rate beside the paper's (70), where it rises, and L of (60). The run must be one with the controller regulation.
    """
    target = figure_of_run(recording, "lyapunov.png", out)
    say_compiling(quiet)
    from softhand.closed_loop.lyapunov import lyapunov as find_lyapunov
    from softhand.plots.lyapunov import draw_lyapunov
    from softhand.plots.style import save_figure
    from softhand.recording.recorded import scenario_of

    printer = Printer(quiet, as_json)
    run = load_run(recording)
    printer.incomplete(run)
    with progress("evaluating V and L", float(len(run)), quiet) as report:
        found = find_lyapunov(run, progress=report)
    save_figure(draw_lyapunov(found, found.invariant, scenario_of(run).title), target)
    printer.json(found)
    printer.table(f"{recording}", found.rows())
    for note in found.notes():
        printer.say(note, "note")
    printer.say(f"wrote {target}")
