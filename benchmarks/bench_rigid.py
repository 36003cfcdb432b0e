"""Time of the rigid-body terms of one step: Pinocchio's two calls against the kernel of softhand.

Both are called from Python as the stepper `midpoint` does, in one process, in short rounds that take turns, at states
along a random motion. The times are the least of all rounds; the ratio is the median of the ratios of the rounds.

Example: python benchmarks/bench_rigid.py target-a allegro-box gripper
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable

import numpy as np
import pinocchio as pin

from softhand.assembly.plant import read_world
from softhand.model.compiled_snapshot import CompiledSnapshot
from softhand.model.snapshot import Snapshot
from softhand.scenario.scenario import load_scenario

ROUNDS, CALLS = 300, 200
SPREAD = 2.0  # of joint positions [rad, m] and velocities


def main(names: list[str]) -> None:
    """Print a line a scenario."""
    for name in names or ["target-a", "allegro-box", "gripper"]:
        world, rng = read_world(load_scenario(name)), np.random.default_rng(0)
        model = world.model
        q, v = np.zeros(model.nq), np.zeros(model.nv)
        sides = [snapshot(world).updates(q, v) for snapshot in (Snapshot, CompiledSnapshot)]
        rounds = []
        for _ in range(ROUNDS):
            q[:] = pin.integrate(model, pin.neutral(model), rng.normal(scale=SPREAD, size=model.nv))
            v[:] = rng.normal(scale=SPREAD, size=model.nv)
            rounds.append([timed(calls) for calls in sides])
        pinocchio, compiled = (1e6 * min(times) for times in zip(*rounds, strict=True))
        ratio = statistics.median(one / other for one, other in rounds)
        times = f"Pinocchio {pinocchio:.2f} us, kernel {compiled:.2f} us, ratio {ratio:.1f}"
        print(f"{name}: {model.njoints - 1} bodies, {times}")


def timed(calls: tuple[Callable[[], object], ...]) -> float:
    """CPU time of one update [s]."""
    start = time.process_time()
    for _ in range(CALLS):
        for call in calls:
            call()
    return (time.process_time() - start) / CALLS


if __name__ == "__main__":
    main(sys.argv[1:])
