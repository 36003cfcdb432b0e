"""Random grasps, loads and pushes: each run must end well, or with a named error; prints what became of them.

Every run with tips that are springs must also close its energy ledger.

Example: python scripts/soak.py --seconds 120 --seed 3
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
from softhand.scenario import with_law

NAMED = ("flat", "apex", "rim", "diverged")
LAWS = ("nakashima", "conservative", "conservative", "hertz", "parallel-distributed", "power")
DAMPINGS = (None, None, "kelvin-voigt", "hunt-crossley", "fung")
BOUND = 0.05
"""Largest residual over the largest account ..."""

CALM = 0.01
"""... while no joint turns further than this in a step [rad]: of what flies faster, the step is too long."""


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


def random_scenario(rng: np.random.Generator) -> Scenario:
    """One of the shipped targets with another law, friction, damping, mass, grasp and reference."""
    scenario = load_scenario(str(rng.choice(["target-a", "target-b"])))
    law = str(rng.choice(LAWS))
    if law != "nakashima":
        scenario = with_law(scenario, law)
    friction = float(rng.uniform(0.2, 1.0))
    points = np.array(scenario.grasp.contact_points)
    on_face = np.array([[0, 1, 1], [0, 1, 1], [1, 0, 1]])
    damping = DAMPINGS[rng.integers(len(DAMPINGS))]
    values: dict[str, Any] = {
        "duration": 0.4,
        "object.mass": float(10.0 ** rng.uniform(-2.0, -0.2)),
        "fingertip.contact": "coulomb",
        "fingertip.friction": friction,
        "fingertip.static_friction": friction * float(rng.choice([1.0, rng.uniform(1.0, 1.5)])),
        "grasp.contact_points": (points + on_face * rng.uniform(-0.010, 0.010, (3, 3))).tolist(),
        "grasp.internal_force": rng.uniform(1.0, 8.0, 3).tolist(),
        "reference.kind": str(rng.choice(["step", "minimum-jerk"])),
        "reference.duration": float(rng.uniform(0.1, 0.4)),
        "reference.internal_force": rng.uniform(0.0, 8.0, 3).tolist(),
        "stepper.step": float(rng.choice([1e-3, 5e-4])),
    }
    if damping is not None:
        values["fingertip.damping"] = {"name": damping}
    return scenario.with_values(values)


def outcome_of(seed: int) -> tuple[str, str, float]:
    """Name of what became of one run, what is wrong with it ("" if nothing), residual over the largest account."""
    rng = np.random.default_rng(seed)
    scenario = random_scenario(rng)
    controller = Pushed(push=float(rng.choice([0.0, rng.uniform(0.0, 0.5)])), seed=seed)
    try:
        simulation = build(scenario, controller)
    except GraspError:
        return "no grasp", "", 0.0
    try:
        recording, name = simulation.run(), "finished"
        if recording.is_slipping.any():
            name = "finished, slipped"
    except SimulationStopped as stop:
        recording, name = stop.recording, stop.reason
        if name not in NAMED:
            return name, f"stopped by {name}: {stop}", 0.0
    wrong = _not_finite(recording)
    turned = np.max(np.abs(recording.joint_velocity), axis=1) * scenario.stepper.step
    calm = np.count_nonzero(np.cumsum(turned > CALM) == 0)
    ledger = energy_ledger(recording, simulation.plant, (0, max(calm - 1, 0)))
    share = abs(float(ledger.residual[-1])) / max(ledger.exchanged, 1e-4) if ledger.is_spring else 0.0
    if not share < BOUND:
        wrong = wrong or f"the ledger leaves {share:.3g} of {1e3 * ledger.exchanged:.3g} mJ ({name})"
    return name, wrong, share


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
    options = parser.parse_args()
    counts, residuals, wrong = Counter[str](), [], []
    end = time.monotonic() + options.seconds
    for seed in range(options.seed, options.seed + options.runs):
        if time.monotonic() > end:
            break
        try:
            name, fault, share = outcome_of(seed)
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
