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
    console,
    error_console,
    escape,
    make_folder,
    new_folder,
    print_events,
    print_table,
    progress,
    say_compiling,
    write_text,
)
from softhand.commands.view import HOST, PORT, Host, OpenPage, Port, Speed, refuse_host, show_page
from softhand.errors import RecordingError, SimulationStopped

if TYPE_CHECKING:
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
    from softhand.assembly.build import build
    from softhand.simulation.interrupts import interrupts_held

    simulation = build(scenario)
    is_whole = scenario.record.variables is None
    plot &= is_whole
    with window.watch(simulation) if window else nullcontext() as watch:  # a viewer that cannot start leaves no folder
        folder = out or new_folder(name)
        make_folder(folder)
        (folder / "run.nc").unlink(missing_ok=True)  # of an older run, beside a scenario that it is not of
        write_text(folder / "scenario.toml", simulation.scenario)
        try:
            with progress("simulating", scenario.duration, quiet) as report:
                recording = simulation.run(report, watch)
        except SimulationStopped as stop:
            with interrupts_held():
                folder, _ = _save(stop.recording, folder, plot)
            stop.say_more(f"\nWhat was computed until then is in {folder}/.")
            raise
    with interrupts_held() as held:
        folder, files = _save(recording, folder, plot)
    if held.came:
        raise SimulationStopped(f"interrupted; the run is complete, in {folder}/", reason="interrupted")
    if not quiet and is_whole:
        _print_summary(recording, simulation, folder, files)
    elif not quiet:  # what the summary and the figure show is not all there
        console().print(f"wrote {', '.join(files)} in {folder}/", highlight=False)


def _save(recording: Recording, folder: Path, plot: bool) -> tuple[Path, list[str]]:
    """Write the results; returns the folder and the names of the files in it.

    Where the folder is gone or the disk is full, they go to a new one among the temporary files.
    """
    try:
        recording.save(folder / "run.nc")
    except RecordingError as error:
        other = Path(tempfile.mkdtemp(prefix=f"softhand-{folder.name}-"))
        recording.save(other / "run.nc")
        message = f"{error} The results are in {other}/ instead."
        error_console().print(f"[yellow]note:[/] {escape(message)}", highlight=False, soft_wrap=True)
        write_text(other / "scenario.toml", recording.scenario)
        folder = other
    if not (plot and len(recording)):
        return folder, ["scenario.toml", "run.nc"]
    from softhand.plots.run import draw_run
    from softhand.plots.style import save_figure

    save_figure(draw_run(recording), folder / "figure.png")
    return folder, ["scenario.toml", "run.nc", "figure.png"]


def _print_summary(recording: Recording, simulation: Simulation, folder: Path, files: list[str]) -> None:
    from softhand.analysis.energy import energy_ledger
    from softhand.analysis.summary import summarize

    summary = summarize(recording)
    print_table(f"{folder}", summary.rows())
    if simulation.plant.pads["is_damped"].any():  # slow to sum
        console().print(f"energy since the start: softhand energy {folder}/run.nc", highlight=False)
    else:
        print_table("energy since the start", energy_ledger(recording, simulation.plant).rows())
    print_events(summary.events)
    for warning in summary.warnings():
        console().print(f"[yellow]note:[/] {escape(warning)}", highlight=False)
    console().print(f"wrote {', '.join(files)} in {folder}/", highlight=False)
