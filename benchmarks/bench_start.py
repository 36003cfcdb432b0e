"""From a scenario to a simulation that is ready to run: CPU time of the parts, warm, the least of many.

build       `softhand.build` from the name of a scenario: its file, the URDFs, the start, the simulation
world       reading hand and object, which are kept while their files stay as they are
start       the grasp at rest
resolve     world, start and plugins together
assemble    plant, sensor and simulation of what is resolved
variation   `Variations.at` with two numbers changed, in place of `resolve`

Example: python benchmarks/bench_start.py target-a can allegro-box
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

from softhand.assembly.build import assemble, build
from softhand.assembly.parts import read_fingertips
from softhand.assembly.plant import read_supports, read_world, solve_start
from softhand.assembly.resolve import resolve
from softhand.assembly.variations import Variations
from softhand.scenario.scenario import load_scenario


def least(task: Callable[[], Any], rounds: int) -> float:
    """CPU time of a task [ms], the least of some rounds, the first left out."""
    task()
    times = []
    for _ in range(rounds):
        begin = time.process_time()
        task()
        times.append(time.process_time() - begin)
    return 1e3 * min(times)


def main() -> None:
    """Print a row for each scenario."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenarios", nargs="*", default=["target-a", "pinch", "can"], help="names or files")
    parser.add_argument("--rounds", type=int, default=40, help="of each task")
    arguments = parser.parse_args()
    print("[ms]          " + "".join(f"{name:>11}" for name in TASKS))
    for name in arguments.scenarios:
        print(f"{name:14}" + "".join(f"{least(make(name), arguments.rounds):11.2f}" for make in TASKS.values()))


def _start(name: str) -> Callable[[], Any]:
    scenario = load_scenario(name)
    world = read_world(scenario)
    fingertips = read_fingertips(scenario, world)
    supports = read_supports(scenario, world, fingertips)
    return lambda: solve_start(scenario, world, fingertips, supports)


def _assemble(name: str) -> Callable[[], Any]:
    setup = resolve(load_scenario(name))
    return lambda: assemble(setup)


def _variation(name: str) -> Callable[[], Any]:
    variations = Variations(load_scenario(name))
    mass, friction = variations.setup.world.object_mass, variations.scenario.fingertip.friction
    return lambda: variations.at({"object.mass": 1.1 * mass, "fingertip.friction": 1.1 * friction})


def _with(task: Callable[[Any], Any]) -> Callable[[str], Callable[[], Any]]:
    def make(name: str) -> Callable[[], Any]:
        scenario = load_scenario(name)
        return lambda: task(scenario)

    return make


TASKS: dict[str, Callable[[str], Callable[[], Any]]] = {
    "build": lambda name: lambda: build(name),
    "world": _with(read_world),
    "start": _start,
    "resolve": _with(resolve),
    "assemble": _assemble,
    "variation": _variation,
}


if __name__ == "__main__":
    main()
