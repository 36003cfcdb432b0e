"""Moments of a recording, sample by sample."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.errors import RecordingError
from softhand.numerics.arrays import Array
from softhand.recording.recording import Recording
from softhand.viewer.scene.moment import CONTACT_FIELDS, Moment, forces_in_world
from softhand.viewer.scene.poses import pose_of

_NEEDED = (
    "joint_position", "object_position", "object_rpy", *CONTACT_FIELDS, "object_position_desired", "object_rpy_desired",
)  # fmt: skip
FELT = "tactile_normal_force"
_SUPPORT = "support_point", "support_rotation", "support_force"


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


def recorded_moment(recording: Recording, k: int) -> Moment:
    """Sample k of a recording."""
    row: dict[str, Any] = {name: recording[name][k] for name in _NEEDED}
    point, force = _recorded_supports(recording, k)
    return Moment(
        float(recording.time[k]),
        row["joint_position"],
        pose_of(row["object_position"], row["object_rpy"]),
        pose_of(row["object_position_desired"], row["object_rpy_desired"]),
        **{name: row[name] for name in CONTACT_FIELDS},
        support_point=point,
        support_force=force,
        tactile_normal_force=recording[FELT][k] if FELT in recording.variables else np.zeros((0, 0)),
    )


def _recorded_supports(recording: Recording, k: int) -> tuple[Array, Array]:
    if not set(_SUPPORT) <= recording.variables.keys():
        return np.zeros((0, 3)), np.zeros((0, 3))
    point, rotation, force = (recording[name][k] for name in _SUPPORT)
    return point, forces_in_world(rotation, force)
