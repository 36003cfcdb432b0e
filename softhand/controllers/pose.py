"""How far the object is from where it shall be: as position and rotation vector, or in the paper's coordinates.

`rotation-vector`: e = (p - p_d, log(R_d^T R)), the second half in axes of the object. It is the same at every
attitude. `euler`: e = q_O - q_Od of position, roll, pitch, yaw, as in [Nakashima] Eq. (59), angles modulo 2 pi. It is
singular at a pitch of 90 deg, and refused near it.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from softhand.errors import ControllerError
from softhand.numerics.arrays import Array
from softhand.numerics.branches import seldom
from softhand.numerics.compiled import compiled
from softhand.numerics.rotations import log_of_turn, set_rotation
from softhand.sensing.observation import Observation

OrientationError: TypeAlias = Literal["rotation-vector", "euler"]

_STEEPEST = math.radians(85.0)  # pitch up to which the paper's coordinates are used


class PoseTask(NamedTuple):
    """The pose error and what belongs to it, in the coordinates of the error."""

    error: Array
    """e [m, rad], shape (6,)."""
    rate: Array
    """Of the error, as it is while the error is small [m/s, rad/s], shape (6,)."""
    acceleration: Array
    """Desired acceleration [m/s^2, rad/s^2], shape (6,)."""
    map: Array
    """X, object_twist = X (rate of these coordinates), shape (6, 6): T_O, or the axes of the object."""

    def wrench(self, force: Array) -> Array:
        """The wrench on the object about its origin, world axes [N, N m], that is a generalized force, shape (6,)."""
        return np.asarray(np.linalg.solve(self.map.T, force))


def pose_task(name: str, observation: Observation, form: OrientationError) -> PoseTask:
    """The pose error of an observation.

    Args:
        name: of the controller, for messages.
        observation: the grasp now.
        form: `rotation-vector` or `euler`.

    Raises:
        ControllerError: `euler` near pitch 90 deg.
    """
    desired, error = observation.desired, np.empty(6)
    if form == "euler":
        require_regular(name, observation.time, observation.object_rpy[1], observation.object_rpy_desired[1])
        euler_error(observation.object_coordinates, desired.coordinates, error)
        rate = observation.object_coordinates_rate - desired.coordinates_rate
        return PoseTask(error, rate, desired.coordinates_acceleration, observation.coordinate_map)
    R, axes = observation.object_rotation, np.eye(6)
    pose_error(observation.object_position, R, desired.coordinates, np.empty((3, 3)), error)
    axes[3:, 3:] = R
    return PoseTask(error, axes.T @ (observation.object_twist - desired.twist), axes.T @ desired.twist_rate, axes)


def require_regular(name: str, time: float, *pitches: float) -> None:
    """Roll, pitch and yaw can be used at these pitches [rad].

    Raises:
        ControllerError: one is within 5 deg of 90 deg.
    """
    for pitch in pitches:
        if abs(pitch) > _STEEPEST:
            raise ControllerError(
                f"controller '{name}' measures the attitude in roll, pitch, yaw, which are singular at pitch 90 deg, "
                f"and at t = {time:g} s the pitch is {math.degrees(pitch):.1f} deg; set "
                'controller.orientation_error = "rotation-vector".',
                controller=name, reason="controller", time=time,
            )  # fmt: skip


@compiled
def is_regular(pitch):
    """Whether roll, pitch and yaw can be used at a pitch [rad]."""
    return abs(pitch) <= _STEEPEST


@compiled
def pose_error(position, rotation, coordinates_desired, wanted, error):
    """error = (p - p_d, log(R_d^T R)), shape (6,); `wanted` is room for R_d, shape (3, 3)."""
    set_rotation(coordinates_desired[3:6], wanted)
    log_of_turn(wanted, rotation, error[3:6])
    for k in range(3):
        error[k] = position[k] - coordinates_desired[k]


@compiled
def euler_error(coordinates, coordinates_desired, error):
    """error = q_O - q_Od with the angles in (-pi, pi], shape (6,)."""
    for k in range(6):
        error[k] = coordinates[k] - coordinates_desired[k]
        if k > 2 and seldom(abs(error[k]) > math.pi):
            error[k] -= 2.0 * math.pi * math.ceil(error[k] / (2.0 * math.pi) - 0.5)
