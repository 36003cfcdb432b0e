"""Cost against size: time of a step, of a control period and of recording for hands of 2 to 10 fingers.

The hands have equal fingers of three joints in two rows, on opposite faces of a long box at points of their own; the
object is held at rest. No MuJoCo is needed. For each hand

step          one step of `midpoint` under the torques that hold the start, back to the start after each round;
              the line a + b n through the medians, n fingers
control       one control period of the loop without recording: reference, observation, check for faults, the law (59),
              effort limits, one step
recorded      the same by `Simulation.run`, which also records and makes the arrays of the recording
memory        bytes of one recorded sample times samples in a second

The number of internal forces grows as n (n - 1) / 2. With contacts in one plane, as here, they depend on each other
from four fingers on (else from five), and f_N = K^+ f_C then takes the stiffness of a truss, see `sensing.truss`: the
control period grows faster than the step.

All is timed on one core in many short rounds that take turns; given are medians.

Example: python benchmarks/bench_size.py --json size.json --plot size.png
"""

from __future__ import annotations

import argparse
import gc
import json
import math
import os
import platform
import random
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from rich.table import Column, Table

import softhand
from softhand.contact.pads import Fingertip
from softhand.contact.pairs import contact_pairs
from softhand.controllers.regulation import Regulation
from softhand.laws.nakashima import Nakashima
from softhand.model.body import ObjectModel
from softhand.model.hand import HandModel
from softhand.model.world import load_world
from softhand.plant.plant import Plant
from softhand.plots.style import STYLE
from softhand.references.goal import Goal
from softhand.references.reference import resting
from softhand.simulation.simulation import Simulation
from softhand.start.grasp import faces_of, solve_grasp
from softhand.steppers.midpoint import Midpoint

Array = NDArray[np.float64]

FINGERS = tuple(range(2, 11))
PERIOD = 0.001  # [s], of a step and of the control
STEPS = 50  # steps in a round
PERIODS = 100  # control periods in a round
WARM_UP = 3  # rounds that do not count
PACKAGES = ("softhand", "pin", "numba", "numpy", "scipy")
COLOURS = ("#0072B2", "#009E73", "#D55E00")

# Fingers and box, SI units -------------------------------------------------------------------------------------------

LENGTHS = (0.076, 0.051, 0.052)
BASE = 0.055  # of each row from the middle
SPACING = 0.022  # between fingers of a row
BOX, BOX_MASS = (0.056, 0.120, 0.060), 0.2
BOX_INERTIA = [BOX_MASS / 12.0 * sum(side**2 for k, side in enumerate(BOX) if k != axis) for axis in range(3)]
OBJECT_POSITION = (0.0, 0.0, 0.142)
GRIP = 4.0  # [N] of a finger
ELBOW_OUTWARD = (0.0, -0.65, 1.7)
FRICTION = 0.5
LAW = Nakashima(radius=0.010, k_r=0.377e6, k_phi=0.166e6, k_theta=0.0266e9, k_psi=0.0488e9)

LIMITS = {"abduction": ("0 1 0", -1.05, 1.05), "proximal": ("0 0 1", -1.75, 1.05), "distal": ("0 0 1", -0.1, 2.6)}
_LINK = """
  <joint name="{name}_{joint}" type="revolute">
    <parent link="{parent}"/><child link="{name}_{joint}_link"/><origin xyz="{xyz}" rpy="{rpy}"/>
    <axis xyz="{axis}"/><limit lower="{lower}" upper="{upper}" effort="2" velocity="20"/>
  </joint>
  <link name="{name}_{joint}_link">
    <inertial>
      <origin xyz="{middle} 0 0"/><mass value="0.070"/>
      <inertia ixx="2.04e-6" ixy="0" ixz="0" iyy="31.5e-6" iyz="0" izz="31.4e-6"/>
    </inertial>
  </link>"""
_TIP = """
  <joint name="{name}_mount" type="fixed">
    <parent link="{parent}"/><child link="{name}_tip"/><origin xyz="{xyz}"/>
  </joint>
  <link name="{name}_tip"/>"""
_BOX = """<robot name="box">
  <link name="box">
    <inertial>
      <mass value="{mass}"/><inertia ixx="{ixx}" ixy="0" ixz="0" iyy="{iyy}" iyz="0" izz="{izz}"/>
    </inertial>
    <collision><geometry><box size="{size}"/></geometry></collision>
  </link>
</robot>
"""


def places(n: int) -> list[tuple[int, float]]:
    """Row (1 or -1) and y [m] of each finger: n // 2 at x > 0, then the others at x < 0."""
    return [
        (side, SPACING * (k - 0.5 * (count - 1)))
        for side, count in ((1, n // 2), (-1, n - n // 2))
        for k in range(count)
    ]


def internal_forces(n: int) -> Array:
    """f_N [N]: fingers that face each other press; in an odd hand each presses against two, as in a truss."""
    front, force = n // 2, {}
    for k in range(front):
        if n % 2:
            force[k, front + k] = force[k, front + k + 1] = 0.5 * GRIP
        else:
            force[k, front + k] = GRIP
    return np.array([force.get(pair, 0.0) for pair in contact_pairs(n)])


def write_model(folder: Path, n: int) -> tuple[Path, Path]:
    """URDFs of a hand of n fingers and of the box."""
    hand, box = folder / f"hand_{n}.urdf", folder / "box.urdf"
    fingers = [_finger(f"finger_{k + 1}", side, y) for k, (side, y) in enumerate(places(n))]
    hand.write_text(f'<robot name="hand"><link name="palm"/>{"".join(fingers)}</robot>\n')
    ixx, iyy, izz = BOX_INERTIA
    box.write_text(_BOX.format(mass=BOX_MASS, ixx=ixx, iyy=iyy, izz=izz, size="{} {} {}".format(*BOX)))
    return hand, box


def _finger(name: str, side: int, y: float) -> str:
    parts, parent = [], "palm"
    xyz, rpy = f"{side * BASE} {y} 0", f"0 {-math.pi / 2} {side * math.pi / 2}"
    for (joint, (axis, lower, upper)), length in zip(LIMITS.items(), LENGTHS, strict=True):
        parts.append(_LINK.format(name=name, joint=joint, parent=parent, xyz=xyz, rpy=rpy, axis=axis, lower=lower,
                                  upper=upper, middle=0.5 * length))  # fmt: skip
        parent, xyz, rpy = f"{name}_{joint}_link", f"{length} 0 0", "0 0 0"
    return "".join([*parts, _TIP.format(name=name, parent=parent, xyz=xyz)])


def build_hand(folder: Path, n: int) -> Simulation:
    """A hand of n fingers that holds the box at rest, with the law (59)."""
    hand, box = write_model(folder, n)
    tips = [f"finger_{k + 1}_tip" for k in range(n)]
    world = load_world(HandModel.read(hand, tips), ObjectModel.read(box))
    points = [(side * 0.5 * BOX[0], y, 0.0) for side, y in places(n)]
    fingertips = [Fingertip(LAW, FRICTION, face) for face in faces_of(world, points)]
    force = internal_forces(n)
    grasp = solve_grasp(world, fingertips, points, force, OBJECT_POSITION, np.eye(3), np.tile(ELBOW_OUTWARD, n))
    pose = (*OBJECT_POSITION, 0.0, 0.0, 0.0)
    reference = resting(Goal(pose, force))
    plant, stepper = Plant(world, fingertips), Midpoint(step=PERIOD)
    return Simulation(plant, grasp.state, Regulation(), stepper, reference, PERIODS * PERIOD, PERIOD)


# Measuring -----------------------------------------------------------------------------------------------------------


@dataclass
class Timed:
    """Something to call again and again.

    Attributes:
        reset: called before each round, not timed.
        run: one round.
        count: what the time of a round is divided by.
        microseconds: one number a round.
    """

    reset: Callable[[], Any]
    run: Callable[[], Any]
    count: int
    microseconds: list[float] = field(default_factory=list)

    def time(self, counts: bool) -> None:
        """One round."""
        self.reset()
        began = time.perf_counter_ns()
        self.run()
        took = time.perf_counter_ns() - began
        if counts:
            self.microseconds.append(took / self.count / 1e3)

    @property
    def median(self) -> float:
        """[us]"""
        return float(np.median(self.microseconds))

    @property
    def quartiles(self) -> list[float]:
        """First and third quartile [us]."""
        return [float(value) for value in np.percentile(self.microseconds, [25, 75])]


@dataclass
class Hand:
    """A hand of some fingers and what is timed of it.

    Attributes:
        fingers: how many.
        step: physics under held torques.
        control: control periods without recording.
        recorded: `Simulation.run`.
        sample_bytes: of one sample.
    """

    fingers: int
    step: Timed
    control: Timed
    recorded: Timed
    sample_bytes: int

    @classmethod
    def of(cls, simulation: Simulation) -> Hand:
        """Ready to be timed; it must stay where it is held while it is."""
        holding, state = holding_torque(simulation), simulation.state
        advance, sample, step = simulation.integration.advance, simulation.sample, simulation.step

        def run_physics() -> None:
            for _ in range(STEPS):
                advance(state, holding)

        def run_control() -> None:
            for _ in range(PERIODS):
                sample()
                step()

        def begin_control() -> None:
            simulation.reset()
            sample()
            step()

        for run in (run_physics, run_control):
            simulation.reset()
            start = state.q.copy()
            run()
            if not np.max(np.abs(state.q - start)) < 1e-3:
                raise RuntimeError(f"a hand of {simulation.plant.world.n_tips} fingers does not hold its object.")
        return cls(
            simulation.plant.world.n_tips,
            Timed(simulation.reset, run_physics, STEPS),
            Timed(begin_control, run_control, PERIODS),
            Timed(simulation.reset, simulation.run, PERIODS),
            sample_bytes(simulation),
        )

    @property
    def timed(self) -> list[Timed]:
        """All that is timed."""
        return [self.step, self.control, self.recorded]

    @property
    def recording_cost(self) -> float:
        """What recording adds to a control period [us], median of the rounds."""
        return float(np.median(np.subtract(self.recorded.microseconds, self.control.microseconds)))


def holding_torque(simulation: Simulation) -> Array:
    """Joint torques [N m] that balance gravity and the contact forces of the start, shape (n,)."""
    plant, state = simulation.plant, simulation.state
    simulation.reset()
    plant.update(state.q, state.v, state.z)
    n = plant.world.n_joints
    return plant.snapshot.nle[:n] + np.einsum("irk,ir->k", plant.jacobian[:, :, :n], plant.contacts["force"])


def sample_bytes(simulation: Simulation) -> int:
    """Bytes of one recorded sample."""
    recording = simulation.run()
    return sum(array.nbytes for array in recording.variables.values()) // len(recording)


def measure(groups: Sequence[list[Timed]], rounds: int, what: str, console: Console) -> None:
    """Time all in rounds, each round in another order; those of a group one right after the other."""
    groups, shuffle = list(groups), random.Random(0).shuffle
    gc.collect()
    gc.disable()
    try:
        for index in track(range(-WARM_UP, rounds), what, console=console, transient=True):
            shuffle(groups)
            for group in groups:
                shuffle(group)
                for timed in group:
                    timed.time(index >= 0)
    finally:
        gc.enable()


# Results -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Line:
    """a + b n through the times of a step."""

    a: float
    """[us]"""
    b: float
    """[us] of a finger."""
    off: float
    """Largest deviation from the line, as a share of the time."""

    @classmethod
    def through(cls, hands: Sequence[Hand]) -> Line:
        """Least squares."""
        n, times = np.array([[hand.fingers, hand.step.median] for hand in hands]).T
        b, a = np.polyfit(n, times, 1)
        return cls(float(a), float(b), float(np.max(np.abs(times - a - b * n) / times)))

    def __str__(self) -> str:
        """In words."""
        return f"step = {self.a:.2f} us + {self.b:.2f} us a finger; off by {100.0 * self.off:.0f} % at most"


def draw_step_table(hands: Sequence[Hand]) -> Table:
    """Time of a step of each hand."""
    names = ("fingers", "joints", "us", "quartiles", "us a finger")
    table = Table(*(Column(name, justify="right") for name in names))
    table.title = f"One {1e3 * PERIOD:g} ms step of midpoint, one core"
    for hand in hands:
        n, middle, (low, high) = hand.fingers, hand.step.median, hand.step.quartiles
        table.add_row(f"{n}", f"{3 * n}", f"{middle:.2f}", f"{low:.2f} - {high:.2f}", f"{middle / n:.2f}")
    return table


def draw_period_table(hands: Sequence[Hand]) -> Table:
    """Time of a control period of each hand, and what recording costs."""
    names = ("fingers", "off us", "on us", "recording us", "kB a sample", "MB a second")
    table = Table(*(Column(name, justify="right") for name in names))
    table.title = "One control period, recording off and on"
    for hand in hands:
        kilobytes = 1e-3 * hand.sample_bytes
        table.add_row(
            f"{hand.fingers}", f"{hand.control.median:.1f}", f"{hand.recorded.median:.1f}",
            f"{hand.recording_cost:.1f}", f"{kilobytes:.2f}", f"{1e-3 * kilobytes / PERIOD:.2f}",
        )  # fmt: skip
    return table


def draw(hands: Sequence[Hand], line: Line) -> Figure:
    """Times over fingers, memory over fingers."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 3.0), layout="constrained")
        step, control, memory = figure.subplots(1, 3)
        n = np.array([hand.fingers for hand in hands])
        _draw_times(step, hands, "step", COLOURS[0], "")
        step.plot([0, n[-1]], [line.a, line.a + line.b * n[-1]], "--", color="0.4", lw=0.8, zorder=0)
        step.set_title(f"One step of midpoint: {line.a:.1f} + {line.b:.2f} n µs")
        _draw_times(control, hands, "control", COLOURS[1], "recording off")
        _draw_times(control, hands, "recorded", COLOURS[2], "recording on")
        control.legend(loc="upper left")
        control.set_title("One control period")
        for axes in (step, control):
            axes.set_ylabel("time [µs]")
        memory.plot(n, [1e-6 * hand.sample_bytes / PERIOD for hand in hands], "o-", ms=4, color=COLOURS[0])
        memory.set_ylabel("memory [MB]")
        memory.set_title("Memory of a recorded second")
        for axes in (step, control, memory):
            axes.set_xlim(0, n[-1] + 0.5)
            axes.set_ylim(bottom=0)
            axes.set_xlabel("fingers")
    return figure


def _draw_times(axes: Axes, hands: Sequence[Hand], name: str, colour: str, label: str) -> None:
    timed: list[Timed] = [getattr(hand, name) for hand in hands]
    n, middle = [hand.fingers for hand in hands], np.array([one.median for one in timed])
    spread = np.abs(np.array([one.quartiles for one in timed]).T - middle)
    axes.errorbar(n, middle, spread, fmt="o" if name == "step" else "o-", ms=4, lw=1.0, color=colour, label=label)


def report(hands: Sequence[Hand], line: Line) -> dict[str, Any]:
    """All results as plain data."""
    return {
        "hands": [
            {"fingers": hand.fingers, "sample_bytes": hand.sample_bytes}
            | {"recording_cost_microseconds": hand.recording_cost}
            | {
                f"{name}_microseconds": {"median": timed.median, "quartiles": timed.quartiles}
                for name, timed in zip(("step", "control", "recorded"), hand.timed, strict=True)
            }
            for hand in hands
        ],
        "line": {"a_microseconds": line.a, "b_microseconds": line.b, "largest_deviation": line.off},
        "versions": {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}},
    }


def read_arguments() -> argparse.Namespace:
    """The command line."""
    summary, _, rest = (__doc__ or "").partition("\n")
    parser = argparse.ArgumentParser(
        description=summary, epilog=rest, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=100, help="rounds that count (default: %(default)s)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all results")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="draw them (.png, .svg or .pdf)")
    return parser.parse_args()


def main() -> int:
    """Build, measure, report."""
    arguments, console = read_arguments(), Console()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    with console.status("Building the hands (the first time compiles)"), tempfile.TemporaryDirectory() as folder:
        hands = [Hand.of(build_hand(Path(folder), n)) for n in FINGERS]
    measure([hand.timed for hand in hands], arguments.rounds, "Sizes", console)
    line = Line.through(hands)
    console.print(draw_step_table(hands), str(line), draw_period_table(hands))
    if arguments.json:
        arguments.json.write_text(json.dumps(report(hands, line), indent=2) + "\n")
    if arguments.plot:
        softhand.save_figure(draw(hands, line), arguments.plot)
    return 0


if __name__ == "__main__":
    sys.exit(main())
