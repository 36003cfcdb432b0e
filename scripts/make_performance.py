"""Measure the tables of docs/performance.md anew, and put them and the machine into the page.

Takes ten minutes on an idle machine, and needs the extra `bench`. Ratios are medians of rounds in which the sides take
turns within one process, so that a busy machine changes them little.

Example: python scripts/make_performance.py --rounds 60 --runs 400
"""

from __future__ import annotations

import argparse
import platform
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

import softhand
from softhand.assembly.variations import Variations
from softhand.batch.asked import Asked
from softhand.batch.run import CompiledRun
from softhand.simulation.keep import Keep

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "performance.md"
PACKAGES = ("mujoco", "pin", "numba", "numpy", "scipy")
SECONDS = 2.0  # of a run of target-a
sys.path.insert(0, str(ROOT / "benchmarks"))


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=60, help="of each comparison")
    parser.add_argument("--runs", type=int, default=400, help="of the rollout")
    chosen = parser.parse_args(arguments)
    blocks: dict[str, Callable[[], str]] = {
        "machine": machine,
        "mujoco": lambda: beside_mujoco(chosen.rounds),
        "ready": lambda: making_ready(chosen.rounds, chosen.runs),
        "fingers": lambda: fingers(chosen.rounds),
    }
    for name, measure in blocks.items():
        new = measure()
        head, start, rest = PAGE.read_text().partition(f"<!-- {name} -->\n")
        _, end, tail = rest.partition("<!-- end -->")
        PAGE.write_text(f"{head}{start}{new}\n{end}{tail}")
        print(new, end="\n\n")


def machine() -> str:
    """In two sentences."""
    names = [line.split(":", 1)[1].strip() for line in _lines("/proc/cpuinfo") if line.startswith("model name")]
    found = f"{names[0]}, {len(names)} cores" if names else platform.processor() or platform.machine()
    told = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    return (
        f"Measured on: {found}, {platform.system()}, a shared virtual machine.\n"
        f"With softhand {softhand.__version__}, python {platform.python_version()}, {told}."
    )


def _lines(file: str) -> list[str]:
    try:
        return Path(file).read_text().splitlines()
    except OSError:
        return []


def beside_mujoco(rounds: int) -> str:
    """Rows of `bench_rollout`."""
    from bench_rollout import measured

    told = {
        "physics": "physics, one core",
        "control": "with the control law (59), one core",
        "batch_physics": "batch, physics, two threads",
        "batch_control": "batch, our control against `mujoco.rollout` without, two threads",
    }
    found = measured(rounds)
    rows = []
    for row, name in told.items():
        own = found[row]
        low, high = own["ratio_mujoco_over_softhand_quartiles"]
        rows.append(
            (name, f"**{own['ratio_mujoco_over_softhand']:.1f}**", f"{low:.1f} - {high:.1f}",
             f"{own['ratio_trimmed_mujoco_over_softhand']:.1f}")
        )  # fmt: skip
    return _table(("", "ratio", "quartiles", "trimmed MuJoCo"), rows)


def making_ready(rounds: int, runs: int) -> str:
    """What a run of target-a takes before its first period, in CPU time over that of its 2,000 periods."""
    base, rng = softhand.load_scenario("target-a"), np.random.default_rng(0)
    variations, keep = Variations(base), Keep.of(("object_position",), 0.01, base.control_period)
    asked, values = Asked(), {"object.mass": 0.2, "fingertip.friction": 0.7}
    scenario = base.with_values(values)
    setup = variations.to(scenario)
    run = CompiledRun(setup, keep, asked)
    tasks: dict[str, Callable[[], Any]] = {
        "its 2,000 periods": lambda: run.become(setup, keep) and run.go(lambda: False),
        "read what varies": lambda: base.with_values(values),
        "start at rest, and all that follows": lambda: variations.to(scenario),
        "memory and code of the thread's last run": lambda: run.become(setup, keep),
        "memory and code of a first run": lambda: CompiledRun(setup, keep, asked),
    }
    taken = {name: np.empty(rounds) for name in tasks}
    for k in range(-3, rounds):
        for name, task in tasks.items():
            begin = time.process_time()
            task()
            if k >= 0:
                taken[name][k] = time.process_time() - begin
    whole = taken["its 2,000 periods"]
    rows = [(name, f"{100.0 * np.median(own / whole):.1f} %") for name, own in taken.items()]
    columns = {"mass": rng.uniform(0.15, 0.25, runs), "fingertip.friction": rng.uniform(0.6, 1.0, runs)}
    for threads in (1, 2):
        begin = time.perf_counter()
        softhand.rollout("target-a", columns, threads=threads)
        took = 1e3 * (time.perf_counter() - begin) / runs
        rows.append((f"`rollout` of {runs} runs, {threads} thread{'s' * (threads > 1)}", f"{took:.1f} ms a run"))
    return _table(("", ""), rows)


def fingers(rounds: int) -> str:
    """Rows of `bench_fingers`."""
    from bench_fingers import measured

    rows = [
        (str(n), f"{row['physics_over_three']:.2f}", f"{row['control_over_three']:.2f}")
        for n, row in measured(rounds).items()
    ]
    return _table(("fingers", "physics", "with the control law (59)"), rows)


def _table(names: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    ruler = ["---", *["---:"] * (len(names) - 1)]
    return "\n".join(f"| {' | '.join(row)} |" for row in (names, ruler, *rows))


if __name__ == "__main__":
    main()
