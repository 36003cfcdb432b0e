"""softhand stability: how fast small motions grow, what moves in them, and how far the loop is from being lost."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress, say_compiling
from softhand.commands.options import Controller, Json, Law, OutFigure, Plugins, Quiet, ScenarioOrRun, Set
from softhand.commands.places import check_figure, check_new, figure_of, figure_of_run, free_file, name_of
from softhand.commands.runs import is_run, load_run
from softhand.commands.scenarios import chosen_scenario, refuse_changes
from softhand.errors import ScenarioError

if TYPE_CHECKING:
    from softhand.margins.stability import Stability
    from softhand.recording.recording import Recording
    from softhand.scenario.scenario import Scenario


@command(
    "softhand stability hold --margins; softhand stability target-a --mode 1 --mode-out mode.nc; "
    "softhand stability grasp-and-lift --along --out along.pdf; softhand stability runs/hold --at 0.5"
)
def stability(
    scenario: ScenarioOrRun = "target-a",
    at: Annotated[
        str | None,
        typer.Option(
            metavar="WHERE",
            help="start, end, or a time of the run [s]; by default the start of a scenario and the end of a run.",
        ),
    ] = None,
    margins: Annotated[
        bool, typer.Option("--margins", help="Find delay, control period, gains and torques at which the loop is lost.")
    ] = False,
    along: Annotated[bool, typer.Option("--along", help="Look at samples along the whole run.")] = False,
    scan: Annotated[
        bool,
        typer.Option("--scan", help="Scan K_O of regulation against the stiffness of the tips, in a second figure."),
    ] = False,
    mode: Annotated[int, typer.Option(metavar="K", help="Mode for --mode-out; 1 is the fastest growing.")] = 1,
    mode_out: Annotated[
        Path | None,
        typer.Option(metavar="FILE.nc", help="Write a mode, slowly and enlarged, as a recording for view and film."),
    ] = None,
    changes: Set = [],  # noqa: B006  typer copies it
    law: Law = None,
    controller: Controller = None,
    out: OutFigure = None,
    plugins: Plugins = [],  # noqa: B006
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say how fast small motions grow, and what moves in them.

    About the start of a scenario, the end of a run, or any time of it: growth, ringing and damping of each mode, with
    --margins how far the loop is from where it is lost.
    """
    of_run = is_run(scenario)
    if of_run:
        refuse_changes(scenario, set=changes, law=law, controller=controller)
    if along and (margins or scan or at or mode_out):
        raise ScenarioError(
            "--along: looks at growth alone, all along the run; leave out --margins, --scan, --at and --mode-out.",
            key="along", value=True,
        )  # fmt: skip
    check_figure(out)
    if mode_out is not None:
        if mode_out.suffix != ".nc":
            raise ScenarioError(
                f"--mode-out: got {mode_out}; a recording ends in .nc.", key="mode-out", value=str(mode_out)
            )
        check_new(mode_out)
    printer = Printer(quiet, as_json)
    where = _where(at)
    source = load_run(scenario) if of_run else chosen_scenario(scenario, changes, law, controller)
    say_compiling(quiet)
    if along:
        _along(scenario, source, out, printer)
        return
    from softhand.margins.stability import stability as find_stability
    from softhand.plots.modes import draw_modes
    from softhand.plots.style import save_figure

    with progress(f"linearising {scenario}", 1.0, quiet) as report:
        found = find_stability(source, scan, report, at=where, with_margins=margins)
    shown = found.mode_recording(mode) if mode_out else None
    printer.json(found)
    printer.table(scenario, found.rows())
    target = _figure(scenario, out)
    save_figure(draw_modes(found, f"Small motions about {found.where} of {name_of(scenario)}"), target)
    printer.say(f"wrote {target}")
    _write_scan(found, scenario, target, printer)
    if shown is not None and mode_out is not None:
        shown.save(mode_out)
        printer.say(f"wrote {mode_out}, for softhand view and softhand film")


def _where(at: str | None) -> str | float | None:
    if at is None or at in ("start", "end"):
        return at
    try:
        return float(at)
    except ValueError:
        return at  # refused with what is allowed


def _figure(name: str, out: Path | None) -> Path:
    return figure_of_run(Path(name), "stability.png", out) if is_run(name) else figure_of(name, "stability", out)


def _along(name: str, source: Scenario | Recording, out: Path | None, printer: Printer) -> None:
    from softhand.margins.along import stability_along
    from softhand.plots.stability_along import draw_stability_along
    from softhand.plots.style import save_figure

    with progress(f"linearising {name} along its run", 1.0, printer.quiet) as report:
        found = stability_along(source, progress=report)
    printer.json(found)
    printer.table(name, found.rows())
    for note in found.notes:
        printer.say(note, "note")
    target = _figure(name, out)
    save_figure(draw_stability_along(found, f"Growth of small motions along {name_of(name)}"), target)
    printer.say(f"wrote {target}")


def _write_scan(found: Stability, name: str, beside: Path, printer: Printer) -> None:
    if found.scan is None:
        return
    from softhand.plots.stability import draw_scan
    from softhand.plots.style import save_figure

    target = free_file(beside.with_stem(f"{beside.stem}-scan"))
    title = f"Where regulation is lost, about the start of {name_of(name)}"
    save_figure(draw_scan(found.scan, title, found.period), target)
    printer.say(f"wrote {target}")
