"""Hands, boxes and grasps for the tests: any number of fingers, a wrist, a continuous joint, the base turned."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from softhand.assembly.build import simulate
from softhand.contact.pads import Fingertip
from softhand.controllers.controller import Controller
from softhand.controllers.regulation import Regulation
from softhand.laws.law import Law
from softhand.laws.nakashima import Nakashima
from softhand.model.body import ObjectModel
from softhand.model.hand import HandModel
from softhand.model.world import World, load_world
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.plugins import SHIPPED, find_plugin
from softhand.recording.recording import Recording
from softhand.references.goal import Goal
from softhand.references.reference import Motion, resting
from softhand.scenario.scenario import load_scenario
from softhand.simulation.simulation import Simulation
from softhand.start.grasp import Grasp, faces_of, solve_grasp
from softhand.steppers.stepper import Stepper

Array = NDArray[np.float64]

REPOSITORY = Path(__file__).parents[1]
DATA = Path(__file__).parent / "data"
HAND_URDF = REPOSITORY / "urdf" / "three_finger_hand.urdf"
BOX_URDF = REPOSITORY / "urdf" / "box.urdf"

STEPPERS: dict[str, type[Stepper]] = {
    name: find_plugin("steppers", name, "stepper.name") for name in SHIPPED["steppers"]
}
"""Every stepper that ships."""

LENGTHS = (0.076, 0.051, 0.052)  # [m]
GRAVITY = (0.0, 0.0, -9.81)  # [m/s^2]
BOX_INERTIA = (81.93e-6, 112.78e-6, 74.70e-6)  # [kg m^2]
MU = 0.5
CONTACT_POINTS = ((0.028, 0.0, 0.0), (-0.028, 0.0, 0.0), (0.0, -0.018, -0.005))  # [m], object frame
START_FORCE = (4.0, 4.0, 3.0)  # [N]
START_POSITION = (0.0, 0.010, 0.142)  # [m]
FINGER_GUESS = (0.0, -0.65, 1.7)  # [rad], elbow outward

REFERENCE_BASES = ((0.055, 0.040, math.pi / 2), (-0.055, 0.040, -math.pi / 2), (0.0, -0.020, 0.0))
"""x, y [m] and heading [rad] of each finger's base; at the heading 0 a finger faces +y."""


ARM_IN_THE_AIR: dict[str, Any] = {
    "grasp.opening": 0.0, "grasp.standoff": [0.0, 0.0, 0.0], "grasp.internal_force": [5.0, 5.0, 4.0], "table": None,
    "object.position": [0.40, 0.12, 0.11], "reference": {"kind": "hold"},
}  # fmt: skip
"""Of `arm-pick-and-place`: the run starts with the box held in the air."""


def ring(count: int, radius: float) -> list[tuple[float, float, float]]:
    """Bases spread evenly on a circle [m], the first on +x, all facing its centre."""
    angles = [2.0 * math.pi * k / count for k in range(count)]
    return [(radius * math.cos(angle), radius * math.sin(angle), angle + math.pi / 2) for angle in angles]


# ----------------------------------------------------------------------------------------------------------- URDF files


def _numbers(values: ArrayLike) -> str:
    return " ".join(repr(float(value)) for value in np.asarray(values))


_LIMITS = {"abduction": (-1.05, 1.05), "proximal_flexion": (-1.75, 1.05), "distal_flexion": (-0.1, 2.6)}


def _finger(name: str, base: Sequence[float], continuous: bool, tip_rpy: Sequence[float]) -> str:
    """Links and joints of one finger of the reference hand."""
    x, y, heading = base
    parts = []
    parent, origin = "palm", f'<origin xyz="{_numbers([x, y, 0.0])}" rpy="0 {-math.pi / 2!r} {heading!r}"/>'
    joints = zip(_LIMITS.items(), ("proximal", "middle", "distal"), LENGTHS, strict=True)
    for (joint, (lower, upper)), link, length in joints:
        axis = "0 1 0" if joint == "abduction" else "0 0 1"
        kind, limit = "revolute", f'lower="{lower}" upper="{upper}" '
        if continuous and joint == "abduction":
            kind, limit = "continuous", ""
        parts.append(
            f"""
  <joint name="{name}_{joint}" type="{kind}">
    <parent link="{parent}"/><child link="{name}_{link}"/>{origin}
    <axis xyz="{axis}"/><limit {limit}effort="2" velocity="20"/>
  </joint>
  <link name="{name}_{link}">
    <inertial>
      <origin xyz="{length / 2!r} 0 0"/><mass value="0.070"/>
      <inertia ixx="2.04e-6" ixy="0" ixz="0" iyy="31.5e-6" iyz="0" izz="31.4e-6"/>
    </inertial>
  </link>"""
        )
        parent, origin = f"{name}_{link}", f'<origin xyz="{length!r} 0 0"/>'
    origin = f'<origin xyz="{length!r} 0 0" rpy="{_numbers(tip_rpy)}"/>'
    parts.append(
        f"""
  <joint name="{name}_tip_mount" type="fixed"><parent link="{parent}"/><child link="{name}_tip"/>{origin}</joint>
  <link name="{name}_tip"/>"""
    )
    return "".join(parts)


def write_hand(
    folder: Path,
    bases: Sequence[Sequence[float]],
    *,
    wrist: bool = False,
    continuous: bool = False,
    tip_rpy: Sequence[float] = (0.0, 0.0, 0.0),
    turn: ArrayLike | None = None,
    shift: ArrayLike = (0.0, 0.0, 0.0),
) -> Path:
    """A URDF of a hand of equal fingers, each as in the reference hand.

    Args:
        folder: where `hand.urdf` is written.
        bases: x, y [m] and heading [rad] of each finger.
        wrist: put one revolute joint about x, and the mass of a palm, before the fingers.
        continuous: make the abduction joints continuous.
        tip_rpy: how the soft tips are canted against the last links [rad].
        turn: rotation of the whole hand, shape (3, 3).
        shift: position of the whole hand [m], shape (3,).
    """
    rpy = pin.rpy.matrixToRpy(np.eye(3) if turn is None else np.asarray(turn))
    origin = f'<origin xyz="{_numbers(shift)}" rpy="{_numbers(rpy)}"/>'
    palm = '<link name="palm"/>'
    kind = 'type="fixed"'
    if wrist:
        kind = 'type="revolute"'
        origin += '<axis xyz="1 0 0"/><limit lower="-0.5" upper="0.5" effort="20" velocity="20"/>'
        palm = """<link name="palm"><inertial><origin xyz="0.003 0.01 -0.018"/><mass value="0.3"/>
    <inertia ixx="2.6e-4" ixy="1e-5" ixz="0" iyy="5.7e-4" iyz="0" izz="8.1e-4"/></inertial></link>"""
    fingers = [_finger(f"finger_{k + 1}", base, continuous, tip_rpy) for k, base in enumerate(bases)]
    file = Path(folder) / "hand.urdf"
    file.write_text(
        f"""<?xml version="1.0"?>
<robot name="hand">
  <link name="base"/>
  <joint name="mount" {kind}><parent link="base"/><child link="palm"/>{origin}</joint>
  {palm}{"".join(fingers)}
</robot>
"""
    )
    return file


def write_box(
    folder: Path,
    size: Sequence[float] = (0.056, 0.036, 0.060),
    mass: float = 0.2,
    centre_of_mass: Sequence[float] = (0.0, 0.0, 0.0),
    middle: Sequence[float] = (0.0, 0.0, 0.0),
    rpy: Sequence[float] = (0.0, 0.0, 0.0),
) -> Path:
    """A URDF of a box [m, kg]; the principal inertias are those of the reference box, scaled with the mass.

    Args:
        folder: where `box.urdf` is written.
        size: along x, y and z [m].
        mass: [kg].
        centre_of_mass: in the object frame [m].
        middle: of the box in the object frame [m].
        rpy: how the box is turned in the object frame [rad].
    """
    inertia = [mass / 0.2 * principal for principal in BOX_INERTIA]
    file = Path(folder) / "box.urdf"
    file.write_text(
        f"""<?xml version="1.0"?>
<robot name="box">
  <link name="box">
    <inertial>
      <origin xyz="{_numbers(centre_of_mass)}"/><mass value="{mass!r}"/>
      <inertia ixx="{inertia[0]!r}" ixy="0" ixz="0" iyy="{inertia[1]!r}" iyz="0" izz="{inertia[2]!r}"/>
    </inertial>
    <collision>
      <origin xyz="{_numbers(middle)}" rpy="{_numbers(rpy)}"/><geometry><box size="{_numbers(size)}"/></geometry>
    </collision>
  </link>
</robot>
"""
    )
    return file


# ---------------------------------------------------------------------------------------------------- hand with a grasp


@dataclass(frozen=True)
class Task:
    """A hand that holds an object at rest."""

    world: World
    fingertips: tuple[Fingertip, ...]
    grasp: Grasp
    contact_points: tuple[tuple[float, ...], ...]
    internal_force: tuple[float, ...]

    def plant(self) -> Plant:
        """A plant of its own, as plants keep their last state."""
        return Plant(self.world, self.fingertips)


def make_law(stiffness: float = 1.0) -> Nakashima:
    """The paper's tip, all coefficients times a factor."""
    return Nakashima(
        radius=0.010,
        k_r=0.377e6 * stiffness,
        k_phi=0.166e6 * stiffness,
        k_theta=0.0266e9 * stiffness,
        k_psi=0.0488e9 * stiffness,
    )


def world_from(
    hand: Path, tips: Sequence[str], box: Path, gravity: Sequence[float] = (0.0, 0.0, -9.81), **options: Any
) -> World:
    """Hand and object from their files; options of the object."""
    return load_world(HandModel.read(hand, tips), ObjectModel.read(box, **options), gravity)


def make_fingertips(world: World, law: Law, contact_points: Sequence[ArrayLike]) -> tuple[Fingertip, ...]:
    """One tip of that law a contact point."""
    return tuple(Fingertip(law, MU, face) for face in faces_of(world, contact_points))


@cache
def reference_task(stiffness: float = 1.0) -> Task:
    """The reference hand and box, from the URDFs that ship, in their grasp at the start."""
    names = [f"finger_{k}_tip" for k in (1, 2, 3)]
    world = world_from(HAND_URDF, names, BOX_URDF)
    fingertips = make_fingertips(world, make_law(stiffness), CONTACT_POINTS)
    grasp = solve_grasp(
        world, fingertips, CONTACT_POINTS, START_FORCE, START_POSITION, np.eye(3), np.tile(FINGER_GUESS, 3)
    )
    return Task(world, fingertips, grasp, CONTACT_POINTS, START_FORCE)


@dataclass(frozen=True)
class Layout:
    """A hand of fingers of the reference hand, and the grasp that it holds the box with."""

    bases: Sequence[Sequence[float]]
    contact_points: tuple[tuple[float, ...], ...]
    internal_force: tuple[float, ...]
    position: tuple[float, ...]
    wrist: float | None = None
    """Angle of the wrist [rad], None without one."""
    continuous: bool = False
    centre_of_mass: tuple[float, ...] = (0.0, 0.0, 0.0)
    """Of the box, in its frame [m]."""
    tip_rpy: tuple[float, ...] = (0.0, 0.0, 0.0)
    """How the soft tips are canted against the last links [rad]."""

    def load(
        self,
        folder: Path,
        turn: ArrayLike | None = None,
        shift: ArrayLike = (0.0, 0.0, 0.0),
        gravity: Sequence[float] = GRAVITY,
    ) -> World:
        """Write the URDFs and read them, the hand turned and shifted as a whole."""
        hand = write_hand(
            folder,
            self.bases,
            wrist=self.wrist is not None,
            continuous=self.continuous,
            tip_rpy=self.tip_rpy,
            turn=turn,
            shift=shift,
        )
        names = [f"finger_{k + 1}_tip" for k in range(len(self.bases))]
        box = write_box(folder, centre_of_mass=self.centre_of_mass)
        return world_from(hand, names, box, gravity)

    def task(self, folder: Path) -> Task:
        """The hand at its start."""
        world = self.load(folder)
        fingertips = make_fingertips(world, make_law(), self.contact_points)
        guess = [*([] if self.wrist is None else [self.wrist]), *np.tile(FINGER_GUESS, len(self.bases))]
        grasp = solve_grasp(
            world, fingertips, self.contact_points, self.internal_force, self.position, np.eye(3), guess
        )
        return Task(world, fingertips, grasp, self.contact_points, self.internal_force)


REFERENCE = Layout(REFERENCE_BASES, CONTACT_POINTS, START_FORCE, START_POSITION)
LAYOUTS = {
    "reference": REFERENCE,
    # the centre of mass lies on the line between the contacts: two points carry no moment about it
    "two fingers": Layout(ring(2, 0.055), ((0.028, 0.0, 0.0), (-0.028, 0.0, 0.0)), (5.0,), (0.0, 0.0, 0.142)),
    # contacts not in one plane, so that K has its full rank 6
    "four fingers": Layout(
        ring(4, 0.045),
        ((0.028, 0.0, 0.004), (0.0, 0.018, -0.004), (-0.028, 0.0, 0.004), (0.0, -0.018, -0.004)),
        (0.4, 4.0, 0.5, 0.6, 5.0, 0.3),
        (0.0, 0.0, 0.142),
    ),
    "wrist": replace(REFERENCE, wrist=0.05),
    "continuous": replace(REFERENCE, continuous=True),
    "canted": replace(REFERENCE, centre_of_mass=(0.003, 0.002, -0.005), tip_rpy=(0.4, 0.15, -0.2)),
}


def make_named_task(name: str, folder: Path) -> Task:
    """A task of `LAYOUTS`; the reference hand is the one that ships."""
    return reference_task() if name == "reference" else LAYOUTS[name].task(folder)


def random_state(task: Task, rng: np.random.Generator) -> State:
    """A moving state near the grasp: joints 0.01 rad, object 1 mm and 0.2 rad away, everything rolling and turning."""
    n = task.world.n_joints
    away = np.concatenate([rng.normal(0.0, 0.01, n), rng.normal(0.0, 1e-3, 3), rng.normal(0.0, 0.2, 3)])
    v = np.concatenate([rng.normal(0.0, 1.0, n), rng.normal(0.0, 0.2, 3), rng.normal(0.0, 1.5, 3)])
    start = task.grasp.state
    return State(pin.integrate(task.world.model, start.q, away), v, start.z + rng.normal(0.0, 0.05, start.z.shape))


def holding_torque(plant: Plant, state: State) -> Array:
    """Joint torques [N m] that balance gravity and the contact forces at a state, shape (n,)."""
    plant.update(state.q, state.v, state.z)
    n = plant.world.n_joints
    by_force = np.einsum("irk,ir->k", plant.jacobian[:, :, :n], plant.contacts["force"])
    return plant.snapshot.nle[:n] + by_force - plant.moment_force()[:n]


def start_acceleration(task: Task) -> Array:
    """All accelerations at the start under the holding torques, shape (nv,)."""
    plant = task.plant()
    torque = holding_torque(plant, task.grasp.state)
    return plant.acceleration(torque, np.zeros(task.world.model.nv))


# ----------------------------------------------------------------------------------------------------------------- runs


def resting_reference(task: Task) -> Motion:
    """The pose and the internal force of the start, for ever."""
    start = (*task.grasp.state.q[-7:-4], 0.0, 0.0, 0.0)
    return resting(Goal(start, task.internal_force))


def run(
    task: Task,
    stepper: Stepper,
    duration: float,
    controller: Controller | None = None,
    reference: Motion | None = None,
) -> Recording:
    """A run from the start of a task at a control period of 1 ms; by default Eq. (59) holds the starting pose."""
    controller, reference = controller or Regulation(), reference or resting_reference(task)
    return Simulation(task.plant(), task.grasp.state, controller, stepper, reference, duration, 1e-3).run()


def run_reference(stepper: str, kind: str, compensation: bool, step: float = 1e-3) -> dict[str, Array]:
    """Target A, 2 s at a control period of 1 ms: the columns of the reference files, one row every 10 ms."""
    changes = {
        "stepper.name": stepper,
        "stepper.step": step,
        "reference.kind": kind,
        "controller.torsion_compensation": compensation,
    }
    recording = simulate(load_scenario("target-a", changes))
    groups = (
        recording.object_position,
        recording.object_rpy,
        recording.internal_force,
        recording.deformation[..., 0],
        recording.deformation[..., 1:],
        recording.contact_angles[..., 1],
        recording.contact_force[..., :3],
        recording.contact_force[..., 3],
        recording.joint_position,
        recording.joint_torque,
        recording.friction_use * MU,
    )
    rows = np.concatenate([group.reshape(len(recording), -1)[::10] for group in groups], axis=1)
    names = [name for group in COLUMNS.values() for name in group]
    return dict(zip(names, rows.T, strict=True))


_FINGERS = (1, 2, 3)
COLUMNS: dict[str, list[str]] = {
    "position [m]": [f"object_{axis}_m" for axis in "xyz"],
    "orientation [rad]": [f"object_{angle}_rad" for angle in ("roll", "pitch", "yaw")],
    "internal force [N]": [f"internal_force_{pair}_N" for pair in ("23", "13", "12")],
    "compression [m]": [f"f{i}_delta_r_m" for i in _FINGERS],
    "deformation angle [rad]": [f"f{i}_delta_{angle}_rad" for i in _FINGERS for angle in ("theta", "phi", "psi")],
    "Phi [rad]": [f"f{i}_Phi_rad" for i in _FINGERS],
    "force [N]": [f"f{i}_f{axis}_N" for i in _FINGERS for axis in "xyz"],
    "torsion [N m]": [f"f{i}_torsion_Nm" for i in _FINGERS],
    "joint [rad]": [f"f{i}_q{k}_rad" for i in _FINGERS for k in (1, 2, 3)],
    "torque [N m]": [f"f{i}_torque{k}_Nm" for i in _FINGERS for k in (1, 2, 3)],
    "friction ratio [1]": [f"f{i}_friction_ratio" for i in _FINGERS],
}
"""Columns of the reference files, by what they are."""


@cache
def read_reference(kind: str, compensation: bool) -> dict[str, Array]:
    """Columns of a reference file."""
    name = f"{kind}_{'compensated' if compensation else 'uncompensated'}.csv"
    with (DATA / name).open(newline="") as file:
        header, *rows = csv.reader(file)
    return dict(zip(header, np.array(rows, dtype=float).T, strict=True))


def deviations(columns: dict[str, Array], expected: dict[str, Array]) -> dict[str, float]:
    """Largest absolute deviation of each group of `COLUMNS`."""
    return {
        group: max(float(np.max(np.abs(columns[name] - expected[name]))) for name in names)
        for group, names in COLUMNS.items()
    }


def numerical_jacobian(function: Callable[[Array], Array], size: int, step: float = 1e-6) -> Array:
    """Central differences of a function of a small displacement, shape (*function's shape, size)."""
    columns = []
    for k in range(size):
        move = np.zeros(size)
        move[k] = step
        columns.append((np.asarray(function(move)) - np.asarray(function(-move))) / (2.0 * step))
    return np.stack(columns, axis=-1)
