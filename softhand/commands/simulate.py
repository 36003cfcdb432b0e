"""softhand simulate: run a scenario."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress, say, say_compiling
from softhand.commands.options import (
    Controller,
    Duration,
    Json,
    Law,
    OutFolder,
    Plugins,
    Quiet,
    ScenarioName,
    Set,
    Stepper,
)
from softhand.commands.places import check_folder, make_folder, name_of, new_folder, remove_old, write_text
from softhand.commands.scenarios import chosen_scenario
from softhand.commands.view import HOST, PORT, Host, OpenPage, Port, Speed, refuse_host, show_page
from softhand.errors import RecordingError, SimulationStopped

if TYPE_CHECKING:
    from softhand.assembly.resolve import Setup
    from softhand.margins.growing import Growing
    from softhand.recording.recording import Recording
    from softhand.scenario.scenario import Scenario
    from softhand.sensing.observation import Observation
    from softhand.simulation.simulation import Simulation, Watch
    from softhand.viewer.live.viewer import Viewer
    from softhand.viewer.meshcat.viewer import MeshcatViewer


@command("softhand simulate target-b --set object.mass=0.3 --stepper rk4 --out heavy")
def simulate(
    scenario: ScenarioName = "target-a",
    changes: Set = [],  # noqa: B006  typer copies it
    law: Law = None,
    controller: Controller = None,
    stepper: Stepper = None,
    duration: Duration = None,
    plot: Annotated[bool, typer.Option("--plot/--no-plot", help="Draw figure.png.")] = True,
    view: Annotated[bool, typer.Option("--view", help="Show the run in 3-D on a page, in real time.")] = False,
    meshcat: Annotated[bool, typer.Option("--meshcat", help="Show the run in meshcat, in real time.")] = False,
    speed: Speed = 1.0,
    host: Host = HOST,
    port: Port = PORT,
    open_page: OpenPage = True,
    out: OutFolder = None,
    plugins: Plugins = [],  # noqa: B006
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run a scenario; writes run.nc, figure.png and scenario.toml."""
    check_folder(out)
    chosen = chosen_scenario(scenario, changes, law, controller, stepper, {"duration": duration})
    if meshcat:
        refuse_host(host)
    window = _Window(speed, host, port, open_page, quiet, meshcat) if view or meshcat else None
    _simulate(chosen, out, name_of(scenario), plot, Printer(quiet, as_json), window)


class _Window(NamedTuple):
    """What the options of the viewer say."""

    speed: float
    host: str
    port: int
    open_page: bool
    quiet: bool
    meshcat: bool

    @contextmanager
    def watch(self, simulation: Simulation) -> Iterator[Watch]:
        """A page, as a function that shows an observation on it and holds the run back to its speed."""
        from softhand.viewer.live.pace import Pace

        pace = Pace(self.speed)
        with self._viewer(simulation) as viewer:

            def show(observation: Observation) -> None:
                viewer.show(observation)
                pace.wait(observation.time)

            show_page(viewer, self.open_page, self.quiet)
            yield show

    def _viewer(self, simulation: Simulation) -> Viewer | MeshcatViewer:
        if self.meshcat:
            from softhand.viewer.meshcat.viewer import MeshcatViewer

            return MeshcatViewer(simulation, port=self.port)
        from softhand.viewer.live.viewer import Viewer

        return Viewer(simulation, self.host, self.port)


def _simulate(
    scenario: Scenario, out: Path | None, name: str, plot: bool, printer: Printer, window: _Window | None
) -> None:
    say_compiling(printer.quiet)
    with progress(f"simulating {name}, {scenario.duration:g} s", scenario.duration, printer.quiet) as report:
        setup, simulation, grows = _prepare(scenario, printer.quiet)
        from softhand.simulation.interrupts import interrupts_held

        is_whole = scenario.record.variables is None
        plot &= is_whole
        with window.watch(simulation) if window else nullcontext() as watch:  # without a viewer there is no folder
            folder = out or new_folder(name)
            make_folder(folder)
            remove_old(folder, "run.nc", "figure.png")
            write_text(folder / "scenario.toml", simulation.scenario)
            with interrupts_held() as held:  # but for the loop
                try:
                    recording = simulation.run(report, watch)
                except SimulationStopped as stop:
                    where = _save(stop.recording, folder, plot)[0]
                    stop.say_more(_what_grew(stop, setup))
                    stop.say_more(f"\nWhat was computed until then is in {where}/.")
                    raise
                folder, files = _save(recording, folder, plot)
    if held.came:
        raise SimulationStopped(f"interrupted; the run is complete, in {folder}/", reason="interrupted")
    if is_whole:
        _print_summary(recording, simulation, folder, files, printer)
        _print_growth(recording, setup, grows, printer)
    else:  # what the summary and the figure show is not all there
        printer.json({"folder": str(folder), "files": files})
    printer.say(f"wrote {', '.join(files)} in {folder}/")


def _prepare(scenario: Scenario, quiet: bool) -> tuple[Setup, Simulation, Growing | None]:
    """Everything that a run needs; what is doubtful is told before it begins."""
    from softhand.assembly.build import assemble
    from softhand.assembly.resolve import resolve
    from softhand.assembly.target import doubts_of_target
    from softhand.checks.scenario import doubts_of_start
    from softhand.margins.growing import growing

    setup = resolve(scenario)
    grows = None if quiet else growing(setup)
    for doubt in () if quiet else (*_of_urdfs(setup), *doubts_of_start(setup), *doubts_of_target(setup)):
        say(doubt, "warning", error=True)
    if grows:
        say(f"{grows.short()} `softhand check` says what helps.", "warning", error=True)
    return setup, assemble(setup), grows


def _of_urdfs(setup: Setup) -> Iterator[str]:
    """How many warnings the URDFs have: whoever runs a scenario again and again need not read all of them."""
    from softhand.checks.scenario import warnings_of_hand

    world = setup.world
    counts = {"hand.urdf": len(warnings_of_hand(setup.asked, world.hand)), "object.urdf": len(world.object.warnings)}
    for key, count in counts.items():
        if count:
            yield f"{key}: {count} warning{'s' * (count > 1)}; `softhand check` shows {'them' if count > 1 else 'it'}."


def _what_grew(stop: SimulationStopped, setup: Setup) -> str:
    """Why a run was lost, if its loop was unstable."""
    from softhand.margins.growing import growing_run

    whole = setup.scenario.record.variables is None
    grew = growing_run(stop.recording, setup) if whole and stop.reason != "interrupted" else None
    return f"\nA likely cause: {grew.text()}" if grew else ""


def _save(recording: Recording, folder: Path, plot: bool) -> tuple[Path, list[str]]:
    """Write the results; returns the folder and the names of the files in it.

    Where the folder is gone or the disk is full, they go to a new one among the temporary files. A figure that cannot
    be written is told of, and no more.
    """
    try:
        recording.save(folder / "run.nc")
    except RecordingError as error:
        other = Path(tempfile.mkdtemp(prefix=f"softhand-{folder.name}-"))
        recording.save(other / "run.nc")
        say(f"{error}. The results are in {other}/ instead.", "note", error=True)
        write_text(other / "scenario.toml", recording.scenario)
        folder = other
    _add_collisions(recording, folder / "run.nc")
    files = ["scenario.toml", "run.nc"]
    if plot and len(recording):
        from softhand.plots.run import draw_run
        from softhand.plots.style import save_figure

        try:
            save_figure(draw_run(recording), folder / "figure.png")
            files.append("figure.png")
        except RecordingError as error:
            say(f"{error}. The recording is whole.", "note", error=True)
    return folder, files


def _add_collisions(recording: Recording, path: Path) -> None:
    """Put the collisions among the events of a file that is safe already; finding them takes time."""
    from softhand.assembly.collisions import with_collisions
    from softhand.recording.events import events_as_text, find_events

    events = with_collisions(recording, find_events(recording))
    if any(event.kind == "collision" for event in events):
        recording.attributes["events"] = events_as_text(events)
        recording.save(path)


def _print_summary(
    recording: Recording, simulation: Simulation, folder: Path, files: list[str], printer: Printer
) -> None:
    if printer.quiet and not printer.as_json:
        return
    import json

    from softhand.analysis.energy import energy_ledger
    from softhand.analysis.summary import summarize
    from softhand.recording.events import Event

    summary, events = summarize(recording), json.loads(str(recording.attributes["events"]))  # collisions among them
    is_damped = simulation.plant.pads["is_damped"].any()  # slow to sum
    energy = None if is_damped else energy_ledger(recording, simulation.plant)
    printer.json(
        {
            "folder": str(folder),
            "files": files,
            "summary": summary,
            "warnings": summary.warnings(),
            "events": events,
            "energy": energy,
        }
    )
    printer.table(f"{folder}", summary.rows())
    if energy is None:
        printer.say(f"energy since the start: softhand energy {folder}")
    else:
        printer.table("energy since the start", energy.rows())
    printer.events([Event(**event) for event in events])
    for warning in summary.warnings():
        printer.say(warning, "note")


def _print_growth(recording: Recording, setup: Setup, grows: Growing | None, printer: Printer) -> None:
    """Whether the loop grew, as was foretold or not."""
    from softhand.margins.growing import growing_run

    grew = None if printer.quiet else growing_run(recording, setup, grows)
    if grew:
        printer.say(grew.text(), "note")
