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
from softhand.numerics.branches import seldom, usually
from softhand.numerics.compiled import compiled
from softhand.numerics.rotations import log_of_turn, set_rotation
from softhand.numerics.triples import solved
from softhand.sensing.fields import observed_by, pick
from softhand.sensing.observation import Observation

OrientationError: TypeAlias = Literal["rotation-vector", "euler"]

_READS = (
    "object_coordinates", "object_rotation", "object_twist", "coordinate_map", "object_coordinates_desired",
    "object_coordinates_rate_desired", "object_coordinates_acceleration_desired", "object_twist_desired",
    "object_twist_rate_desired",
)  # fmt: skip
"""Of `set_task`."""

_STEEPEST = math.radians(85.0)  # pitch up to which the paper's coordinates are used


class PoseTask(NamedTuple):
    """The pose error and its coordinates."""

    error: Array
    """e [m, rad], shape (6,)."""
    rate: Array
    """Of the error, as it is while the error is small [m/s, rad/s], shape (6,)."""
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
    is_euler, axes = form == "euler", np.eye(6)
    error, rate, unused = np.empty((3, 6))
    stop = irregular(name, observation.time, observation.object_rpy[1], observation.object_rpy_desired[1])
    if is_euler and stop:
        raise stop
    axes[3:, 3:] = observation.object_rotation
    set_task(pick(observed_by(_READS), observation._views), is_euler, error, rate, unused)
    return PoseTask(error, rate, observation.coordinate_map if is_euler else axes)


def irregular(name: str, time: float, *pitches: float) -> ControllerError | None:
    """The error for roll, pitch and yaw that cannot be used at one of these pitches [rad]; None if they can."""
    for pitch in pitches:
        if abs(pitch) > _STEEPEST:
            return ControllerError(
                f"controller '{name}' measures the attitude in roll, pitch, yaw, which are singular at pitch 90 deg, "
                f"and at t = {time:g} s the pitch is {math.degrees(pitch):.1f} deg; set "
                'controller.orientation_error = "rotation-vector".',
                controller=name, reason="controller", time=time,
            )  # fmt: skip
    return None


@compiled
def is_regular(pitch):
    """Whether roll, pitch and yaw can be used at a pitch [rad]."""
    return abs(pitch) <= _STEEPEST


@compiled
def pose_error(position, rotation, coordinates_desired, error):
    """error = (p - p_d, log(R_d^T R)), the second half in axes of the object.

    Args:
        position: p [m], shape (3,) or longer.
        rotation: R, axes of the object as columns, shape (3, 3).
        coordinates_desired: p_d [m] and roll, pitch, yaw [rad], shape (6,).
        error: set [m, rad], shape (6,).
    """
    wanted = np.empty((3, 3))
    set_rotation(coordinates_desired[3:6], wanted)
    log_of_turn(wanted, rotation, error[3:6])
    for k in range(3):
        error[k] = position[k] - coordinates_desired[k]


@compiled
def euler_error(coordinates, coordinates_desired, error):
    """error = q_O - q_Od with the angles in (-pi, pi], shape (6,); NaN near pitch 90 deg.

    Args:
        coordinates: q_O [m, rad], shape (6,).
        coordinates_desired: q_Od, shape (6,).
        error: set, shape (6,).
    """
    for k in range(6):
        error[k] = coordinates[k] - coordinates_desired[k]
        if k > 2 and seldom(abs(error[k]) > math.pi):
            error[k] -= 2.0 * math.pi * math.ceil(error[k] / (2.0 * math.pi) - 0.5)
    if not usually(is_regular(coordinates[4]) & is_regular(coordinates_desired[4])):
        error[:] = math.nan


@compiled
def turn_error(rotation, rotation_desired, turn):
    """turn = log(R_d R^T), the missing turn as a rotation vector in world axes.

    Args:
        rotation: R, shape (3, 3).
        rotation_desired: R_d, shape (3, 3).
        turn: set [rad], shape (3,).
    """
    log_of_turn(rotation, rotation_desired, turn)
    x, y, z = turn[0], turn[1], turn[2]
    for k in range(3):
        turn[k] = rotation[k, 0] * x + rotation[k, 1] * y + rotation[k, 2] * z


@compiled
def add_pose_spring(stiffness, error, rotation, wrench):
    """W -= (K_1 e_1, R K_2 e_2), the spring on an error of `pose_error`.

    Args:
        stiffness: K [N/m, N m/rad], shape (6,).
        error: e [m, rad], shape (6,).
        rotation: R, shape (3, 3).
        wrench: changed, about the origin of the object, world axes [N, N m], shape (6,).
    """
    x, y, z = stiffness[3] * error[3], stiffness[4] * error[4], stiffness[5] * error[5]
    for k in range(3):
        wrench[k] -= stiffness[k] * error[k]
        wrench[3 + k] -= rotation[k, 0] * x + rotation[k, 1] * y + rotation[k, 2] * z


@compiled
def set_task(observed, is_euler, error, rate, acceleration):
    """The pose error, its rate as it is while the error is small, and the desired acceleration, shape (6,) each."""
    R, twist = observed.object_rotation, observed.object_twist
    if is_euler:
        euler_error(observed.object_coordinates, observed.object_coordinates_desired, error)
        set_coordinates_rate(observed.coordinate_map, twist, rate)
        for k in range(6):
            rate[k] -= observed.object_coordinates_rate_desired[k]
            acceleration[k] = observed.object_coordinates_acceleration_desired[k]
        return
    pose_error(observed.object_coordinates, R, observed.object_coordinates_desired, error)
    asked, sought = observed.object_twist_desired, observed.object_twist_rate_desired
    for k in range(3):
        rate[k], acceleration[k] = twist[k] - asked[k], sought[k]
        rate[3 + k] = acceleration[3 + k] = 0.0
        for i in range(3):
            rate[3 + k] += R[i, k] * (twist[3 + i] - asked[3 + i])
            acceleration[3 + k] += R[i, k] * sought[3 + i]


@compiled
def add_twist(observed, is_euler, rate, twist):
    """twist += X rate, X of the coordinates of `set_task`, shape (6,)."""
    for k in range(3):
        twist[k] += observed.coordinate_map[k, k] * rate[k] if is_euler else rate[k]
        for i in range(3):
            share = observed.coordinate_map[3 + k, 3 + i] if is_euler else observed.object_rotation[k, i]
            twist[3 + k] += share * rate[3 + i]


@compiled
def add_wrench(observed, is_euler, force, wrench):
    """wrench += X^-T force, of a generalized force of these coordinates, shape (6,)."""
    if not is_euler:
        add_twist(observed, False, force, wrench)  # X^-T = X
        return
    T = observed.coordinate_map
    moment = solved(
        (T[3, 3], T[4, 3], T[5, 3], T[3, 4], T[4, 4], T[5, 4], T[3, 5], T[4, 5], T[5, 5]),
        (force[3], force[4], force[5]),
    )
    for k in range(3):
        wrench[k] += force[k] / T[k, k]
        wrench[3 + k] += moment[k]


@compiled
def set_coordinates_rate(T, twist, rate):
    """rate = q_O' = T_O^-1 twist, shape (6,); T_O is diagonal in the position, and apart from it in the angles."""
    angles = solved(
        (T[3, 3], T[3, 4], T[3, 5], T[4, 3], T[4, 4], T[4, 5], T[5, 3], T[5, 4], T[5, 5]),
        (twist[3], twist[4], twist[5]),
    )
    for k in range(3):
        rate[k], rate[3 + k] = twist[k] / T[k, k], angles[k]
