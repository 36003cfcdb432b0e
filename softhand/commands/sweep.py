"""softhand sweep: all runs of a study."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress, say_compiling
from softhand.commands.options import Json, Plugins, Quiet
from softhand.commands.places import check_folder, write_text

if TYPE_CHECKING:
    from softhand.studies.sweeps.result import Sweep

_MOST_ROWS = 100_000  # of runs.csv


@command("softhand sweep study.toml; softhand sweep study.toml --scheduler tcp://head:8786")
def sweep(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="A study, as docs/studies.md has them: a .toml file.")],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FOLDER", help="Where the runs are kept; by default runs/sweep-NAME."),
    ] = None,
    threads: Annotated[
        int | None, typer.Option(metavar="N", min=1, max=4096, help="Threads of this machine; by default all it has.")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="A Dask scheduler whose workers make the runs, such as tcp://head:8786."),
    ] = None,
    chunk: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, max=10**6, help="Runs in a chunk; by default as many as take a second."),
    ] = None,
    worst: Annotated[
        int, typer.Option(metavar="N", min=0, max=100, help="Of the worst runs, how many get a scenario file.")
    ] = 5,
    plugins: Plugins = [],  # noqa: B006  typer copies it
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run a scenario many times, over grids or samples of its keys.

    The runs are kept in FOLDER/runs.zarr a chunk at a time. What was interrupted goes on by the same command. Writes
    figures, runs.csv and worst/, the scenarios of the worst runs.
    """
    check_folder(out)
    say_compiling(quiet)
    from softhand.plots.style import save_figure
    from softhand.studies.sweeps.figures import draw_all
    from softhand.studies.sweeps.sweep import sweep as run
    from softhand.studies.sweeps.worst import to_csv, write_worst

    printer = Printer(quiet, as_json)
    with _Shown(study.name, quiet, printer) as shown:
        swept = run(study, out, threads, scheduler, chunk, shown)
    if not shown.worked:
        printer.say(f"all {len(swept)} runs are there already", "note")
    files = write_worst(swept, worst)
    names = []
    for name, figure in draw_all(swept, worst).items():
        save_figure(figure, swept.folder / f"{name}.png")
        names.append(f"{name}.png")
    if len(swept) <= _MOST_ROWS:
        write_text(swept.folder / "runs.csv", to_csv(swept))
        names.append("runs.csv")
    _print(swept, files, names, printer)


class _Shown:
    """How far a sweep is: what is there already is said once, and the bar is that of the rest."""

    def __init__(self, name: str, quiet: bool, printer: Printer) -> None:
        self._name, self._quiet, self._printer = name, quiet, printer
        self._bar: Any = None

    @property
    def worked(self) -> bool:
        """Whether there was anything to do."""
        return self._bar is not None

    def __enter__(self) -> _Shown:
        return self

    def __call__(self, done: int, runs: int) -> None:
        if self._bar is None:
            self._there = done
            if done:
                self._printer.say(f"{done} of {runs} runs are there already", "note")
            self._bar = progress(f"{self._name}: {runs - done} runs", float(runs - done), self._quiet)
            self._report = self._bar.__enter__()
        self._report(float(done - self._there))

    def __exit__(self, *error: Any) -> None:
        if self._bar is not None:
            self._bar.__exit__(*error)


def _print(swept: Sweep, files: dict[int, Path], names: list[str], printer: Printer) -> None:
    rate = swept.rate()
    ends = _counts(swept)
    numbers = {name: _spread(values) for name, values in swept.numbers.items()}
    units = {name: outcome.units for name, outcome in swept.study.outcomes.items()}
    printer.json({
        "runs": len(swept),
        "success": {"rate": rate.value, "low": rate.low, "high": rate.high, "confidence": 0.95},
        "ends": ends,
        "outcomes": {
            name: {**dict(zip(("p5", "median", "p95"), found, strict=True)), "unit": units[name]}
            for name, found in numbers.items()
        },
        "worst": [{"run": run, "scenario": str(file), **_told(swept, run)} for run, file in files.items()],
        "store": str(swept.store),
        "units": {"success": "1", "stop_time": "s"},
    })  # fmt: skip
    share = f"{100.0 * rate.value:.3g} %"
    rows = [("success", share, f"{100.0 * rate.low:.3g} to {100.0 * rate.high:.3g} % with 95 % confidence")]
    rows += [(name, str(count), f"of {len(swept)} runs") for name, count in ends.items()]
    rows += [
        (f"{name} [{units[name]}]", f"{found[1]:.4g}", f"median; 90 % from {found[0]:.4g} to {found[2]:.4g}")
        for name, found in numbers.items()
    ]
    printer.table(f"{swept.study.description or swept.study.scenario}", rows)
    cells = [(str(file), str(run), str(swept.outcome[run]), _values(swept, run)) for run, file in files.items()]
    if cells:
        printer.table("worst runs; softhand simulate FILE repeats one", cells, ("file", "run", "outcome", "values"))
    if len(swept) and not swept.success.any():
        printer.say("no run is a success", "note")
    printer.say(f"wrote {', '.join(names)} in {swept.folder}/; xarray.open_zarr reads {swept.store}")


def _counts(swept: Sweep) -> dict[str, int]:
    from collections import Counter

    return dict(Counter(swept.outcome.tolist()).most_common())


def _spread(values: Any) -> tuple[float, float, float]:
    """The 5th, 50th and 95th percentile of those that are finite."""
    import numpy as np

    there = values[np.isfinite(values)]
    return tuple(np.percentile(there, (5.0, 50.0, 95.0))) if len(there) else (float("nan"),) * 3


def _varied(swept: Sweep, run: int) -> dict[str, Any]:
    return {key: column[run] for key, column in swept.values.items()}


def _told(swept: Sweep, run: int) -> dict[str, Any]:
    return {
        "outcome": str(swept.outcome[run]),
        "stop_time": float(swept.stop_time[run]),
        "success": bool(swept.success[run]),
        "values": _varied(swept, run),
        **{name: float(values[run]) for name, values in swept.numbers.items()},
    }


def _values(swept: Sweep, run: int) -> str:
    return ", ".join(
        f"{key} {value:.4g}" if hasattr(value, "dtype") else f"{key} {value}"
        for key, value in _varied(swept, run).items()
    )
