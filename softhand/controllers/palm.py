"""A palm that is carried by joints of its own, those of an arm or a wrist: brought along a way by computed torque."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.controllers.pose import turn_error
from softhand.errors import ScenarioError
from softhand.model.rigid import rigid_poses, rigid_terms
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.linear import least_norm
from softhand.numerics.rotations import set_rotation
from softhand.sensing.observation import Observation

PLACE_SIZE = 12
"""Numbers of the place of the palm in a frame: axes row by row, origin [m]."""


class Palm(NamedTuple):
    """What carries the palm, with its gains and room to work in."""

    stiffness: float
    """K_p [1/s^2]."""
    damping: float
    """K_d [1/s]."""
    posture: float
    """K_q of joint motions that leave the palm where it is [1/s^2]."""
    joint: int
    """Index of the joint that carries it."""
    columns: NDArray[np.int64]
    """Joints that move it, in q_F, shape (na,)."""
    moves: NDArray[np.float64]
    """1 for a joint that moves a finger alone, 0 for one that moves the palm, shape (n,)."""
    tree: Any
    """`model.tree.Tree` without gravity, which is held apart."""
    terms: Any
    """Room for `rigid_terms`."""


def palm_of(name: str, observation: Observation, stiffness: float, damping: float, posture: float) -> Palm:
    """The palm of a hand, with gains.

    Args:
        name: of the controller, for the message.
        observation: any.
        stiffness: as in `Palm`.
        damping: likewise.
        posture: likewise.

    Raises:
        ScenarioError: no joint moves the whole hand, or joints of its arm are coupled.
    """
    known = observation.known
    if not known.palm_joint:
        raise ScenarioError(
            f'controller.name: "{name}" moves the palm, but no joint of this hand carries all its fingers; put the '
            "hand on an arm with hand.arm, or take pick-and-place.",
            key="controller.name", value=name,
        )  # fmt: skip
    tree, terms = known.rigid.compiled
    if tree.coupled.S.size:
        raise ScenarioError(
            f'controller.name: "{name}" does not know coupled joints; take regulation.',
            key="controller.name", value=name,
        )  # fmt: skip
    moves = np.ones(observation.joint_position.shape[0])
    moves[known.palm_columns] = 0.0
    still = tree._replace(gravity=np.zeros(3))
    return Palm(stiffness, damping, posture, known.palm_joint, known.palm_columns.copy(), moves, still, terms)


def palm_place(palm: Palm, observation: Observation) -> Array:
    """Place of the palm in the frame of the object as it is desired, as `PLACE_SIZE` numbers."""
    rigid_poses(palm.tree, observation.configuration, palm.terms)
    pose, desired = palm.terms.poses[palm.joint], np.empty((3, 3))
    set_rotation(observation.object_rpy_desired, desired)
    axes, origin = pose[:9].reshape(3, 3).T, pose[9:]
    away = desired.T @ (origin - observation.object_position_desired - observation.standoff_desired)
    return np.concatenate([(desired.T @ axes).ravel(), away])


@compiled
def set_palm_terms(observed, palm):
    """M, C v and poses of the hand as it moves, into the terms of the palm."""
    n = observed.joint_velocity.shape[0]
    v = np.zeros(n + 6)  # the object has no part in it
    for j in range(n):
        v[j] = observed.joint_velocity[j]
    rigid_terms(palm.tree, observed.configuration, v, palm.terms)


@compiled
def carry_palm(observed, palm, place, posture, torque):
    """torque += M_F a + C_F q_F', with accelerations a of the joints that move the palm, so that it follows its place.

    With p and R of the palm, p_d and R_d where it shall be, e = (p - p_d, log(R_d^T R) in world axes), V its velocity
    and J its Jacobian,

        J a + J' q_F' = V_d' - K_d (V - V_d) - K_p e

    so that e'' + K_d e' + K_p e = 0, and of the accelerations that solve it, or come nearest to that, those nearest to
    -K_q (q - q(0)) - K_d q'. The place is fixed to the object as it is desired, but for the standoff s:
    p_d = p_Od + R_Od r + s.

    Args:
        observed: fields of an observation.
        palm: a `Palm`, after `set_palm_terms`.
        place: of the palm in the frame of the desired object, shape (12,).
        posture: q(0) of all joints, shape (n,).
        torque: changed, shape (n,).
    """
    n, na = torque.shape[0], palm.columns.shape[0]
    J, sought, a, wish = np.empty((6, na)), np.empty(6), np.empty(na), np.empty(na)
    pose, body = palm.terms.poses[palm.joint], palm.tree.work[palm.joint]
    for k in range(na):
        column = palm.terms.J[:, palm.columns[k]]
        J[0, k] = column[0] + column[4] * pose[11] - column[5] * pose[10]
        J[1, k] = column[1] + column[5] * pose[9] - column[3] * pose[11]
        J[2, k] = column[2] + column[3] * pose[10] - column[4] * pose[9]
        J[3, k], J[4, k], J[5, k] = column[3], column[4], column[5]
        j = palm.columns[k]
        wish[k] = -palm.posture * (observed.joint_position[j] - posture[j]) - palm.damping * observed.joint_velocity[j]
    _seek(observed, palm, place, J, pose, sought)
    for k in range(3):
        sought[k] -= body.lifting[k]
        sought[3 + k] -= body.turning[k]
    for i in range(6):
        for k in range(na):
            sought[i] -= J[i, k] * wish[k]
    least_norm(J, False, sought, a)
    for k in range(na):
        a[k] += wish[k]
    for j in range(n):
        torque[j] += palm.terms.nle[j]
        for k in range(na):
            i = palm.columns[k]
            torque[j] += palm.terms.M[min(i, j), max(i, j)] * a[k]


@compiled
def _seek(observed, palm, place, J, pose, sought):
    """The acceleration that the palm shall have: of its origin, and of its turning."""
    R, desired, axes, turn = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    twist, rate = observed.object_twist_desired, observed.object_twist_rate_desired
    set_rotation(observed.object_coordinates_desired[3:6], desired)
    arm = np.zeros(3)  # from the desired object to the desired palm
    for i in range(3):
        for k in range(3):
            R[i, k] = pose[3 * k + i]
            arm[i] += desired[i, k] * place[9 + k]
            axes[i, k] = 0.0
            for m in range(3):
                axes[i, k] += desired[i, m] * place[3 * m + k]
    turn_error(R, axes, turn)
    wx, wy, wz = twist[3], twist[4], twist[5]
    vx, vy, vz = wy * arm[2] - wz * arm[1], wz * arm[0] - wx * arm[2], wx * arm[1] - wy * arm[0]
    ax, ay, az = rate[3], rate[4], rate[5]
    swung = wy * vz - wz * vy, wz * vx - wx * vz, wx * vy - wy * vx
    lifted = ay * arm[2] - az * arm[1], az * arm[0] - ax * arm[2], ax * arm[1] - ay * arm[0]
    carried = vx, vy, vz
    for i in range(3):
        moving = turning = 0.0
        for k in range(palm.columns.shape[0]):
            speed = observed.joint_velocity[palm.columns[k]]
            moving += J[i, k] * speed
            turning += J[3 + i, k] * speed
        away = pose[9 + i] - observed.object_coordinates_desired[i] - arm[i] - observed.standoff_desired[i]
        sought[i] = rate[i] + lifted[i] + swung[i] + observed.standoff_acceleration_desired[i]
        speed = moving - twist[i] - carried[i] - observed.standoff_rate_desired[i]
        sought[i] -= palm.damping * speed + palm.stiffness * away
        sought[3 + i] = rate[3 + i] - palm.damping * (turning - twist[3 + i]) + palm.stiffness * turn[i]
