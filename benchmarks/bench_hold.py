"""A box held still: how far it creeps in MuJoCo and in softhand, and what a step takes.

Two spheres of 10 mm on slides press a box of 0.2 kg from both sides with 6 N, mu 0.5, steps of 1 ms, 60 s. Friction can
carry three times the weight, so that nothing should move. MuJoCo runs with its defaults and with settings against
creep; softhand with its defaults and a damped tip. MuJoCo's creep depends on the mass of the spheres, and is less the
heavier they are: they have 1 kg here, which is to its favour. The creep is the mean speed of the box in the second half
of the time that it is held. The time of a step is the median over pieces of 100 steps, each step
called from Python on both sides, without control.

Example: python benchmarks/bench_hold.py --json hold.json
"""

from __future__ import annotations

import argparse
import json
import math
import platform
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import mujoco
import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

import softhand
from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.steppers.midpoint import Midpoint
from softhand.validation.rigs import pinch

STEP = 1e-3  # [s]
FORCE = 6.0  # [N] a side
MU = 0.5
TIP_MASS = 1.0  # [kg]
PIECE = 100  # steps that are timed together

SCENE = """
<mujoco>
  <option timestep="{step}" {option}/>
  <worldbody>
    <body name="left" pos="-0.038 0 0"><joint type="slide" axis="1 0 0"/>
      <geom type="sphere" size="0.010" mass="{mass}" friction="{mu}"/></body>
    <body name="right" pos="0.038 0 0"><joint type="slide" axis="1 0 0"/>
      <geom type="sphere" size="0.010" mass="{mass}" friction="{mu}"/></body>
    <body name="box"><freejoint/>
      <inertial pos="0 0 0" mass="0.2" diaginertia="81.93e-6 112.78e-6 74.70e-6"/>
      <geom type="box" size="0.028 0.018 0.030" friction="{mu}"/></body>
  </worldbody>
</mujoco>
"""

MUJOCO = {
    "MuJoCo, defaults": "",
    "MuJoCo, impratio 10": 'impratio="10"',
    "MuJoCo, impratio 10, elliptic cone": 'cone="elliptic" impratio="10"',
    "MuJoCo, impratio 100, elliptic cone, 3 noslip iterations": 'cone="elliptic" impratio="100" noslip_iterations="3"',
}
"""Name and attributes of <option>."""


@dataclass(frozen=True)
class Result:
    """How one side held the box."""

    name: str
    creep: float
    """Mean speed of the box [m/s]."""
    moved: float
    """From 10 s to the end [m]; NaN if the box was lost before."""
    held: float
    """Until a contact was lost, or all the time [s]."""
    step_time: float
    """[s]."""


def hold(
    name: str, advance: Callable[[], None], height: Callable[[], float], holds: Callable[[], bool], duration: float
) -> Result:
    """Run one side, in pieces that are timed."""
    heights, took = [height()], []
    lost = duration
    for k in range(round(duration / STEP / PIECE)):
        began = time.perf_counter()
        for _ in range(PIECE):
            advance()
        took.append((time.perf_counter() - began) / PIECE)
        if not holds():
            lost = k * PIECE * STEP
            break
        heights.append(height())
    half = (len(heights) - 1) // 2
    span = (len(heights) - 1 - half) * PIECE * STEP
    creep = abs(heights[-1] - heights[half]) / span if span > 0.0 else math.nan
    late = round(10.0 / STEP / PIECE)
    moved = abs(heights[-1] - heights[late]) if len(heights) > late else math.nan
    return Result(name, creep, moved, lost, float(np.median(took)))


def hold_mujoco(name: str, duration: float) -> Result:
    """One of `MUJOCO`."""
    model = mujoco.MjModel.from_xml_string(SCENE.format(step=STEP, mu=MU, mass=TIP_MASS, option=MUJOCO[name]))
    data = mujoco.MjData(model)
    data.qfrc_applied[:2] = FORCE, -FORCE
    return hold(
        name, lambda: mujoco.mj_step(model, data), lambda: float(data.qpos[4]), lambda: data.ncon == 2, duration
    )


def hold_softhand(duration: float) -> Result:
    """The default stepper; a step before, so that compilation does not count."""
    stepper = Midpoint(step=STEP)
    pinch(FORCE, tip_mass=TIP_MASS, friction=MU, damping=KelvinVoigt()).run(stepper, 2 * STEP)
    rig = pinch(FORCE, tip_mass=TIP_MASS, friction=MU, damping=KelvinVoigt())
    integration = stepper.start(rig.plant)
    integration.torque[:] = rig.torque
    return hold(
        "softhand, defaults",
        lambda: integration.advance(rig.state, integration.torque),
        lambda: float(rig.position[2]),
        lambda: bool(np.all(rig.plant.contacts["force"][:, 2] > 0.0)),
        duration,
    )


def read_arguments() -> argparse.Namespace:
    """The command line."""
    summary, _, rest = (__doc__ or "").partition("\n")
    parser = argparse.ArgumentParser(
        description=summary, epilog=rest, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--duration", type=float, default=60.0, help="[s], 2 or more (default: %(default)s)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all results")
    arguments = parser.parse_args()
    if not arguments.duration >= 2.0:
        parser.error(f"--duration {arguments.duration:g}: at least 2 s are needed, of which the second half counts.")
    return arguments


def main() -> int:
    """Run all sides, report."""
    arguments, console = read_arguments(), Console()
    runs: list[Callable[[], Result]] = [lambda name=name: hold_mujoco(name, arguments.duration) for name in MUJOCO]  # type: ignore[misc]
    runs.append(lambda: hold_softhand(arguments.duration))
    results = [run() for run in track(runs, "holding", console=Console(stderr=True), transient=True)]
    table = Table(title=f"A box pinched for {arguments.duration:g} s", title_justify="left")
    for column in ("", "creep [um/s]", "moved after 10 s [m]", "held [s]", "time of a step [us]"):
        table.add_column(column, justify="right" if column else "left")
    for result in results:
        table.add_row(
            result.name,
            f"{1e6 * result.creep:.3g}",
            f"{result.moved:.2g}",
            f"{result.held:g}",
            f"{1e6 * result.step_time:.1f}",
        )
    console.print(table)
    if arguments.json:
        versions = {
            "python": platform.python_version(),
            "softhand": softhand.__version__,
            "mujoco": mujoco.__version__,
            "machine": platform.processor() or platform.machine(),
        }
        report = {"versions": versions, "results": [asdict(result) for result in results]}
        arguments.json.write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
        console.print(f"wrote {arguments.json}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
