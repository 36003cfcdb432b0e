"""Actions a second of the environments: worlds side by side, with and without what belongs to an episode.

An action takes 10 ms: ten control periods of 1 ms physics. Rows are kinds of action, and columns

physics    the compiled loop alone, no Python between actions
envs       `HandVectorEnv.step` with random actions, episodes in the same world one after the other
drawn      the same with a new world for each episode, its start solved: mass, friction and stiffness
real time  seconds of all worlds together that `envs` simulates in a second

Each number is the best of short rounds, by processor time: what two cores do that nobody else uses. Random torques lose
the box after some tenths of a second, so that their episodes are short and many are drawn. The row `2 ms` has steps of
2 ms: half the physics, and named as such.

Example: python benchmarks/bench_envs.py --worlds 1000 --json envs.json
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from rich.console import Console
from rich.table import Table

ROWS: dict[str, dict[str, Any]] = {
    "set-point": {"action": "set-point"},
    "internal-force": {"action": "internal-force"},
    "joint-set-point": {"action": "joint-set-point"},
    "torque": {"action": "torque"},
    "set-point, 2 ms": {
        "action": "set-point",
        "overrides": {"stepper.step": 0.002, "control_period": 0.002},
    },
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print the table, write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", type=int, default=1000)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rows", nargs="+", choices=ROWS, default=list(ROWS), metavar="ROW", help="names of rows")
    parser.add_argument("--seconds", type=float, default=5.0, help="of processor time for each number")
    parser.add_argument("--json", type=Path, help="file for the figures")
    chosen = parser.parse_args(arguments)
    figures: dict[str, Any] = {"machine": platform.platform(), "worlds": chosen.worlds, "threads": chosen.threads}
    table = Table("action", "physics [1/s]", "envs [1/s]", "drawn [1/s]", "real time", title=f"{chosen.worlds} worlds")
    for name in chosen.rows:
        row = figures[name] = measured(ROWS[name], chosen.worlds, chosen.threads, chosen.seconds)
        table.add_row(
            name, *(f"{row[key]:,.0f}" for key in ("physics", "envs", "drawn", "real_time")),
        )  # fmt: skip
    Console().print(table)
    Console().print(
        f"Of one core, times {chosen.threads}: figures are by processor time, as if no one else were there."
    )
    if chosen.json:
        chosen.json.write_text(json.dumps(figures, indent=2))


def measured(options: dict[str, Any], worlds: int, threads: int, seconds: float) -> dict[str, float]:
    """Actions a second of all worlds, by processor time on so many cores."""
    found: dict[str, float] = {}
    for key, episodes in (("envs", 10**9), ("drawn", 1)):
        envs: Any = gymnasium.make_vec(
            "softhand.envs:softhand/ReorientBox-v0", num_envs=worlds, threads=threads, max_episode_steps=200,
            episodes_per_world=episodes, **options,
        )  # fmt: skip
        envs.reset(seed=0)
        envs.unwrapped._steps[:] = np.arange(worlds) % 200  # so that episodes do not end all at once
        envs.action_space.seed(0)
        actions = 0.2 * envs.action_space.sample()
        if key == "envs":
            loop = envs.unwrapped.episodes.worlds
            found["physics"] = worlds * rate(loop.go_on, seconds, threads, partial(_begin, envs))
            envs.reset(seed=0)
        found[key] = worlds * rate(lambda envs=envs, actions=actions: envs.step(actions), seconds, threads)
        envs.close()
    return {**found, "real_time": 0.01 * found["envs"]}


def _begin(envs: Any) -> None:
    """All worlds at a start, and ready for an action of 10 ms."""
    envs.reset()
    loop = envs.unwrapped.episodes.worlds
    loop.turns[:] = round(0.01 / loop._period)


def rate(work: Callable[[], Any], seconds: float, threads: int, before: Callable[[], Any] = lambda: None) -> float:
    """Calls a second on so many cores: the best of rounds of ten, before each of which something else is done."""
    before(), work()
    begin, best = time.process_time(), np.inf
    while time.process_time() - begin < seconds:
        before()
        start = time.process_time()
        for _ in range(10):
            work()
        best = min(best, time.process_time() - start)
    return 10 * threads / best


if __name__ == "__main__":
    main()
