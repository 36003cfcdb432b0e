"""Random grasps, loads and pushes: each run must end well, or with a named error; prints what became of them.

Every run with tips that are springs must also close its energy ledger. What it leaves is the error of the stepper, so
where that is more than `BOUND`, the run is repeated with half the step, and must then leave less than half.

Example: python benchmarks/soak.py --seconds 120 --seed 3
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from typing import Any

import numpy as np

from softhand import GraspError, Recording, Scenario, SimulationStopped, build, load_scenario
from softhand.analysis.energy import energy_ledger
from softhand.controllers.regulation import Regulation
from softhand.plant.plant import Plant
from softhand.scenario.scenario import with_law

NAMED = ("flat", "apex", "rim", "diverged")
SCENARIOS = ("target-a", "target-b", "target-a", "target-b", "can", "prism", "ball")
LOWEST = {"can": 0.045, "prism": 0.045}
"""How far the object reaches down [m], if not 30 mm."""
LAWS = ("nakashima", "conservative", "conservative", "hertz", "parallel-distributed", "power")
DAMPINGS = (None, None, "kelvin-voigt", "hunt-crossley", "fung")
BOUND = 0.05
"""Residual over the largest account, above which the run is repeated with half the step ..."""

CALM = 0.01
"""... while no joint turns further than this in a step [rad]: of what flies faster, the step is too long."""

PERIOD = 1e-3
"""Between two torques [s]."""


class Pushed(Regulation):
    """Regulation, and bursts of random torques on top."""

    push: float
    seed: int

    def torque(self, observation: Any, memory: Any) -> Any:
        """With another push every 20 ms, three in ten of them not zero."""
        torque, memory = super().torque(observation, memory)
        rng = np.random.default_rng((self.seed, int(observation.time / 0.020)))
        strength = self.push if rng.random() < 0.3 else 0.0
        return torque + strength * rng.normal(size=len(torque)), memory


def random_scenario(rng: np.random.Generator, duration: float = 0.4) -> Scenario:
    """A shipped task with another law, friction, damping, mass, grasp and reference, at times above a table."""
    name = str(rng.choice(SCENARIOS))
    scenario = load_scenario(name)
    law = str(rng.choice(LAWS))
    if law != "nakashima":
        scenario = with_law(scenario, law)
    friction = float(rng.uniform(0.2, 1.0))
    position = np.array(scenario.object.position)
    damping = DAMPINGS[rng.integers(len(DAMPINGS))]
    values: dict[str, Any] = {
        "duration": duration,
        "object.mass": float(10.0 ** rng.uniform(-2.0, -0.2)),
        "fingertip.contact": "coulomb",
        "fingertip.friction": friction,
        "fingertip.static_friction": friction * float(rng.choice([1.0, rng.uniform(1.0, 1.5)])),
        "fingertip.tips_touch": bool(rng.random() < 0.3),
        "grasp.internal_force": (rng.uniform(2.0, 8.0) * rng.uniform(0.7, 1.3, 3)).tolist(),
        "reference.kind": str(rng.choice(["step", "minimum-jerk"])),
        "reference.duration": float(rng.uniform(0.1, 0.4)),
        "reference.internal_force": rng.uniform(0.0, 8.0, 3).tolist(),
        "stepper.step": float(rng.choice([1e-3, 5e-4])),
    }
    if name.startswith("target"):
        on_face = np.array([[0, 1, 1], [0, 1, 1], [1, 0, 1]])
        points = np.array(scenario.grasp.contact_points) + on_face * rng.uniform(-0.008, 0.008, (3, 3))
        values["grasp.contact_points"] = points.tolist()
    else:
        position += rng.uniform(-0.004, 0.004, 3)
        values["object.position"] = position.tolist()
        values["object.rpy"] = rng.uniform(-0.1, 0.1, 3).tolist()
    if rng.random() < 0.3:
        gap = float(rng.uniform(0.004, 0.020))
        values["table"] = {"height": float(position[2]) - LOWEST.get(name, 0.030) - gap, "friction": friction}
    if damping is not None:
        values["fingertip.damping"] = {"name": damping}
    return scenario.with_values(values)


def outcome_of(seed: int, duration: float = 0.4) -> tuple[str, str, float]:
    """Name of what became of one run, what is wrong with it ("" if nothing), residual over the largest account."""
    rng = np.random.default_rng(seed)
    scenario = random_scenario(rng, duration)
    push = float(rng.choice([0.0, rng.uniform(0.0, 0.5)]))
    controller = Pushed(push=push, seed=seed, period=PERIOD)
    try:
        recording, name, plant = _run(scenario, controller)
    except GraspError:
        return "no grasp", "", 0.0
    if name not in ("finished", *NAMED):
        return name, f"stopped by {name}: {recording.reason}", 0.0
    if name == "finished" and recording.is_slipping.any():
        name = "finished, slipped"
    wrong = _not_finite(recording)
    turned = np.max(np.abs(recording.joint_velocity), axis=1) * scenario.stepper.step
    calm = np.count_nonzero(np.cumsum(turned > CALM) == 0)
    share = _left(recording, plant, recording.time[max(calm - 1, 0)])
    if share > BOUND:
        step = 0.5 * scenario.stepper.step
        finer, _, plant = _run(scenario.with_values({"stepper.step": step, "control_period": step}), controller)
        half = _left(finer, plant, recording.time[max(calm - 1, 0)])
        if not half < 0.5 * share:
            wrong = wrong or f"the ledger leaves {share:.3g} of the energy, and {half:.3g} with half the step ({name})"
    return name, wrong, share


def _run(scenario: Scenario, controller: Pushed) -> tuple[Recording, str, Plant]:
    simulation = build(scenario, controller)
    try:
        return simulation.run(), "finished", simulation.plant
    except SimulationStopped as stop:
        return stop.recording, stop.reason, simulation.plant


def _left(recording: Recording, plant: Plant, until: float) -> float:
    """Residual of the ledger over the largest account at a time; 0 where laws are no springs."""
    last = int(np.searchsorted(recording.time, until - 1e-9))
    ledger = energy_ledger(recording, plant, (0, min(last, len(recording) - 1)))
    return abs(float(ledger.residual[-1])) / max(ledger.exchanged, 1e-4) if ledger.is_spring else 0.0


def _not_finite(recording: Recording) -> str:
    """The first array with NaN; the uses of friction may be infinite."""
    for name, values in recording.variables.items():
        bad = np.isnan(values) if name.endswith("_use") else ~np.isfinite(values)
        if bad.any():
            return f"{name} is not finite at t = {recording.time[np.argwhere(bad)[0][0]]:g} s"
    return ""


def main() -> int:
    """Run until the time is over; 1 if anything was wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--runs", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0, help="of the first run; each has the next")
    parser.add_argument("--duration", type=float, default=0.4, help="of each run [s]")
    options = parser.parse_args()
    counts, residuals, wrong = Counter[str](), [], []
    end = time.monotonic() + options.seconds
    for seed in range(options.seed, options.seed + options.runs):
        if time.monotonic() > end:
            break
        try:
            name, fault, share = outcome_of(seed, options.duration)
        except Exception as error:
            name, fault, share = "exception", f"{type(error).__name__}: {error}", 0.0
        counts[name] += 1
        if share > 0.0:
            residuals.append(share)
        if fault:
            wrong.append(f"seed {seed}: {fault}")
    print("| outcome | runs |\n|---|---|")
    for name, count in counts.most_common():
        print(f"| {name} | {count} |")
    print(f"\n{sum(counts.values())} runs, {len(wrong)} wrong")
    if residuals:
        print(f"ledger residual over the largest account: median {np.median(residuals):.1e}, most {max(residuals):.1e}")
    print("\n".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
