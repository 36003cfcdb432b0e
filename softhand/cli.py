"""The command `softhand`: reads what is asked, calls the library, prints. No physics here.

What a command needs is imported when it runs, so that `--help` answers at once.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from softhand.errors import ScenarioError, SimulationStopped, SofthandError

if TYPE_CHECKING:
    from softhand.recording import Recording
    from softhand.reproduce import Reproduction
    from softhand.scenario import Scenario
    from softhand.simulation import Progress

INTERRUPTED = 130

app = typer.Typer(
    name="softhand",
    help="Simulate and control robot hands with soft fingertips.",
    epilog="Example: softhand simulate target-b --set fingertip.friction=0.6",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Set = Annotated[
    list[str],
    typer.Option("--set", metavar="KEY=VALUE", help="Change a value of the scenario, in TOML; may be repeated."),
]
Out = Annotated[Path | None, typer.Option(help="Folder for the results; by default a new one below runs/.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]


@app.command(epilog="Example: softhand simulate target-b --set object.mass=0.3 --stepper rk4 --out heavy")
def simulate(
    scenario: Annotated[
        str, typer.Argument(help="A scenario that ships (see: softhand list) or a .toml file.")
    ] = "target-a",
    changes: Set = [],  # noqa: B006  typer copies it
    out: Out = None,
    stepper: Annotated[str | None, typer.Option(help="Stepper, with its own defaults and the scenario's step.")] = None,
    controller: Annotated[str | None, typer.Option(help="Controller, with its own defaults.")] = None,
    duration: Annotated[float | None, typer.Option(help="Simulated time [s].")] = None,
    plot: Annotated[bool, typer.Option(help="Draw figure.png.")] = True,
    quiet: Quiet = False,
) -> None:
    """Run a scenario; writes run.nc, figure.png and scenario.toml into a folder."""
    from softhand.scenario import load_scenario
    from softhand.scenario_file import parse_override

    values = dict(parse_override(change) for change in changes)
    if duration is not None:
        values["duration"] = duration
    chosen = load_scenario(scenario, values)
    if controller is not None and controller != chosen.controller.name:
        chosen = chosen.with_values({"controller": {"name": controller}})
    if stepper is not None and stepper != chosen.stepper.name:
        chosen = chosen.with_values({"stepper": {"name": stepper, "step": chosen.stepper.step}})
    _simulate(chosen, out or _new_folder(Path(scenario).stem), plot, quiet)


def _simulate(scenario: Scenario, folder: Path, plot: bool, quiet: bool) -> None:
    _say_compiling(quiet)
    from softhand.assembly import build

    simulation = build(scenario)
    _make_folder(folder)
    _write_text(folder / "scenario.toml", simulation.scenario)
    try:
        with _progress("simulating", scenario.duration, quiet) as report:
            recording = simulation.run(report)
    except SimulationStopped as stop:
        _save(stop.recording, folder, plot)  # type: ignore[attr-defined]
        stop.args = (f"{stop}\nWhat was computed until then is in {folder}/.",)
        raise
    files = _save(recording, folder, plot)
    if not quiet:
        _print_summary(recording, folder, files)


def _save(recording: Recording, folder: Path, plot: bool) -> list[str]:
    """Write the results; returns the names of the files in the folder."""
    recording.save(folder / "run.nc")
    if not (plot and len(recording)):
        return ["scenario.toml", "run.nc"]
    from softhand.plots import draw_run, save_figure

    save_figure(draw_run(recording), folder / "figure.png")
    return ["scenario.toml", "run.nc", "figure.png"]


@app.command("list", epilog="Example: softhand list controllers")
def list_names(
    what: Annotated[str | None, typer.Argument(help="scenarios, laws, controllers or steppers; all without.")] = None,
) -> None:
    """List scenarios, fingertip laws, controllers and steppers."""
    from softhand.plugins import SHIPPED, describe_plugin, plugin_names
    from softhand.scenario import load_scenario
    from softhand.scenario_file import scenario_names

    kinds = ["scenarios", *SHIPPED]
    if what is not None and what not in kinds:
        raise ScenarioError(f"There is no list of {what!r}; choose from {', '.join(kinds)}.", key="list", value=what)
    for kind in [what] if what else kinds:
        if kind == "scenarios":
            rows = [(name, load_scenario(name).description) for name in scenario_names()]
        else:
            rows = [(name, describe_plugin(kind, name)) for name in plugin_names(kind)]
        _print_table(kind, rows)


@app.command(epilog="Example: softhand plot runs/target-a/run.nc --out grasp.pdf")
def plot(
    recording: Annotated[Path, typer.Argument(help="A recording, run.nc.")],
    out: Annotated[
        Path | None,
        typer.Option(help="Figure to write, .png, .pdf or .svg; by default figure.png beside the recording."),
    ] = None,
) -> None:
    """Draw the figure of a recording."""
    from softhand.plots import draw_run, save_figure
    from softhand.recording import Recording

    target = out or recording.parent / "figure.png"
    save_figure(draw_run(Recording.load(recording)), target)
    _console().print(f"wrote {target}", highlight=False)


@app.command(epilog="Example: softhand reproduce --out paper")
def reproduce(out: Out = None, quiet: Quiet = False) -> None:
    """Make the paper's simulation figure anew: targets A and B, with and without torsion compensation."""
    _say_compiling(quiet)
    from softhand.plots import save_figure
    from softhand.reproduce import RUNS, draw, reproduce

    folder = out or _new_folder("reproduce")
    _make_folder(folder)
    with _progress("reproducing", float(RUNS), quiet) as report:
        result = reproduce(report)
    for name, figure in draw(result).items():
        save_figure(figure, folder / f"{name}.png")
    if not quiet:
        _print_reproduction(result)
        _console().print(f"wrote {folder}/minimum-jerk.png, step.png", highlight=False)


def main() -> None:
    """Entry point: errors that a user can mend become one message and a nonzero exit code."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        app()
    except SofthandError as error:
        _error_console().print(f"[bold red]error:[/] {_escape(str(error))}", highlight=False, soft_wrap=True)
        sys.exit(INTERRUPTED if getattr(error, "reason", "") == "interrupted" else 1)
    except KeyboardInterrupt:
        _error_console().print("interrupted", highlight=False)
        sys.exit(INTERRUPTED)


def _console() -> Any:
    from rich.console import Console

    return Console()


def _error_console() -> Any:
    from rich.console import Console

    return Console(stderr=True)


def _escape(text: str) -> str:
    from rich.markup import escape

    return escape(text)


def _say_compiling(quiet: bool) -> None:
    from softhand.compiled import is_first_run

    if not quiet and is_first_run():
        _error_console().print("First run: compiling the contact kernels, once, for some seconds ...", highlight=False)


@contextmanager
def _progress(what: str, total: float, quiet: bool) -> Iterator[Progress | None]:
    if quiet:
        yield None
        return
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=_error_console(), transient=True) as bar:
        task = bar.add_task(what, total=total)
        yield lambda done: bar.update(task, completed=done)


def _print_summary(recording: Recording, folder: Path, files: list[str]) -> None:
    from softhand.analysis.summary import summarize

    summary = summarize(recording)
    _print_table(f"{folder}", summary.rows())
    for warning in summary.warnings():
        _console().print(f"[yellow]note:[/] {_escape(warning)}", highlight=False)
    _console().print(f"wrote {', '.join(files)} in {folder}/", highlight=False)


def _print_reproduction(result: Reproduction) -> None:
    from rich import box
    from rich.table import Table

    from softhand.reproduce import CAPTION, COLUMNS

    table = Table(box=box.SIMPLE_HEAD, caption=CAPTION, caption_justify="left", caption_style="dim")
    for name in COLUMNS:
        table.add_column(_escape(name), no_wrap=name != COLUMNS[-1])
    for row in result.rows():
        table.add_row(*map(_escape, row), style="" if any(row[1:]) else "bold")
    _console().print(table)


def _print_table(title: str, rows: list[tuple[str, str]]) -> None:
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, show_header=False)
    for row in rows:
        table.add_row(*map(_escape, row))
    _console().print(table)


def _new_folder(name: str) -> Path:
    """runs/NAME, or the first of runs/NAME-2, runs/NAME-3, ... that is not there."""
    folder, count = Path("runs") / name, 2
    while folder.exists():
        folder, count = Path("runs") / f"{name}-{count}", count + 1
    return folder


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SofthandError(
            f"{folder}: cannot make this folder: {error.strerror}; choose another with --out."
        ) from error


def _write_text(file: Path, text: str) -> None:
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise SofthandError(
            f"{file}: cannot be written: {error.strerror}; choose another folder with --out."
        ) from error
