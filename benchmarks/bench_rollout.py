"""Many control periods in one call: softhand's compiled loop against MuJoCo on the same hand, box and start.

Both sides run in one process, in short rounds that take turns; a ratio is the median of the ratios of the rounds, with
their quartiles. The rows that are not called a batch run on one core. Compared are

physics    steps of 1 ms under the torques that hold the start, each side in one call: the compiled loop without
           observation and law, against `mj_step(model, data, n)`; back to the start after each round
control    control periods of 1 ms with the law (59) of the paper, compiled on both sides, along the scenario: the
           compiled loop in one call, against `mj_step1`, one compiled call for sensing and law, `mj_step2`
batch      the same on two threads against `mujoco.rollout`, which has no control: `batch_control` with our law and
           `batch_physics` without; runs are ready on both sides before the clock starts
starts     runs of `softhand.rollout` a second that differ in mass and friction, starts at rest included

MuJoCo runs `implicitfast` with its default feature flags; a second ratio has MuJoCo trimmed, see `mujoco_scene`.

Example: python benchmarks/bench_rollout.py --rounds 60 --json rollout.json
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path
from typing import Any

import mujoco
import mujoco.rollout
import numpy as np
from bench_step import MujocoSide, SofthandSide
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from rich.table import Table

import softhand
from softhand.assembly.resolve import resolve
from softhand.batch.asked import Asked
from softhand.batch.run import CompiledRun
from softhand.simulation.keep import Keep

PERIOD = 0.001  # [s]
ROUND = 250  # periods
RUNS = 16  # of a batch
THREADS = 2
PACKAGES = ("softhand", "mujoco", "numba", "pin")
WARM_UP = 3  # rounds that do not count

Seconds = NDArray[np.float64]


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print the table, write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=60, help="rounds of each row")
    parser.add_argument("--runs", type=int, default=200, help="runs of the row `starts`")
    parser.add_argument("--json", type=Path, help="file for the figures")
    chosen = parser.parse_args(arguments)
    figures = {**measured(chosen.rounds), "starts": starts(chosen.runs)}
    if chosen.json:
        chosen.json.write_text(json.dumps(figures, indent=2))
    show(figures)


def measured(rounds: int) -> dict[str, Any]:
    """The figures of all rows but `starts`."""
    scenario = softhand.load_scenario("target-a", {"duration": ROUND * PERIOD, "stepper.terms": "compiled"})
    ours, asked = Ours(scenario), Asked()
    default = MujocoSide(softhand.build(scenario), scenario, PERIOD, "implicitfast")
    trimmed = MujocoSide(softhand.build(scenario), scenario, PERIOD, "implicitfast", trimmed=True)
    rows: dict[str, tuple[Callable[[], Callable[[], Any]], ...]] = {
        "physics": (lambda: ours.ready(asked, held=True), lambda: stepped(default), lambda: stepped(trimmed)),
        "control": (lambda: ours.ready(asked), lambda: controlled(default), lambda: controlled(trimmed)),
        "batch_physics": (
            lambda: ours.ready_batch(asked, held=True), lambda: batch(default), lambda: batch(trimmed),
        ),
        "batch_control": (lambda: ours.ready_batch(asked), lambda: batch(default), lambda: batch(trimmed)),
    }  # fmt: skip
    taken = {row: np.zeros((rounds, 3)) for row in rows}
    for k in track(range(rounds + WARM_UP), description="rounds"):
        for row, sides in rows.items():
            order = np.roll(np.arange(3), k)  # so that none is always the first
            for side in order:
                work = sides[side]()
                begin = time.perf_counter()
                work()
                if k >= WARM_UP:
                    taken[row][k - WARM_UP, side] = time.perf_counter() - begin
    return {
        "machine": {"processor": platform.processor() or platform.machine(), "system": platform.platform()},
        "versions": {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}},
        **{row: row_figures(seconds, RUNS if "batch" in row else 1) for row, seconds in taken.items()},
    }  # fmt: skip


def row_figures(seconds: Seconds, runs: int) -> dict[str, Any]:
    """Microseconds a period of each side, and the ratios."""
    micro = 1e6 * np.median(seconds, axis=0) / (ROUND * runs)
    found: dict[str, Any] = dict(zip(("softhand_us", "mujoco_us", "trimmed_mujoco_us"), micro.tolist(), strict=True))
    for column, name in ((1, "ratio_mujoco_over_softhand"), (2, "ratio_trimmed_mujoco_over_softhand")):
        ratios = seconds[:, column] / seconds[:, 0]
        found[name] = float(np.median(ratios))
        found[f"{name}_quartiles"] = np.quantile(ratios, (0.25, 0.75)).tolist()
    return found


class Ours:
    """Runs of a scenario in the compiled loop."""

    def __init__(self, scenario: softhand.Scenario) -> None:
        self._setup = resolve(scenario)
        self._keep = Keep.of(("object_position",), ROUND * PERIOD, PERIOD)
        self._holding = SofthandSide(scenario)._holding

    def ready(self, asked: Asked, held: bool = False) -> Callable[[], Any]:
        """One run, ready to go; under the torques that hold the start if asked."""
        run = CompiledRun(self._setup, self._keep, asked)
        if held:
            run.hold(self._holding)
        return lambda: _whole(run.go(lambda: False))

    def ready_batch(self, asked: Asked, held: bool = False) -> Callable[[], Any]:
        """Many, on threads."""
        runs = [self.ready(asked, held) for _ in range(RUNS)]
        pool = ThreadPoolExecutor(THREADS)
        return lambda: list(pool.map(lambda run: run(), runs))


def _whole(result: Any) -> None:
    if result.outcome.reason != "finished":
        raise RuntimeError(f"the comparison is void: {result.outcome}")


def stepped(side: MujocoSide) -> Callable[[], Any]:
    """MuJoCo's steps in one call."""
    side.reset()
    return lambda: side.run_physics_at_once(ROUND)


def controlled(side: MujocoSide) -> Callable[[], Any]:
    """MuJoCo with the compiled law."""
    side.reset()
    return lambda: side.run_compiled(ROUND)


def batch(side: MujocoSide) -> Callable[[], Any]:
    """`mujoco.rollout` without control, the holding torques in place."""
    side.reset()
    scene = side.scene
    model, data = scene.model, scene.data
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    state = np.zeros(size)
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    warm = np.tile(data.qacc_warmstart, (RUNS, 1))
    applied = np.tile(data.qfrc_applied, (RUNS, ROUND, 1))
    copies = [mujoco.MjData(model) for _ in range(THREADS)]
    pool = mujoco.rollout.Rollout(nthread=THREADS)

    def go() -> None:
        pool.rollout(
            model, copies, np.tile(state, (RUNS, 1)), applied, nstep=ROUND, initial_warmstart=warm,
            control_spec=int(mujoco.mjtState.mjSTATE_QFRC_APPLIED),
        )  # fmt: skip

    return go


def starts(runs: int) -> dict[str, float]:
    """Runs a second that differ in mass and friction, with all that belongs to one."""
    rng = np.random.default_rng(0)
    values = {"mass": rng.uniform(0.15, 0.25, runs), "fingertip.friction": rng.uniform(0.6, 1.0, runs)}
    softhand.rollout("target-a", {key: column[:2] for key, column in values.items()})
    begin = time.perf_counter()
    done = softhand.rollout("target-a", values, threads=THREADS)
    seconds = time.perf_counter() - begin
    return {"runs": runs, "seconds": seconds, "runs_a_second": runs / seconds, "finished": float(done.finished.mean())}


def show(figures: dict[str, Any]) -> None:
    """The table."""
    table = Table("row", "softhand [us]", "MuJoCo [us]", "ratio", "trimmed [us]", "ratio")
    for row, found in figures.items():
        if "ratio_mujoco_over_softhand" in found:
            table.add_row(
                row, f"{found['softhand_us']:.2f}", f"{found['mujoco_us']:.2f}",
                f"{found['ratio_mujoco_over_softhand']:.2f}", f"{found['trimmed_mujoco_us']:.2f}",
                f"{found['ratio_trimmed_mujoco_over_softhand']:.2f}",
            )  # fmt: skip
    console = Console()
    console.print(table)
    told = figures["starts"]
    console.print(f"rollout of 2 s runs, starts included: {told['runs_a_second']:.1f} runs a second")


if __name__ == "__main__":
    main()
