"""The log that a recording of softhand is: what was measured where it says so, else what is true."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from softhand.assembly.plant import read_world
from softhand.calibration.log import MEASURED, Log
from softhand.errors import MeasurementError, RecordingError
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.recording.recording import Recording
from softhand.scenario.instruments import InstrumentSection, stride_of
from softhand.scenario.scenario import Scenario

_VARIABLES = {
    "joint_position": "joint_position", "joint_velocity": "joint_velocity", "object_position": "object_position",
    "object_orientation": "object_rpy", "contact_force": "contact_force", "contact_torsion": "contact_force",
}  # fmt: skip
_IDEAL = ("joint_position", "object_position", "object_orientation")


def log_of_recording(recording: Recording, scenario: Scenario, source: str = "recording") -> Log:
    """The log of a recording.

    Of a run with instruments it has what these measured, of one without the true joint positions and the pose of the
    object, as instruments of no error would.

    Args:
        recording: of a run of the hand of the scenario.
        scenario: of it, or of the same hand.
        source: for messages.

    Raises:
        MeasurementError: it lacks joint torques or positions, or its instruments filter or change what they measure.
    """
    section = scenario.sensing
    instruments = section.instruments if section is not None else {}
    is_measured = any(name.startswith("measured_") for name in recording.variables)
    names = [name for name in MEASURED if name in instruments] if is_measured else list(_IDEAL)
    names = list(dict.fromkeys(["joint_position", *names]))
    measured: dict[str, Array] = {}
    for name in names:
        variable = f"measured_{_VARIABLES[name]}" if is_measured else _VARIABLES[name]
        try:
            values = np.array(recording[variable], dtype=float)
        except RecordingError as error:
            raise MeasurementError(f"{source}: {error}", column=variable, value=None) from error
        if name == "object_orientation":
            values = quaternions_of(values)
        elif name == "contact_torsion":
            values = values[..., 3]
        elif name == "contact_force":
            values = _in_tips(values, recording, scenario)
        one = instruments.get(name)
        if one is not None:
            values = _at_samples(name, one, values, scenario.control_period)
        measured[name] = values
    torque = "joint_torque"
    if torque not in recording.variables:
        raise MeasurementError(f"{source}: has no joint_torque, without which no run is computed anew.", column=torque)
    return Log(
        np.array(recording.time), np.array(recording.joint_torque, dtype=float), measured,
        tuple(recording.labels["joint"]), source,
    )  # fmt: skip


def quaternions_of(rpy: Array) -> Array:
    """Quaternions x, y, z, w of roll, pitch, yaw, shape (T, 4); NaN where these are."""
    half = 0.5 * rpy
    (a, b, c), (d, e, f) = np.sin(half).T, np.cos(half).T
    return np.stack(
        [a * e * f - d * b * c, d * b * f + a * e * c, d * e * c - a * b * f, d * e * f + a * b * c], axis=1
    )


def _at_samples(name: str, one: InstrumentSection, values: Array, period: float) -> Array:
    """NaN where an instrument held its last sample."""
    if one.filter is not None:
        raise MeasurementError(
            f"sensing.{name}.filter: a low-pass filter smears samples over time, which a fit takes for motion; log "
            "what comes before it, and leave the key out.",
            column=name, value=one.filter,
        )  # fmt: skip
    stride, delay = stride_of(one.rate, period), round(one.delay / period)
    if stride == 1:
        return values
    values = values.copy()
    values[(np.arange(len(values)) - delay) % stride != 0] = np.nan
    return values


def _in_tips(force: Array, recording: Recording, scenario: Scenario) -> Array:
    """Forces on the object in axes of the tips F, of forces in contact frames C_F; shape (T, 3 nc)."""
    world = read_world(scenario)
    data = world.model.createData()
    rotations = np.array([_tip_rotations(world, data, angles) for angles in recording.joint_position])
    in_world = np.einsum("tirk,tik->tir", recording.contact_rotation, force[..., :3])
    return np.einsum("tirk,tir->tik", rotations, in_world).reshape(len(force), -1)


def _tip_rotations(world: World, data: pin.Data, angles: Array) -> Array:
    """Axes of each F in the world, shape (nc, 3, 3)."""
    q = pin.neutral(world.coordinates)
    world.set_joint_position(angles, q)
    pin.forwardKinematics(world.model, data, world.configuration(q))
    return np.array([data.oMi[tip.joint].rotation @ tip.rotation for tip in world.tips])
