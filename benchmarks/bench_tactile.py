"""Time of a sample of taxels: three tips in a grasp, by kind of taxels and by what is touched.

A sample is what `[tactile]` adds to a control period of the compiled loop, 3 x 100 taxels if nothing else is asked for.
Rows are

ideal        force, shear, slip and depth of each taxel
hysteresis   the same, held on to where they are let go
noise        the same with noise, three random numbers a taxel
delay        the same as ideal, read at 100 Hz and 20 ms late, a control period with a sample
loop         a control period of `softhand.rollout` with a sample in each, normal forces recorded, less that of one
             without
recorded     the same with all that taxels tell recorded

Times are processor time, the least of short rounds. The ratio is that to a control period without taxels.

Example: python benchmarks/bench_tactile.py --count 100 --rounds 60
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import softhand
from softhand.numerics.prepared import prepared
from softhand.sensing.fields import pick
from softhand.tactile.field import Felt
from softhand.tactile.reading import feel_and_read

SCENARIOS = {"box": "target-a", "can": "can", "ball": "ball"}
KINDS: dict[str, dict[str, float]] = {"ideal": {}, "hysteresis": {"tactile.hysteresis": 0.2},
                                      "noise": {"tactile.noise": 0.01, "tactile.shear_noise": 0.01},
                                      "delay": {"tactile.rate": 100.0, "tactile.delay": 0.02}}  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print the table, write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100, help="taxels of a tip")
    parser.add_argument("--rounds", type=int, default=60)
    parser.add_argument("--json", type=Path)
    given = parser.parse_args(arguments)
    period = _loop(given.rounds, {}, ["contact_force"])
    rows = {}
    for shape, name in SCENARIOS.items():
        for kind, settings in KINDS.items():
            if shape == "box" or kind in ("ideal", "noise"):
                rows[f"{kind}, {shape}"] = _sample(name, {"tactile.count": given.count, **settings}, given.rounds)
    for kind, names in (("loop", Felt._fields[:1]), ("recorded", Felt._fields)):
        rows[f"{kind}, box"] = _loop(given.rounds, {"tactile.count": given.count}, names) - period
    table = Table("taxels", "us a sample", "over a control period", title=f"3 x {given.count} taxels")
    for row, seconds in rows.items():
        table.add_row(row, f"{1e6 * seconds:.2f}", f"{seconds / period:.2f}")
    Console().print(table, f"control period without taxels: {1e6 * period:.2f} us")
    if given.json:
        given.json.write_text(json.dumps({"count": given.count, "period": period, "samples": rows}, indent=1))


def _sample(name: str, settings: dict[str, float], rounds: int) -> float:
    simulation = softhand.build(name, overrides=settings)
    simulation.sample()
    plant, felt = simulation.plant, pick(Felt, simulation.truth._views)
    assert plant.n_taxels and np.count_nonzero(felt.tactile_normal_force) > 3 * plant.world.n_tips
    call = prepared(feel_and_read, plant.skin, plant.reading, plant.pads, plant.contacts, plant.snapshot.terms.poses,
                    felt, Felt(*(array[:0] for array in felt)), np.zeros(1, np.int64))  # fmt: skip
    return _least(call, 500, rounds)


def _loop(rounds: int, settings: dict[str, float], variables: Sequence[str]) -> float:
    scenario = softhand.load_scenario("target-a", {"duration": 0.5, **settings})

    def run() -> None:
        softhand.rollout(scenario, {"mass": [0.2] * 4}, variables=variables, every=0.001, threads=1)

    run()
    return _least(run, 1, max(rounds // 10, 3)) / (4 * 501)


def _least(call: Callable[[], object], calls: int, rounds: int) -> float:
    found = []
    for _ in range(rounds):
        begin = time.process_time()
        for _ in range(calls):
            call()
        found.append((time.process_time() - begin) / calls)
    return min(found)


if __name__ == "__main__":
    main()
