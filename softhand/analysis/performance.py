"""How well a run did what was asked: settling, overshoot, final errors, friction, effort. docs/controllers.md."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.arrays import Array
from softhand.numerics.rotations import turns_between
from softhand.recording.recording import Recording

WINDOW = 0.1  # [s] at the end, over which errors are averaged
BAND = 0.05  # of the way from the start to the target: settled within it
LEAST_POSITION, LEAST_ORIENTATION = 0.2, 0.5  # [mm], [deg]: the band is not narrower


@dataclass(frozen=True, eq=False)
class Errors:
    """Distance from what is desired at each sample, each of shape (samples,).

    Attributes:
        position: length of the difference of the positions [mm].
        orientation: angle of the rotation between the orientations [deg].
        force: length of the vector of the differences of the internal forces [N].
    """

    position: Array
    orientation: Array
    force: Array


@dataclass(frozen=True)
class Performance:
    """Figures of one complete run.

    Attributes:
        settling_time: from when on the pose stays within `BAND` of the way to the target, position and orientation,
            but at least `LEAST_POSITION` and `LEAST_ORIENTATION`; infinite if it is outside at the end [s].
        overshoot: largest way beyond the target, seen along the line from the start to the target, of the length of
            that line, the larger of position and (roll, pitch, yaw) [%]; NaN where the target is the start.
        position_error: root mean square of `Errors.position` over the last `WINDOW` [mm].
        orientation_error: the same of `Errors.orientation` [deg].
        force_error: the same of `Errors.force` [N].
        friction_use: largest |f_t| / (mu f_z) of all contacts and samples.
        effort: square root of the mean over time of the sum of the squared joint torques [N m, N of slides].
    """

    settling_time: float
    overshoot: float
    position_error: float
    orientation_error: float
    force_error: float
    friction_use: float
    effort: float


def errors(recording: Recording) -> Errors:
    """Distances from what is desired, sample by sample."""
    position = recording.object_position - recording.object_position_desired
    force = recording.internal_force - recording.internal_force_desired
    turns = turns_between(recording.object_rpy_desired, recording.object_rpy)
    angles = np.degrees(np.linalg.norm(turns, axis=1))
    return Errors(1e3 * np.linalg.norm(position, axis=1), angles, np.linalg.norm(force, axis=1))


def measure(recording: Recording) -> Performance:
    """The figures of a run.

    Args:
        recording: with at least one sample. The target is what is desired at its end.
    """
    time, off = recording.time, errors(recording)
    last = time > time[-1] - WINDOW + 1e-9
    position = 1e3 * (recording.object_position - recording.object_position_desired[-1])
    turn = np.degrees(turns_between(recording.object_rpy_desired[-1:], recording.object_rpy))
    outside = np.linalg.norm(position, axis=1) > _band(position, LEAST_POSITION)
    outside |= np.linalg.norm(turn, axis=1) > _band(turn, LEAST_ORIENTATION)
    beyond = [_beyond(position, LEAST_POSITION), _beyond(turn, LEAST_ORIENTATION)]
    return Performance(
        settling_time=_settled(time, outside),
        overshoot=float(np.nanmax(beyond)) if not all(map(math.isnan, beyond)) else math.nan,
        position_error=_rms(off.position[last]),
        orientation_error=_rms(off.orientation[last]),
        force_error=_rms(off.force[last]),
        friction_use=float(np.max(recording.friction_use)),
        effort=_rms(np.linalg.norm(recording.joint_torque, axis=1)),
    )


def _band(away: Array, least: float) -> float:
    """Half the width of the band about the target, from where the run starts; `away` is counted from the target."""
    return max(BAND * float(np.linalg.norm(away[0])), least)


def _beyond(away: Array, least: float) -> float:
    """Overshoot [%] of the way from the first row to the target; NaN if that is shorter than `least`.

    What is left at the end is an error, and no overshoot: it is the peak beyond the target and beyond the last row.
    """
    length = float(np.linalg.norm(away[0]))
    if length < least:
        return math.nan
    past = -away @ away[0] / length**2
    return 100.0 * max(float(np.max(past)) - max(float(past[-1]), 0.0), 0.0)


def _settled(time: Array, outside: NDArray[np.bool_]) -> float:
    """Time of the first sample after the last one outside [s]; infinite if that is the last."""
    found = np.flatnonzero(outside)
    if not len(found):
        return float(time[0])
    return float(time[found[-1] + 1]) if found[-1] + 1 < len(time) else math.inf


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
