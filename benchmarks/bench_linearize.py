"""A and B of one 1 ms step: `softhand.Linearizer` against MuJoCo's `mjd_transitionFD` on one hand, box and start.

Both sides run in one process on one core, in short rounds that take turns; a ratio is the median of the ratios of the
rounds, with their quartiles. Compared are

transition    A and B of one step of 1 ms beside the start. softhand: derivatives of the sums of the step, 1e-8 exact.
              MuJoCo: `mjd_transitionFD` with centered differences, by joint torques as motors; x has the same 30
              displacements and velocities, and none of what tips store
with_outputs  the same with y: internal forces and use of friction by x, in softhand alone
linearize     the same as `transition` by `softhand.linearize`, which makes plant and tables anew

MuJoCo runs `implicitfast` with its default feature flags; a second ratio has MuJoCo trimmed, see `mujoco_scene`.

Example: python benchmarks/bench_linearize.py --rounds 200 --json linearize.json
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from bench_step import MujocoSide, stay_on_one_core, versions
from mujoco_scene import Void, _describe
from rich.console import Console
from rich.progress import track
from rich.table import Table

import softhand

PERIOD = 0.001  # [s]
CALLS = 5  # in a round
WARM_UP = 3  # rounds that do not count
EPSILON = 1e-6  # MuJoCo's step, its documented example
OUTPUTS = ("internal_force", "limit_surface_use")


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print the table, write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=200, help="rounds of each row")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all results")
    chosen = parser.parse_args(arguments)
    stay_on_one_core()
    figures = measured(chosen.rounds)
    show(figures)
    if chosen.json:
        chosen.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


def measured(rounds: int) -> dict[str, Any]:
    """All figures."""
    scenario = softhand.load_scenario("target-a")
    simulation = softhand.build(scenario)
    simulation.sample()
    state, torque = simulation.save(), simulation.torque.copy()
    plain, seen = softhand.Linearizer(scenario), softhand.Linearizer(scenario, outputs=OUTPUTS)
    sides: dict[str, Callable[[], Any]] = {
        "transition": lambda: plain.at(state, torque),
        "with_outputs": lambda: seen.at(state, torque),
        "linearize": lambda: softhand.linearize(scenario, state=state, torque=torque),
        "mujoco": transition(simulation, MujocoSide(simulation, scenario, PERIOD, "implicitfast")),
        "trimmed_mujoco": transition(
            simulation, MujocoSide(simulation, scenario, PERIOD, "implicitfast", trimmed=True)
        ),
    }
    names = list(sides)
    taken = np.zeros((rounds, len(names)))
    for k in track(range(rounds + WARM_UP), description="rounds"):
        for side in np.roll(np.arange(len(names)), k):  # so that none is always the first
            calls, work = 1 if names[side] == "linearize" else CALLS, sides[names[side]]
            begin = time.perf_counter()
            for _ in range(calls):
                work()
            if k >= WARM_UP:
                taken[k - WARM_UP, side] = (time.perf_counter() - begin) / calls
    seconds = dict(zip(names, taken.T, strict=True))
    return {
        "machine": {"processor": platform.processor() or platform.machine(), "system": platform.platform()},
        "versions": versions(),
        **{name: row(seconds, name) for name in names[:3]},
    }


def row(seconds: dict[str, Any], name: str) -> dict[str, Any]:
    """Milliseconds of a call of each side, and the ratios."""
    found: dict[str, Any] = {"softhand_ms": 1e3 * float(np.median(seconds[name]))}
    for side in ("mujoco", "trimmed_mujoco"):
        ratios = seconds[side] / seconds[name]
        found[f"{side}_ms"] = 1e3 * float(np.median(seconds[side]))
        found[f"ratio_{side}_over_softhand"] = float(np.median(ratios))
        found[f"ratio_{side}_over_softhand_quartiles"] = np.quantile(ratios, (0.25, 0.75)).tolist()
    return found


def transition(simulation: softhand.Simulation, side: MujocoSide) -> Callable[[], Any]:
    """MuJoCo's derivatives of one step under the torques that hold the start, which motors give in place of `Scene`."""
    side.reset()
    plant, known, held = simulation.plant, side.scene.model, side.scene.data
    spec = _describe(plant.world, plant.fingertips, plant.contacts["distance"], PERIOD, "implicitfast")
    for name in plant.world.joint_names:
        spec.add_actuator(name=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=name)
    model = spec.compile()
    for name in ("pair_solref", "pair_solreffriction", "pair_solimp", "pair_friction", "pair_margin", "pair_gap"):
        getattr(model, name)[:] = getattr(known, name)
    model.opt.disableflags = known.opt.disableflags & ~int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[:] = held.qpos, held.qvel, held.qfrc_applied[: model.nu]
    data.qacc_warmstart[:] = held.qacc_warmstart
    A, B = np.zeros((2 * model.nv, 2 * model.nv)), np.zeros((2 * model.nv, model.nu))
    again = mujoco.MjData(model)
    for name in ("qpos", "qvel", "ctrl", "qacc_warmstart"):
        getattr(again, name)[:] = getattr(data, name)
    mujoco.mj_step(model, again)
    mujoco.mj_step(known, held)
    if np.abs(again.qpos - held.qpos).max() > 1e-12 or again.ncon != len(plant.contacts):
        raise Void("the model with motors is not that of the scene")
    return lambda: mujoco.mjd_transitionFD(model, data, EPSILON, True, A, B, None, None)


def show(figures: dict[str, Any]) -> None:
    """The table."""
    table = Table("row", "softhand [ms]", "MuJoCo [ms]", "ratio", "trimmed [ms]", "ratio")
    for name, found in figures.items():
        if "softhand_ms" in found:
            table.add_row(
                name, f"{found['softhand_ms']:.3f}", f"{found['mujoco_ms']:.3f}",
                f"{found['ratio_mujoco_over_softhand']:.2f}", f"{found['trimmed_mujoco_ms']:.3f}",
                f"{found['ratio_trimmed_mujoco_over_softhand']:.2f}",
            )  # fmt: skip
    Console().print(table)


if __name__ == "__main__":
    main()
