"""softhand simulate: run a scenario."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from softhand.commands.app import app
from softhand.commands.console import (
    Out,
    Plugins,
    Quiet,
    Set,
    check_folder,
    make_folder,
    new_folder,
    print_events,
    print_table,
    progress,
    remove_old,
    say,
    say_compiling,
    write_text,
)
from softhand.commands.view import HOST, PORT, Host, OpenPage, Port, Speed, refuse_host, show_page
from softhand.errors import RecordingError, SimulationStopped

if TYPE_CHECKING:
    from softhand.assembly.resolve import Setup
    from softhand.recording.recording import Recording
    from softhand.scenario.scenario import Scenario
    from softhand.sensing.observation import Observation
    from softhand.simulation.simulation import Simulation, Watch
    from softhand.viewer.live.viewer import Viewer
    from softhand.viewer.meshcat.viewer import MeshcatViewer


@app.command(epilog="Example: softhand simulate target-b --set object.mass=0.3 --stepper rk4 --out heavy")
def simulate(
    scenario: Annotated[
        str, typer.Argument(help="A scenario that ships (see: softhand list) or a .toml file.")
    ] = "target-a",
    changes: Set = [],  # noqa: B006  typer copies it
    out: Out = None,
    law: Annotated[
        str | None, typer.Option(help="Fingertip law, with its own defaults and the scenario's radius and friction.")
    ] = None,
    stepper: Annotated[str | None, typer.Option(help="Stepper, with its own defaults and the scenario's step.")] = None,
    controller: Annotated[str | None, typer.Option(help="Controller, with its own defaults.")] = None,
    duration: Annotated[float | None, typer.Option(help=r"Simulated time \[s].")] = None,
    plot: Annotated[bool, typer.Option(help="Draw figure.png.")] = True,
    view: Annotated[bool, typer.Option("--view", help="Show the run in 3-D on a page, in real time.")] = False,
    meshcat: Annotated[bool, typer.Option("--meshcat", help="Show the run in meshcat, in real time.")] = False,
    speed: Speed = 1.0,
    host: Host = HOST,
    port: Port = PORT,
    open_page: OpenPage = True,
    plugins: Plugins = [],  # noqa: B006
    quiet: Quiet = False,
) -> None:
    """Run a scenario; writes run.nc, figure.png and scenario.toml into a folder."""
    check_folder(out)
    from softhand.scenario.file import parse_override
    from softhand.scenario.scenario import load_scenario, with_law

    values = dict(parse_override(change) for change in changes)
    if duration is not None:
        values["duration"] = duration
    chosen = load_scenario(scenario, values)
    if law is not None and law != chosen.fingertip.law:
        chosen = with_law(chosen, law)
    if controller is not None and controller != chosen.controller.name:
        chosen = chosen.with_values({"controller": {"name": controller}})
    if stepper is not None and stepper != chosen.stepper.name:
        before = chosen.stepper
        chosen = chosen.with_values({"stepper": {"name": stepper, "step": before.step, "terms": before.terms}})
    if meshcat:
        refuse_host(host)
    window = _Window(speed, host, port, open_page, quiet, meshcat) if view or meshcat else None
    _simulate(chosen, out, Path(scenario).stem, plot, quiet, window)


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


def _simulate(scenario: Scenario, out: Path | None, name: str, plot: bool, quiet: bool, window: _Window | None) -> None:
    say_compiling(quiet)
    from softhand.assembly.build import assemble
    from softhand.assembly.resolve import resolve
    from softhand.checks.target import doubts_of_target
    from softhand.closed_loop.growing import growing, growing_run
    from softhand.simulation.interrupts import interrupts_held

    setup = resolve(scenario)
    is_whole = scenario.record.variables is None
    plot &= is_whole
    grows = None if quiet else growing(setup)
    for doubt in () if quiet else doubts_of_target(setup):
        say(doubt, "warning", error=True)
    if grows:
        say(f"{grows.short()} `softhand check` says what helps.", "warning", error=True)
    simulation = assemble(setup)
    with window.watch(simulation) if window else nullcontext() as watch:  # a viewer that cannot start leaves no folder
        folder = out or new_folder(name)
        make_folder(folder)
        remove_old(folder, "run.nc", "figure.png")
        write_text(folder / "scenario.toml", simulation.scenario)
        with interrupts_held() as held:  # but for the loop
            try:
                with progress("simulating", scenario.duration, quiet) as report:
                    recording = simulation.run(report, watch)
            except SimulationStopped as stop:
                where = _save(stop.recording, folder, plot)[0]
                stop.say_more(_what_grew(stop, setup))
                stop.say_more(f"\nWhat was computed until then is in {where}/.")
                raise
            folder, files = _save(recording, folder, plot)
    if held.came:
        raise SimulationStopped(f"interrupted; the run is complete, in {folder}/", reason="interrupted")
    if not quiet and is_whole:
        _print_summary(recording, simulation, folder, files)
        grew = growing_run(recording, setup, grows)
        if grew:
            say(grew.text(), "note")
    elif not quiet:  # what the summary and the figure show is not all there
        say(f"wrote {', '.join(files)} in {folder}/")


def _what_grew(stop: SimulationStopped, setup: Setup) -> str:
    """Why a run was lost, if its loop was unstable."""
    from softhand.closed_loop.growing import growing_run

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


def _print_summary(recording: Recording, simulation: Simulation, folder: Path, files: list[str]) -> None:
    from softhand.analysis.energy import energy_ledger
    from softhand.analysis.summary import summarize

    summary = summarize(recording)
    print_table(f"{folder}", summary.rows())
    if simulation.plant.pads["is_damped"].any():  # slow to sum
        say(f"energy since the start: softhand energy {folder}/run.nc")
    else:
        print_table("energy since the start", energy_ledger(recording, simulation.plant).rows())
    print_events(summary.events)
    for warning in summary.warnings():
        say(warning, "note")
    say(f"wrote {', '.join(files)} in {folder}/")
