"""How stiff an object is held: the wrench that a small displacement of it needs, and what gives way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from softhand.assembly.unmodelled import must_slip_as_a_whole
from softhand.closed_loop.feedback import Feedback, differentiate
from softhand.closed_loop.object_tangent import about_couples, inverse, length_of, principal, tangent
from softhand.closed_loop.start import HeldStart, held_end, held_sample, held_start, held_state
from softhand.errors import ControllerError, GraspError, ScenarioError
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.numerics.table import html_table
from softhand.plant.state import State
from softhand.plugins import plugin_name
from softhand.recording.recording import Recording
from softhand.scenario.scenario import Scenario, as_scenario
from softhand.settings.guesses import did_you_mean

_WAYS = ("x", "y", "z", "turn about x", "turn about y", "turn about z")
_SYMMETRIC = 1e-6
_MOVING = 1e-4  # [N] from which a wrench is said to be left
_SUM = 1e-6
_ZERO = 1e-7  # of the largest stiffness
_MODES = ("locked", "controller")


@dataclass(frozen=True, eq=False, repr=False)
class GraspStiffness(Record):
    """The stiffness of a held object about its origin: (force, moment) = stiffness (translation, rotation vector).

    In world axes, of small displacements at rest. The wrench is what has to be put on the object from outside.

    Attributes:
        stiffness: [N/m, N / N, N m/rad], shape (6, 6).
        compliance: its inverse, shape (6, 6); NaN if some displacement needs no wrench.
        translation: principal stiffnesses of an object that does not turn, the least first [N/m], shape (3,).
        translation_directions: a row for each, in the world, shape (3, 3).
        rotation: those of an object that a pure couple turns while it shifts as it likes [N m/rad], shape (3,).
        rotation_directions: a row for each, in the world, shape (3, 3).
        names: of the rows and columns of stiffness and compliance.
        joints: what holds them, in words.
        joint_stiffness: of each joint [N m/rad or N/m], shape (n,); infinite for locked ones, NaN for a controller.
        position: origin of the object in the world [m].
        length: by which moments count as forces, the root of the mean squared distance of its mass from its centre [m].
        unbalanced: wrench of contacts, supports and gravity on the object [N, N m], zero at rest, shape (6,).
        torque_left: what the controller asks of each joint there beyond what keeps it at rest [N m or N], shape (n,).
        time: of the sample of a run [s]; 0 for the start.
    """

    units: ClassVar = {
        "stiffness": "N/m, N; N, N m/rad", "compliance": "m/N, 1/N; 1/N, rad/(N m)", "translation": "N/m",
        "translation_directions": "1", "rotation": "N m/rad", "rotation_directions": "1",
        "joint_stiffness": "N m/rad, N/m", "position": "m", "length": "m", "unbalanced": "N, N m",
        "torque_left": "N m, N", "time": "s", "asymmetry": "1",
    }  # fmt: skip

    stiffness: Array
    compliance: Array
    translation: Array
    translation_directions: Array
    rotation: Array
    rotation_directions: Array
    names: tuple[str, ...]
    joints: str
    joint_stiffness: Array
    position: Array
    length: float
    unbalanced: Array
    torque_left: Array
    time: float = 0.0

    @property
    def asymmetry(self) -> float:
        """|K - K^T| / |K + K^T|, moments over `length`: zero for springs at rest, not for tips without an energy."""
        scale = np.repeat([1.0, 1.0 / self.length], 3)
        K = self.stiffness * np.outer(scale, scale)
        return float(np.linalg.norm(K - K.T) / np.linalg.norm(K + K.T))

    def __repr__(self) -> str:
        return f"<GraspStiffness: {', '.join(' '.join(row) for row in self.rows())}>"

    def _repr_html_(self) -> str:
        """The table of the command, for a notebook."""
        return html_table("Stiffness of the held object", self.header, self.rows(), self.notes())

    header: ClassVar = ("principal stiffness", "value", "direction in the world")

    def rows(self) -> list[tuple[str, str, str]]:
        """What, how much and along or about which direction, of each line of the table."""
        which = ("softest", "middle", "stiffest")
        shifts = zip(which, self.translation, self.translation_directions, strict=True)
        turns = zip(which, self.rotation, self.rotation_directions, strict=True)
        return [
            *((f"translation, {name}", f"{1e-3 * value:.4g} N/mm", _direction(row)) for name, value, row in shifts),
            *((f"rotation, {name}", f"{value:.4g} N m/rad", _direction(row)) for name, value, row in turns),
        ]

    def notes(self) -> list[str]:
        """What a reader of the numbers must know."""
        about = f"the sample at t = {self.time:g} s" if self.time else "the start"
        found = [f"About {about}, {self.joints}."]
        if self.asymmetry > _SYMMETRIC:
            found.append(
                f"The matrix is not symmetric, by {100.0 * self.asymmetry:.2g} %; the principal values are those of "
                "its symmetric part."
            )
        if np.isnan(self.compliance).any():
            found.append("Some displacement needs no wrench: there is no compliance.")
        if any(values[0] < -_ZERO * values[-1] for values in (self.translation, self.rotation)):
            found.append("A negative stiffness: a small displacement that way grows by itself.")
        if np.max(np.abs(self.unbalanced / np.repeat([1.0, self.length], 3))) > _MOVING:
            force, moment = np.linalg.norm(self.unbalanced[:3]), np.linalg.norm(self.unbalanced[3:])
            found.append(f"The object is not at rest there: {force:.3g} N and {moment:.3g} N m are left on it.")
        left = np.max(np.abs(self.torque_left))
        if left > _MOVING:
            found.append(
                f"The joints do not rest there under the controller, whose torques are off by up to {left:.3g} N m; "
                "simulate until they do, and look at the recording."
            )
        return found


def grasp_stiffness(
    source: Scenario | Recording | str | Path,
    at: float | None = None,
    joints: str | float | Sequence[float] = "locked",
    state: State | None = None,
) -> GraspStiffness:
    """The 6 x 6 stiffness and compliance of a held object, at the start of a scenario or at a time of a run.

    It is the derivative of what contact forces and gravity do to the object: the stiffness of the law, the rolling of
    the tips with their deformation, and the turning of forces and contact points. Tips stick; what relaxes has relaxed;
    supports in touch hold too. Joints that give way are taken out of the tangent of hand and object,

        K = K_oo - K_oj (K_jj + springs)^-1 K_jo

    Args:
        source: a scenario whose start is held, its name or path, or a recording.
        at: time in the recording, of which the nearest sample is taken [s]; without it the quietest sample since the
            reference rests, the last one if it never does. Not for a scenario.
        joints: "locked"; stiffness of the springs at the joints [N m/rad or N/m], one for all or one for each, which
            hold the torques of rest; or "controller", whose torques follow from the state at rest, effort limits aside.
        state: of a scenario, such as that of an `Equilibrium`, in place of its start.

    Raises:
        GraspError: no tip touches the object, or some motion of the joints needs no torque.
        ScenarioError: `at` or `joints` cannot be used.
        ControllerError: the torque depends on a sum over time, which has no value at rest.
        RecordingError: the recording is empty or does not reach to `at`, or its scenario cannot be read.
    """
    start = _start(source, at, state)
    must_slip_as_a_whole("The stiffness of a grasp", start.probe.plant.fingertips)
    plant, world, state = start.probe.plant, start.probe.plant.world, start.state
    springs = _springs(joints, world.joint_names)
    still = State(state.q, np.zeros_like(state.v), state.z)
    plant.update(*still.arrays)
    if not np.any(plant.tip_contacts["deformation"][:, 0] > 0.0):
        remedy = "give `at`, a time at which it is held" if isinstance(source, Recording) else "set grasp.opening = 0"
        raise GraspError(
            f"no fingertip touches the object at t = {start.time:g} s: nothing holds it; {remedy}.",
            finger="", quantity="force", value=0.0,
        )  # fmt: skip
    torque_left = np.zeros(world.n_joints)
    if springs is None:
        start.must_be_known("The stiffness of a grasp under its controller")
        name = plugin_name("controllers", type(start.controller))
        control = differentiate(start.controller, start.probe, still, start.period)
        found, words = tangent(plant, still, settled(control, name)), f"joints held by the controller {name}"
        stiffness, springs = _require(found.with_torques(), name), np.full(world.n_joints, np.nan)
        torque_left = control.torque - found.held
    else:
        found, words = tangent(plant, still), "joints held by springs"
        stiffness = found.with_joints(1.0 / springs)
        if np.isinf(springs).all():
            words = "joints locked"
    length = length_of(world.model.inertias[world.object_joint])
    return GraspStiffness(
        stiffness,
        inverse(stiffness, length),
        *principal(stiffness[:3, :3]),
        *principal(about_couples(stiffness)),
        names=_WAYS,
        joints=words,
        joint_stiffness=springs,
        position=np.array(world.object_position(state.q)),
        length=length,
        unbalanced=found.unbalanced,
        torque_left=torque_left,
        time=start.time,
    )


def _require(stiffness: Array | None, controller: str) -> Array:
    if stiffness is None:
        raise GraspError(
            f"controller '{controller}' leaves some motion of the joints without torque: there is no rest beside the "
            "goal; give `joints` stiffnesses.",
            finger="", quantity="torque", value=0.0,
        )  # fmt: skip
    return stiffness


def _start(source: Scenario | Recording | str | Path, at: float | None, state: State | None) -> HeldStart:
    if isinstance(source, Recording):
        if state is not None:
            raise ScenarioError(
                "state: is for a scenario; of a recording give `at`, the time of a sample.", key="state", value=state
            )
        return held_end(source) if at is None else held_sample(source, at)
    if at:
        raise ScenarioError(
            f"at: got {at:g} s for a scenario, which is looked at at its start; simulate it and give the recording.",
            key="at", value=at,
        )  # fmt: skip
    scenario = as_scenario(source)
    return held_start(scenario) if state is None else held_state(scenario, state)


def _springs(joints: str | float | Sequence[float], names: Sequence[str]) -> Array | None:
    """Stiffness of each joint, infinite if locked; None for those of a controller."""
    if isinstance(joints, str):
        if joints not in _MODES:
            raise ScenarioError(
                f"joints: got {joints!r}; allowed are 'locked', 'controller' and stiffnesses in N m/rad"
                f"{did_you_mean(joints, _MODES)}",
                key="joints", value=joints,
            )  # fmt: skip
        return np.full(len(names), np.inf) if joints == "locked" else None
    values = np.asarray(joints, dtype=float)
    if values.shape not in ((), (len(names),)):
        raise ScenarioError(
            f"joints: got stiffnesses of shape {values.shape}; give one number, or one for each of the {len(names)} "
            f"joints {', '.join(names)}.",
            key="joints", value=joints,
        )  # fmt: skip
    if not np.all(values > 0.0):
        raise ScenarioError(
            f"joints: got {joints}; each stiffness has to be above 0 N m/rad, inf for a locked joint.",
            key="joints", value=joints,
        )  # fmt: skip
    return np.broadcast_to(values, len(names)).copy()


def settled(control: Feedback, name: str) -> Array:
    """Torques of a controller by the state, its memory where it comes to rest, shape (n, s)."""
    if control.is_smooth:
        return control.by_state
    moving = np.eye(len(control.memory_by_memory)) - control.memory_by_memory
    values = np.linalg.svd(moving, compute_uv=False)
    if values[-1] <= _SUM * values[0]:
        raise ControllerError(
            f"controller '{name}': its torque depends on a sum over time, which never comes to rest beside the goal; "
            "give `joints` stiffnesses, or take a controller without an integral.",
            controller=name,
        )
    by_state: Array = control.by_state + control.by_memory @ np.linalg.solve(moving, control.memory_by_state)
    return by_state


def _direction(row: Array) -> str:
    return "(" + ", ".join(f"{value + 0.0:.3f}" for value in np.round(row, 3)) + ")"
