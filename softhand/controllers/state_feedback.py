"""State feedback: torques linear in all that moves, with gains from a file."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.controllers.controller import Controller
from softhand.controllers.gain_file import check_fit, read_gain_file
from softhand.controllers.tips import moved
from softhand.errors import ScenarioError
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.rotations import log_of_turn, set_rotation
from softhand.sensing.observation import Observation


class StateFeedback(Controller):
    """State feedback: tau = u0 - K (x - x0) - K_I (sum of errors), with gains that `softhand design lqr` writes.

        tau = u* + N_u r - K x - K_I i
        x = (q_F - q_F* - N_q r, R_d^T (p - p_d), log(R_d^T R), and their rates)

    r is what is asked for beyond the designed rest *: position and rotation vector of the desired object in the axes
    that the object has there, and internal forces. N_q, N_u are how joints and torques of a rest go with r. So at the
    designed target u0 and x0 are those of its rest, and near it, to first order in r; a reference that moves is
    followed through such rests, the rates of x less N_q r'. Nothing is fed forward for its acceleration. i are sums of
    the chosen entries of (R_d^T (p - p_d), log(R_d^T R), f_N - f_Nd) over time; they begin at zero.

    The gains are for one hand, one grasp and one sampling period; a file of another hand or period is refused.
    """

    gain_file: str
    """Gain file, relative to that of the scenario."""

    @property
    def formula(self) -> Any:  # type: ignore[override]
        """The law of the class."""
        return state_feedback

    def constants(self, observation: Observation) -> Gains:
        """What is in the file, for this hand."""
        found = read_gain_file(self.gain_file)
        known = observation.known
        check_fit(found, self.gain_file, known.rigid.joint_names, known.tip_names)
        return Gains(
            found.period, found.joint_position, found.object_position, found.object_rotation, found.internal_force,
            found.torque, found.joint_follow, found.torque_follow, found.K, np.array(found.integrals, dtype=np.int64),
            found.K_integral, known.is_continuous.copy(),
        )  # fmt: skip

    def check_period(self, period: float) -> None:
        """Refuse gains for another one.

        Raises:
            ScenarioError: the file cannot be read, or is for another period.
        """
        own = read_gain_file(self.gain_file).period
        if abs(own - period) > 1e-9 * own:
            raise ScenarioError(
                f"controller.gain_file: {self.gain_file} is for samples each {own:g} s, and the torque is computed "
                f"each {period:g} s; set control_period or controller.period, or design gains for it.",
                key="controller.gain_file", value=self.gain_file,
            )  # fmt: skip

    def start(self, observation: Observation) -> Any:
        """The sums of errors."""
        if not np.any(observation.contact_force[:, 2] > 0.0):
            raise ScenarioError(
                "controller.name: state-feedback needs fingers that touch, and none does at the start; set "
                "grasp.opening = 0 and grasp.internal_force.",
                key="controller.name", value="state-feedback",
            )  # fmt: skip
        return np.zeros(len(read_gain_file(self.gain_file).integrals))


class Gains(NamedTuple):
    """A `GainFile` as arrays."""

    period: float
    joint_position: Array
    object_position: Array
    object_rotation: Array
    internal_force: Array
    torque: Array
    joint_follow: Array
    torque_follow: Array
    K: Array
    integrals: NDArray[np.int64]
    K_integral: Array
    is_continuous: NDArray[np.bool_]


@compiled
def state_feedback(observed, gains, memory, torque):
    """The law of the class; `memory` has the sums of errors."""
    n, pairs = torque.shape[0], gains.internal_force.shape[0]
    asked, rate, x, error = np.empty(6 + pairs), np.empty(6), np.empty(2 * (n + 6)), np.empty(6 + pairs)
    R, wanted = observed.object_rotation, np.empty((3, 3))
    set_rotation(observed.object_coordinates_desired[3:6], wanted)
    log_of_turn(gains.object_rotation, wanted, asked[3:6])
    log_of_turn(wanted, R, error[3:6])
    for k in range(3):
        asked[k] = error[k] = 0.0
        rate[k] = rate[3 + k] = 0.0
        x[2 * n + 6 + k] = x[2 * n + 9 + k] = 0.0
        for i in range(3):
            there, here = gains.object_rotation[i, k], R[i, k]
            asked[k] += there * (observed.object_coordinates_desired[i] - gains.object_position[i])
            error[k] += wanted[i, k] * (observed.object_coordinates[i] - observed.object_coordinates_desired[i])
            rate[k] += there * observed.object_twist_desired[i]
            rate[3 + k] += wanted[i, k] * observed.object_twist_desired[3 + i]
            x[2 * n + 6 + k] += here * (observed.object_twist[i] - observed.object_twist_desired[i])
            x[2 * n + 9 + k] += here * (observed.object_twist[3 + i] - observed.object_twist_desired[3 + i])
    for k in range(pairs):
        asked[6 + k] = observed.internal_force_desired[k] - gains.internal_force[k]
        error[6 + k] = observed.internal_force[k] - observed.internal_force_desired[k]
    for k in range(6):
        x[n + k] = error[k]
    for j in range(n):
        x[j] = moved(observed.joint_position[j], gains.joint_position[j], gains.is_continuous[j])
        x[n + 6 + j] = observed.joint_velocity[j]
        torque[j] = gains.torque[j]
        for k in range(6 + pairs):
            x[j] -= gains.joint_follow[j, k] * asked[k]
            torque[j] += gains.torque_follow[j, k] * asked[k]
        for k in range(6):
            x[n + 6 + j] -= gains.joint_follow[j, k] * rate[k]
    for j in range(n):
        for k in range(x.shape[0]):
            torque[j] -= gains.K[j, k] * x[k]
        for k in range(memory.shape[0]):
            torque[j] -= gains.K_integral[j, k] * memory[k]
    for k in range(memory.shape[0]):
        memory[k] += gains.period * error[gains.integrals[k]]
