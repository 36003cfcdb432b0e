"""A control period of the compiled loop for hands of 2 to 10 fingers, see `bench_size` for the hands.

`physics` is a period of 1 ms under the torques that hold the start; `control` has the law (59) and all that it reads.
Hands take turns in short rounds on one core; given are medians, and their ratio to the hand of three fingers.

Example: python benchmarks/bench_fingers.py --rounds 40
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from bench_size import (
    BOX,
    ELBOW_OUTWARD,
    LAW,
    OBJECT_POSITION,
    build_hand,
    holding_torque,
    internal_forces,
    places,
    write_model,
)
from rich.console import Console
from rich.table import Table

import softhand
from softhand.assembly.resolve import Setup, resolve
from softhand.batch.asked import Asked
from softhand.batch.run import CompiledRun
from softhand.simulation.keep import Keep

FINGERS = (2, 3, 4, 6, 8, 10)
PERIODS = 250
PERIOD = 0.001  # [s]
WARM_UP = 3  # rounds that do not count
KEEP = Keep.of(("object_position",), PERIODS * PERIOD, PERIOD)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=40)
    show(measured(parser.parse_args(arguments).rounds))


def measured(rounds: int) -> dict[int, dict[str, float]]:
    """Microseconds a period by the number of fingers, and over those of three."""
    asked = Asked()
    with tempfile.TemporaryDirectory() as folder:
        sides = {n: (setup_of(Path(folder), n), holding_torque(build_hand(Path(folder), n))) for n in FINGERS}
    taken = {(n, row): np.empty(rounds) for n in FINGERS for row in ("physics", "control")}
    for k in range(-WARM_UP, rounds):
        for (n, row), seconds in taken.items():
            setup, torque = sides[n]
            run = CompiledRun(setup, KEEP, asked)
            if row == "physics":
                run.hold(torque)
            begin = time.perf_counter()
            result = run.go(lambda: False)
            if k >= 0:
                seconds[k] = time.perf_counter() - begin
            if result.outcome.reason != "finished":
                raise RuntimeError(f"a hand of {n} fingers: {result.outcome}")
    found: dict[int, dict[str, float]] = {n: {} for n in FINGERS}
    for (n, row), seconds in taken.items():
        found[n][row] = 1e6 * float(np.median(seconds)) / PERIODS
        found[n][f"{row}_over_three"] = float(np.median(seconds / taken[3, row]))
    return found


def setup_of(folder: Path, n: int) -> Setup:
    """The hand of `bench_size`, holding its box still."""
    hand, box = write_model(folder, n)
    force = internal_forces(n).tolist()
    pose = {"object_position": OBJECT_POSITION, "object_rpy": (0.0, 0.0, 0.0), "internal_force": force}
    values: dict[str, Any] = {
        "duration": PERIODS * PERIOD,
        "hand": {"urdf": str(hand), "tips": [f"finger_{k + 1}_tip" for k in range(n)]},
        "object": {"urdf": str(box), "position": OBJECT_POSITION, "rpy": (0.0, 0.0, 0.0)},
        "grasp": {
            "contact_points": [(side * 0.5 * BOX[0], y, 0.0) for side, y in places(n)],
            "internal_force": force,
            "joint_guess": np.tile(ELBOW_OUTWARD, n).tolist(),
        },
        "reference": {"kind": "step", **pose},
        "controller": {"name": "regulation"},
    }
    return resolve(softhand.load_scenario("target-a", values), law=LAW)


def show(found: dict[int, dict[str, float]]) -> None:
    """The table."""
    table = Table("fingers", "physics [us]", "over three", "control [us]", "over three")
    for n, row in found.items():
        table.add_row(
            str(n), f"{row['physics']:.2f}", f"{row['physics_over_three']:.2f}", f"{row['control']:.2f}",
            f"{row['control_over_three']:.2f}",
        )  # fmt: skip
    Console().print(table)


if __name__ == "__main__":
    main()
