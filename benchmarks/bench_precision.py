"""Work against precision: error over wall time, all steppers of softhand and the integrators of MuJoCo.

Target A with the law (59) compiled on both sides, its torque held for 1 ms, steps of 1 ms and less, for the
minimum-jerk and the step reference. Each side is compared with its own converged run, for their contacts are different
models: softhand with its error-controlled stepper at a tight tolerance, MuJoCo with RK4 and a tight contact solver at
1/64 ms. The error is the largest deviation of the object's position and orientation among the samples of every 10 ms.
The wall time is that of the whole loop with control, without recording, the best of some passes. MuJoCo runs with its
default feature flags.

A run that loses a contact, leaves the range of the fingertip model or diverges has no error; the table says what
happened. MuJoCo's `RK4` also runs with a contact solver tighter than the default, which otherwise limits its accuracy.

The last table shows which methods hold tips that are 100 times stiffer at 1 ms. There the gain K_N is 1: with 1.5 the
loop that is sampled at 1 ms is itself unstable with such tips, as the error-controlled run shows.

Example: python benchmarks/bench_precision.py --json precision.json --plot precision.png
"""

from __future__ import annotations

import argparse
import gc
import json
import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from bench_step import MUJOCO, PERIOD, SOFTHAND, MujocoSide, SofthandSide, stay_on_one_core, versions
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator
from mujoco_scene import INTEGRATORS, Void
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import Progress
from rich.table import Column, Table

import softhand
from softhand.plots.style import STYLE, WARNING
from softhand.plugins import SHIPPED, find_plugin

Array = NDArray[np.float64]

KINDS = ("minimum-jerk", "step")
DIVISORS = (1, 2, 4, 8, 16)  # steps a control period
TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9)  # of steppers with error control
TIGHT = 1e-11
FINEST = 64  # steps of MuJoCo's converged run in a control period
SAMPLE = 10  # control periods
PIECE = 50  # control periods that are timed together
CLOSE = 1.2  # wall times that count as equal where none is fast enough
STIFFER = 100.0
STIFF_GAIN = 1.0  # K_N of the runs with stiff tips
MUJOCO_METHODS = {name: (name, None) for name in INTEGRATORS} | {"RK4, tight solver": ("RK4", 1e-12)}
CONVERGED = "RK4", 1e-14
HEADLINE = "implicitfast"  # the integrator whose wall time and error at 1 ms the headline is about
COLOURS = ("#0072B2", "#009E73", "#56B4E9", "#CC79A7", "#7CCBB2", "#332288")
MUJOCO_COLOURS = ("#D55E00", "#E69F00", "#A50026", "#882255")


@dataclass
class Run:
    """One run and what came out.

    Attributes:
        kind: of the reference.
        side: who.
        method: stepper or integrator.
        setting: step [s], or tolerance of a stepper with error control.
        runner: a side of its own.
        advance: its method that does so many control periods.
        periods: control periods of the run.
        poses: position [m] and quaternion of the object every 10 ms, shape (samples, 7); None if the run failed.
        failure: what happened, if it failed.
        pieces: best wall time so far of each stretch of 50 control periods [s].
        position_error: [m], NaN if there is none.
        orientation_error: [rad], NaN if there is none.
    """

    kind: str
    side: str
    method: str
    setting: float
    runner: Any
    advance: Callable[[int], None]
    periods: int
    poses: Array | None = None
    failure: str = ""
    pieces: Array | None = None
    position_error: float = math.nan
    orientation_error: float = math.nan

    def check(self) -> Run:
        """Run with checks after each control period, and leave the poses or the failure."""
        poses = []
        self.runner.reset()
        try:
            for k in range(self.periods):
                self.advance(1)
                self.runner.check()
                if (k + 1) % SAMPLE == 0:
                    poses.append(self.runner.object_pose())
            self.poses = np.array(poses)
        except softhand.SimulationStopped as failure:
            self.failure = f"stops ({failure.reason}) after {1e3 * failure.time:.3g} ms"
        except Void as failure:
            self.failure = str(failure)
        return self

    def compare(self, converged: Run) -> Run:
        """Find the errors."""
        if self.poses is not None and converged.poses is not None:
            self.position_error, self.orientation_error = deviation(self.poses, converged.poses)
        return self

    @property
    def wall(self) -> float:
        """Wall time of a simulated second [s]: the best pieces together, for the machine may do other work too."""
        return math.nan if self.pieces is None else float(np.sum(self.pieces)) / (self.periods * PERIOD)

    def time(self) -> None:
        """Time it once more, if it is healthy."""
        if self.poses is None:
            return
        pieces = []
        self.runner.reset()
        gc.collect()
        gc.disable()
        try:
            for _ in range(self.periods // PIECE):
                began = time.perf_counter()
                self.advance(PIECE)
                pieces.append(time.perf_counter() - began)
        finally:
            gc.enable()
        self.pieces = np.array(pieces) if self.pieces is None else np.minimum(self.pieces, pieces)


def deviation(poses: Array, others: Array) -> tuple[float, float]:
    """Largest distance [m] and angle [rad] between poses, each of shape (samples, 7)."""
    distance = np.linalg.norm(poses[:, :3] - others[:, :3], axis=1)
    w, x, y, z = others[:, 3:].T
    left = np.stack([np.stack([-x, w, z, -y]), np.stack([-y, -z, w, x]), np.stack([-z, y, -x, w])])
    sine = np.linalg.norm(np.einsum("ijs,sj->si", left, poses[:, 3:]), axis=1)  # vector part of conj(other) * pose
    return float(distance.max()), float(2.0 * np.arcsin(np.minimum(sine, 1.0)).max())


# Runs ----------------------------------------------------------------------------------------------------------------


def softhand_run(scenario: softhand.Scenario, method: str, setting: float) -> Run:
    """A run with a stepper; `setting` is its step, or its tolerance if it controls its error."""
    stepper: dict[str, Any] = {"name": method, "step": setting}
    if has_tolerance(method):
        stepper = {"name": method, "step": PERIOD, "rtol": setting, "atol": 1e-2 * setting}
    side = SofthandSide(scenario.with_values({"stepper": stepper}))
    return _run(scenario, SOFTHAND, method, setting, side, side.run_control)


def mujoco_run(scenario: softhand.Scenario, method: str, step: float) -> Run:
    """A run with a method of `MUJOCO_METHODS`, or the converged one."""
    integrator, tolerance = MUJOCO_METHODS.get(method, CONVERGED)
    side = MujocoSide(softhand.build(scenario), scenario, step, integrator)
    if tolerance is not None:
        side.scene.model.opt.tolerance = tolerance
    advance = side.run_compiled_forward if integrator == "RK4" else side.run_compiled  # RK4 cannot be split
    return _run(scenario, MUJOCO, method, step, side, advance)


def _run(
    scenario: softhand.Scenario, side: str, method: str, setting: float, runner: Any, advance: Callable[[int], None]
) -> Run:
    periods = round(scenario.duration / PERIOD)
    return Run(scenario.reference.kind, side, method, setting, runner, advance, periods)


def has_tolerance(method: str) -> bool:
    """Whether a stepper of softhand controls its error."""
    return "rtol" in find_plugin("steppers", method, "stepper.name").model_fields


def exact_stepper() -> str:
    """The stepper of softhand that others are judged by."""
    return next(name for name in SHIPPED["steppers"] if has_tolerance(name))


def run_all(scenario: softhand.Scenario, divisors: Sequence[int], passes: int, console: Console) -> list[Run]:
    """All runs with their errors, for one reference; timed in passes over all of them."""
    steps = [PERIOD / divisor for divisor in divisors]
    runs = [
        softhand_run(scenario, name, setting)
        for name in SHIPPED["steppers"]
        for setting in (TOLERANCES if has_tolerance(name) else steps)
    ] + [mujoco_run(scenario, name, step) for name in MUJOCO_METHODS for step in steps]
    exact = [
        softhand_run(scenario, exact_stepper(), TIGHT),
        mujoco_run(scenario, "converged", PERIOD / FINEST),
    ]
    with Progress(console=console, transient=True) as progress:
        bar = progress.add_task(scenario.reference.kind, total=len(exact) + (1 + passes) * len(runs))
        for run in exact + runs:
            run.check()
            progress.advance(bar)
        converged = {run.side: run for run in exact}
        for run in runs:
            run.compare(converged[run.side])
        for _ in range(passes):
            for run in runs:
                run.time()
                progress.advance(bar)
    return runs


def run_stiff(scenario: softhand.Scenario) -> list[Run]:
    """All methods at 1 ms with tips that are 100 times stiffer; errors on softhand's side only."""
    stiffness = {key: value for key, value in scenario.fingertip.parameters.items() if key.startswith("k_")}
    scenario = scenario.with_values(
        {f"fingertip.{key}": STIFFER * value for key, value in stiffness.items()} | {"controller.K_N": STIFF_GAIN}
    )
    converged = softhand_run(scenario, exact_stepper(), 1e-9).check()
    steppers = [name for name in SHIPPED["steppers"] if not has_tolerance(name)]
    runs = [softhand_run(scenario, name, PERIOD).check().compare(converged) for name in steppers]
    return runs + [mujoco_run(scenario, name, PERIOD).check() for name in INTEGRATORS] + [converged]


# Results -------------------------------------------------------------------------------------------------------------


def error_at(runs: Sequence[Run], wall: float) -> tuple[float, float, str]:
    """The best that softhand does in a wall time.

    Args:
        runs: of one reference.
        wall: wall time of a simulated second [s].

    Returns:
        Error [m], on the log-log line between the runs of a stepper; the wall time that it belongs to [s], that of
        the best among the fastest runs if none is as fast as asked; the stepper.
    """
    ours = [run for run in runs if run.side == SOFTHAND and run.poses is not None]
    fastest = min(run.wall for run in ours)
    if fastest > wall:
        return min((run.position_error, run.wall, run.method) for run in ours if run.wall < CLOSE * fastest)
    best = math.inf, wall, ""
    for method in dict.fromkeys(run.method for run in ours):
        curve = sorted((run.wall, run.position_error) for run in ours if run.method == method)
        if curve[0][0] <= wall:
            walls, errors = np.log(curve).T
            best = min(best, (float(np.exp(np.interp(math.log(wall), walls, errors))), wall, method))
    return best


def headlines(runs: Sequence[Run]) -> list[dict[str, Any]]:
    """softhand's error at MuJoCo's wall times for steps of 1 ms, for the runs of MuJoCo that hold."""
    found = []
    for run in runs:
        if run.side == MUJOCO and run.setting == PERIOD and run.poses is not None:
            error, wall, stepper = error_at(runs, run.wall)
            found.append(
                {
                    "reference": run.kind,
                    "mujoco_method": run.method,
                    "mujoco_wall_per_second": run.wall,
                    "mujoco_error": run.position_error,
                    "softhand_stepper": stepper,
                    "softhand_wall_per_second": wall,
                    "softhand_error": error,
                    "factor": run.position_error / error,
                }
            )
    return found


def compare(factor: float) -> str:
    """In words."""
    return f"{factor:.3g} times smaller" if factor >= 1.0 else f"{1.0 / factor:.3g} times larger"


def print_headlines(kind: str, runs: Sequence[Run], console: Console) -> None:
    """One sentence for each integrator of MuJoCo."""
    lines = headlines(runs)
    if not lines:
        console.print(f"{kind}: no comparison, no run of MuJoCo at 1 ms is valid")
    for line in lines:
        theirs, ours = 1e3 * line["mujoco_wall_per_second"], 1e3 * line["softhand_wall_per_second"]
        where = "in that time" if ours == theirs else f"at its fastest, {ours:.1f} ms,"
        text = (
            f"{kind}: MuJoCo {line['mujoco_method']} at 1 ms takes {theirs:.1f} ms a second, error "
            f"{1e6 * line['mujoco_error']:.3g} um; softhand {line['softhand_stepper']} {where} has "
            f"{1e6 * line['softhand_error']:.3g} um: {compare(line['factor'])}"
        )
        console.print(text, style="bold" if line["mujoco_method"] == HEADLINE else None)


def draw_table(runs: Sequence[Run]) -> Table:
    """Errors and wall times. A method that fails at all steps has one line, for its smallest step."""
    numbers = [Column(name, justify="right") for name in ("ms/s", "um", "deg")]
    table = Table("", "", *numbers, "", title=f"Target A, {runs[0].kind}: wall time and error")
    for side, method in methods(runs):
        own = [run for run in runs if (run.side, run.method) == (side, method)]
        if all(run.failure for run in own):
            table.add_row(f"{side} {method}", "all steps", "", "", "", own[-1].failure)
        else:
            for k, run in enumerate(own):
                table.add_row("" if k else f"{side} {method}", describe(run), *_numbers(run), run.failure)
        table.add_section()
    return table


def methods(runs: Sequence[Run]) -> list[tuple[str, str]]:
    """Side and method of the runs, each once."""
    return list(dict.fromkeys((run.side, run.method) for run in runs))


def _numbers(run: Run) -> tuple[str, str, str]:
    if run.poses is None:
        return "", "", ""
    degrees = math.degrees(run.orientation_error)
    return f"{1e3 * run.wall:.0f}", f"{1e6 * run.position_error:.3g}", f"{degrees:.2g}"


def describe(run: Run) -> str:
    """Step or tolerance in words."""
    if run.side == SOFTHAND and has_tolerance(run.method):
        return f"rtol 1e{math.log10(run.setting):.0f}"
    return f"{1e3 * run.setting:.4g} ms"


def draw_stiff_table(runs: Sequence[Run]) -> Table:
    """Which methods hold stiff tips."""
    table = Table("", "", Column("um", justify="right"), Column("deg", justify="right"))
    table.title = f"Tips {STIFFER:g} times stiffer, {runs[0].kind}, K_N = {STIFF_GAIN:g}, steps of 1 ms"
    for run in runs:
        errors = _numbers(run)[1:] if math.isfinite(run.position_error) else ("", "")
        table.add_row(f"{run.side} {run.method}", run.failure or "stable", *errors)
    return table


def draw(results: Mapping[str, Sequence[Run]]) -> Figure:
    """Position error over wall time, one panel a reference, both axes logarithmic."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 4.2), layout="constrained")
        panels = figure.subplots(1, len(results), sharex=True, sharey=True, squeeze=False)[0]
        for axes, (kind, runs) in zip(panels, results.items(), strict=True):
            _draw_panel(axes, kind, runs)
        panels[0].set_ylabel("largest position error [µm]")
        handles = {line.get_label(): line for axes in panels for line in axes.get_lines()}
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4)
    return figure


def _draw_panel(axes: Axes, kind: str, runs: Sequence[Run]) -> None:
    colours = dict(zip(SHIPPED["steppers"], COLOURS, strict=False)) | dict(
        zip(MUJOCO_METHODS, MUJOCO_COLOURS, strict=True)
    )
    for side, method in methods(runs):
        good = [run for run in runs if (run.side, run.method) == (side, method) and run.poses is not None]
        if not good:
            continue
        walls, errors = [1e3 * run.wall for run in good], [1e6 * run.position_error for run in good]
        line, marker = ("-", "o") if side == SOFTHAND else ("--", "s")
        axes.loglog(walls, errors, color=colours[method], linestyle=line, marker=marker, markersize=3.5,
                    label=f"{side} {method}")  # fmt: skip
        if good[0].setting != PERIOD:
            axes.annotate(describe(good[0]), (walls[0], errors[0]), (4, 3), textcoords="offset points", fontsize=6.5,
                          color="0.3")  # fmt: skip
    failures = [run.failure for run in runs if run.side == MUJOCO and run.poses is None]
    if failures:
        text = f"MuJoCo, {len(failures)} of its runs:\n{failures[-1]}"
        axes.text(0.98, 0.98, text, va="top", ha="right", transform=axes.transAxes, fontsize=7.0, color=WARNING)
    axes.set_title(f"Target A, {kind}; curves begin at 1 ms")
    axes.set_xlabel("wall time of a simulated second [ms]")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("")


def report(results: Mapping[str, Sequence[Run]], stiff: Sequence[Run]) -> dict[str, Any]:
    """All results as plain data; what could not be measured is null."""
    return {
        "headlines": [line for runs in results.values() for line in headlines(runs)],
        "runs": [_plain(run) for runs in results.values() for run in runs],
        "stiff_tips": [_plain(run) | {"stable": not run.failure} for run in stiff],
        "versions": versions(),
    }


def _plain(run: Run) -> dict[str, Any]:
    words = {"reference": run.kind, "side": run.side, "method": run.method, "setting": run.setting}
    numbers = {
        "wall_per_second": run.wall,
        "position_error": run.position_error,
        "orientation_error": run.orientation_error,
    }
    return (
        words
        | {key: value if math.isfinite(value) else None for key, value in numbers.items()}
        | {"failure": run.failure}
    )


def read_arguments() -> argparse.Namespace:
    """The command line."""
    summary, _, rest = (__doc__ or "").partition("\n")
    parser = argparse.ArgumentParser(
        description=summary, epilog=rest, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="steps of 1 and 0.5 ms only, one run each")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all results")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="draw them (.png, .svg or .pdf)")
    return parser.parse_args()


def main() -> int:
    """Run, compare, report."""
    arguments, console = read_arguments(), Console()
    stay_on_one_core()
    scenario = softhand.load_scenario("target-a")
    divisors, passes = (DIVISORS[:2], 1) if arguments.quick else (DIVISORS, 3)
    results = {}
    for kind in KINDS:
        results[kind] = run_all(scenario.with_values({"reference.kind": kind}), divisors, passes, console)
        console.print(draw_table(results[kind]))
    with console.status("Stiffer tips"):
        stiff = run_stiff(scenario)
    console.print(draw_stiff_table(stiff))
    for kind, runs in results.items():
        print_headlines(kind, runs, console)
    if arguments.json:
        arguments.json.write_text(json.dumps(report(results, stiff), indent=2, allow_nan=False) + "\n")
    if arguments.plot:
        softhand.save_figure(draw(results), arguments.plot)
    return 0


if __name__ == "__main__":
    sys.exit(main())
