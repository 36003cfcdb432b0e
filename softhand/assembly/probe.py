"""The plant of a scenario or of a recording at any state, without simulating."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from softhand.assembly.parts import read_motion
from softhand.assembly.plant import read_plant
from softhand.errors import LawError, RecordingError, ScenarioError
from softhand.laws.law import Law
from softhand.numerics.spatial import rotation_of
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.recording.recorded import recorded_table
from softhand.recording.recording import Recording
from softhand.references.reference import Motion
from softhand.scenario.scenario import Scenario
from softhand.sensing.instruments import Instruments
from softhand.sensing.observation import Observation
from softhand.sensing.quantities import Sensing
from softhand.sensing.seen import Parts
from softhand.sensing.sensor import Sensor
from softhand.settings.settings import read_settings


class Probe:
    """A plant and a sensor that can be put at any state.

    Attributes:
        plant: with all that belongs to the last state.
        reference: what the controller is asked for.
        laws: fingertip law of each contact.

    Args:
        plant: as the attribute.
        reference: likewise.
        sensing: instruments, whose bias `seen` has; no more of them, as nothing moves here.
    """

    def __init__(self, plant: Plant, reference: Motion, sensing: Sensing | None = None) -> None:
        self.plant, self.reference = plant, reference
        self.laws: list[Law] = [fingertip.law for fingertip in plant.fingertips]
        world, n_memory = plant.world, plant.n_memory
        self._state = State(
            pin.neutral(world.coordinates), np.zeros(world.nv), np.zeros((len(plant.contacts), n_memory))
        )
        self._sensor = Sensor(plant, reference.desired)
        self._instruments: Instruments | None = None
        if sensing is not None:
            truth = self._sensor.observation
            self._instruments = Instruments(plant, truth, sensing.still(), reference.desired)

    @classmethod
    def of_scenario(cls, scenario: Scenario, law: Law | None = None) -> Probe:
        """The plant of a scenario, with another law at all tips if one is given."""
        return cls(read_plant(scenario, law), read_motion(scenario))

    def at(self, state: State, time: float) -> Observation:
        """What is observed at a state and a time [s]. Live: the next call overwrites it."""
        for mine, given in ((self._state.q, state.q), (self._state.v, state.v), (self._state.z, state.z)):
            mine[...] = given
        self.reference.update(time)
        return self._sensor.observe(self._state, time)

    def seen(self, state: State, time: float) -> Observation:
        """What a controller sees there: the same through the instruments, if there are any."""
        truth = self.at(state, time)
        if self._instruments is None:
            return truth
        self._instruments.forget()
        return self._instruments.see(0)

    def become(self, sensing: Sensing) -> None:
        """Have instruments of other numbers, of the same quantities."""
        assert self._instruments is not None and self._instruments.become(sensing.still())

    @property
    def measured(self) -> Parts:
        """What the instruments measure, by quantity, as it was when `seen` was asked: without their errors. Live."""
        assert self._instruments is not None
        return self._instruments.truth

    def require_polar(self) -> None:
        """LawError unless all laws are in the paper's coordinates, in which Theorem 1 is stated, and without memory."""
        for tip_law, fingertip in zip(self.laws, self.plant.fingertips, strict=True):
            law, damping = type(tip_law).__name__, type(fingertip.damping).__name__
            if tip_law.coordinates != "polar":
                what = f"law '{law}': V and L of Theorem 1 are stated in dr, dtheta, dphi, dpsi, as nakashima has them"
            elif fingertip.damping.relaxation():
                what = f"damping '{damping}': V and L of Theorem 1 are stated for tips without relaxing damping"
            else:
                continue
            raise LawError(f"{what}; `softhand stability` takes others.", law=law)


def recorded_scenario(recording: Recording) -> Scenario:
    """The scenario of a recording.

    Raises:
        RecordingError: it was made without a scenario, or with a plugin that is not installed.
    """
    try:
        return read_settings(Scenario, recorded_table(recording), "")
    except ScenarioError as error:
        raise RecordingError(
            f"The recording cannot be computed anew, as its scenario cannot be read: {error}", file=None
        ) from error


_STATE = ("joint_position", "joint_velocity", "object_position", "object_rpy", "object_twist", "deformation")


def check_states(plant: Plant, recording: Recording, *names: str) -> None:
    """Refuse a recording that is not of this plant, or lacks what tells its states.

    Args:
        plant: of its scenario.
        recording: of which `recorded_state` will be asked.
        names: of further arrays that are needed.

    Raises:
        RecordingError: it lacks arrays, or has other numbers of joints, tips or supports than its scenario.
    """
    elements = ["element_deformation"] if plant.n_elements else []
    missing = [name for name in (*_STATE, *elements, *names) if name not in recording.variables]
    if missing:
        raise RecordingError(f"The recording lacks {', '.join(missing)}; compute the run anew.", file=None)
    world = plant.world
    counts = {"joint": world.n_joints, "contact": world.n_tips}
    if "support" in recording.labels:
        counts["support"] = len(plant.contacts) - world.n_tips
    if plant.n_elements:
        counts["element"] = plant.n_elements
    for dim, count in counts.items():
        if len(recording.labels[dim]) != count:
            raise RecordingError(
                f"The recording has {len(recording.labels[dim])} places along {dim!r}, but its scenario {count}; "
                "compute the run anew.",
                file=None,
            )


def recorded_state(plant: Plant, recording: Recording, sample: int) -> State:
    """The state of one sample of a recording; what a damping remembers is not recorded, and zero here."""
    world, n = plant.world, plant.world.n_joints
    rotation = rotation_of(recording.object_rpy[sample])
    twist = recording.object_twist[sample]
    q = pin.neutral(world.coordinates)
    world.set_joint_position(recording.joint_position[sample], q)
    world.set_object_pose(recording.object_position[sample], rotation, q)
    v = np.concatenate([recording.joint_velocity[sample, :n], rotation.T @ twist[:3], rotation.T @ twist[3:]])
    z = np.zeros((len(plant.contacts), plant.n_memory))
    z[: world.n_tips, :3] = recording.deformation[sample, :, 1:]
    if plant.supports and "support_deformation" in recording.variables:
        z[world.n_tips :, :3] = recording.support_deformation[sample, :, 1:]
    block = int(plant.pads["block"][0])
    for i, (fingertip, dr) in enumerate(zip(plant.fingertips, recording.deformation[sample, :, 0], strict=True)):
        is_surface = fingertip.law.coordinates == "surface"
        for element in range(fingertip.elements):
            stored = z[i, element * block : element * block + 3]
            if fingertip.elements > 1:
                stored[:] = recording.element_deformation[sample, i, element]
            if is_surface:
                stored[:2] *= fingertip.law.radius - dr  # recorded as angles s / R
    return State(q, v, z)
