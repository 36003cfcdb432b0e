"""Two-phase control: from the object's angle to joint angles, and from these to torques."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from softhand.controllers.blocks import turn_error
from softhand.controllers.controller import Controller
from softhand.controllers.gains import diagonal
from softhand.controllers.tips import last_axis, moved, need_fingers
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled
from softhand.numerics.rotations import set_rotation
from softhand.numerics.triples import dot
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain, NonNegative


class TwoPhase(Controller):
    """Two-phase control, in the manner of Inoue and Hirai: the angle moves the set points of stiff joints.

        q_d = q_bias +- J_i^+ t (K_P e + K_I int e dt)          first phase, from the object's angle
        u = K_q (q_d - q_F) - K_d q_F'                         second phase, from the joints

    e = b . log(R_d R^T) is the missing angle about the normal b of the fingers' plane, t = b x u the direction in
    which tip 1 moves so that the object turns about b (u from contact 2 to 1), + at finger 1 and - at finger 2. J_i^+ t
    is taken at the start; with one joint a finger, as in the original, it is a number, +-1 / length. q_bias is where
    the joints would go without an object: q_F(0) + tau(0) / K_q, with tau(0) the torques that hold the start. So the
    grasp comes from stiffness alone: squeeze and position are not regulated, and neither f_C nor the object's position
    is measured after the start. Structure: certain; the details of the original are not. Two fingers only.
    """

    K_P: NonNegative = 0.02
    """Way of a tip for the missing angle [m/rad]."""
    K_I: NonNegative = 0.4
    """Way of a tip for its integral [m/(rad s)]."""
    K_q: Gain = 2.0
    """Stiffness of the joints [N m/rad or N/m], one number or one a joint, above 0."""
    K_d: Gain = 0.02
    """Damping of the joints [N m s/rad or N s/m], one number or one a joint."""

    @property
    def formula(self) -> Any:  # type: ignore[override]
        """The law of the class."""
        return two_phase

    def constants(self, observation: Observation) -> Gains:
        """The gains as arrays."""
        n = observation.joint_position.shape[0]
        K_q, K_d = diagonal("K_q", self.K_q, n), diagonal("K_d", self.K_d, n)
        return Gains(self.K_P, self.K_I, K_q, K_d, observation.is_continuous.copy())

    def start(self, observation: Observation) -> Any:
        """The integral and its time; then what is fixed at the start: q_bias, the way of the joints, b."""
        need_fingers("two-phase", observation, 2, 2)
        K_q = diagonal("K_q", self.K_q, observation.joint_position.shape[0])
        b = last_axis(observation.tip_angular_jacobian[0])
        line = observation.contact_point[0] - observation.contact_point[1]
        t = np.cross(b, line / np.linalg.norm(line))
        one, two = (np.linalg.pinv(J, rcond=1e-6) @ t for J in observation.tip_jacobian)
        holding = observation.N_F + observation.J_CF_f.T @ observation.f_C + observation.J_CF_tau.T @ observation.tau_C
        return np.concatenate([[0.0, observation.time], observation.joint_position + holding / K_q, one - two, b])


class Gains(NamedTuple):
    """The settings of `TwoPhase`."""

    K_P: float
    K_I: float
    K_q: Array
    K_d: Array
    is_continuous: AnyArray


@compiled
def two_phase(observed, gains, memory, torque):
    """The law of the class; `memory` as `start` returns it."""
    n = torque.shape[0]
    q_bias, way, b = memory[2 : 2 + n], memory[2 + n : 2 + 2 * n], memory[2 + 2 * n :]
    turn, wanted = np.empty(3), np.empty((3, 3))
    set_rotation(observed.object_coordinates_desired[3:6], wanted)
    turn_error(observed.object_rotation, wanted, turn)
    e = dot(b, turn)
    memory[0] += e * (observed.clock[0] - memory[1])
    memory[1] = observed.clock[0]
    for j in range(n):
        q_d = q_bias[j] + way[j] * (gains.K_P * e + gains.K_I * memory[0])
        away = moved(observed.joint_position[j], q_d, gains.is_continuous[j])
        torque[j] = -gains.K_q[j] * away - gains.K_d[j] * observed.joint_velocity[j]
