"""One instant of a grasp, as the scene needs it: from a sample of a recording, or from an observation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from softhand.errors import RecordingError
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.plant.plant import Plant
from softhand.recording.recording import Recording
from softhand.sensing.observation import Observation

_NEEDED = (
    "joint_position", "object_position", "object_rpy", "tip_position", "deformation", "contact_force", "contact_angles",
    "contact_point", "contact_rotation", "friction_use", "internal_force", "object_position_desired",
    "object_rpy_desired",
)  # fmt: skip


@dataclass(frozen=True)
class Moment:
    """Copies of what is seen at one time. SI units, world axes; nc contacts, ns supports."""

    time: float
    joint_position: Array
    object_pose: Array
    """Shape (4, 4)."""
    desired_pose: Array
    tip_position: Array
    contact_point: Array
    contact_rotation: Array
    contact_force: Array
    contact_angles: Array
    deformation: Array
    friction_use: Array
    internal_force: Array
    support_point: Array
    """Shape (ns, 3)."""
    support_force: Array
    """As recorded, on the base of each support, but in the world [N], shape (ns, 3)."""

    @property
    def distance(self) -> Array:
        """R of each contact, from the centre of the flat face to the object's face [m], shape (nc,)."""
        reach = self.contact_point - self.tip_position
        distance: Array = np.einsum("ik,ik->i", reach, self.contact_rotation[:, :, 2])
        return distance

    @property
    def contact_on_object(self) -> Array:
        """Contact points in the object frame [m], shape (nc, 3)."""
        return (self.contact_point - self.object_pose[:3, 3]) @ self.object_pose[:3, :3]


class Past(NamedTuple):
    """What a picture shows of the time before its moment."""

    path: Array
    """Contact points so far in the object frame [m], the last one now, shape (samples, nc, 3)."""
    since_slip: Array
    """Time since each tip slipped, 0 while it slips, infinite if it did not [s], shape (nc,)."""

    @classmethod
    def none(cls, contacts: int) -> Past:
        """Of a picture without any."""
        return cls(np.zeros((0, contacts, 3)), np.full(contacts, np.inf))


def recorded_moment(recording: Recording, k: int) -> Moment:
    """Sample k of a recording."""
    row: dict[str, Any] = {name: recording[name][k] for name in _NEEDED}
    point, force = _recorded_supports(recording, k)
    return Moment(
        float(recording.time[k]),
        row["joint_position"],
        pose_of(row["object_position"], row["object_rpy"]),
        pose_of(row["object_position_desired"], row["object_rpy_desired"]),
        **{name: row[name] for name in _CONTACT_FIELDS},
        support_point=point,
        support_force=force,
    )


def _recorded_supports(recording: Recording, k: int) -> tuple[Array, Array]:
    if not set(_SUPPORT_ARRAYS) <= recording.variables.keys():
        return np.zeros((0, 3)), np.zeros((0, 3))
    point, rotation, force = (recording[name][k] for name in _SUPPORT_ARRAYS)
    return point, _in_world(rotation, force)


def observed_moment(observation: Observation, plant: Plant) -> Moment:
    """What a controller sees and the supports of the plant at the same state, copied."""
    desired, supports = observation.desired.coordinates, plant.support_contacts
    contacts: dict[str, Any] = {name: getattr(observation, name).copy() for name in _CONTACT_FIELDS}
    return Moment(
        observation.time,
        observation.joint_position.copy(),
        pose_of(observation.object_position, observation.object_rpy),
        pose_of(desired[:3], desired[3:]),
        **contacts,
        support_point=supports["point"].copy(),
        support_force=_in_world(supports["rotation"], supports["force"]),
    )


def _in_world(rotation: Array, force: Array) -> Array:
    """Forces [N] of contacts in world axes, shape (n, 3)."""
    turned: Array = np.einsum("nij,nj->ni", rotation, force[:, :3])
    return turned


_CONTACT_FIELDS = (
    "tip_position", "contact_point", "contact_rotation", "contact_force", "contact_angles", "deformation",
    "friction_use", "internal_force",
)  # fmt: skip
_SUPPORT_ARRAYS = "support_point", "support_rotation", "support_force"


def check_viewable(recording: Recording) -> None:
    """Refuse a recording that lacks what a picture needs.

    Raises:
        RecordingError: it has no URDFs, no samples, or arrays are missing.
    """
    if not (recording.hand_urdf and recording.object_urdf):
        raise RecordingError(
            f"the recording, of softhand {recording.version}, does not hold the URDFs of its hand and object, "
            "so that there is nothing to draw; run its scenario again."
        )
    if not len(recording):
        raise RecordingError("the recording has no samples, so that there is nothing to draw.")
    missing = [name for name in _NEEDED if name not in recording.variables]
    if missing:
        raise RecordingError(f"the recording lacks {', '.join(missing)}; a picture needs them.")


def pose_of(position: Array, rpy: Array) -> Array:
    """A pose from position [m] and roll, pitch, yaw [rad], shape (4, 4)."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation_of(rpy), position
    return pose
