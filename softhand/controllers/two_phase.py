"""Two-phase control: from the object's angle to joint angles, and from these to torques."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.controllers.controller import Controller, Torque
from softhand.controllers.gains import diagonal
from softhand.controllers.tips import last_axis, need_fingers
from softhand.numerics.rotations import rotation_vector
from softhand.numerics.spatial import rotation_of
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

    def start(self, observation: Observation) -> Any:
        """What is fixed at the start: gains, q_bias, b, the way of the joints; then the integral and its time."""
        need_fingers("two-phase", observation, 2, 2)
        observation, n = observation, observation.joint_position.shape[0]
        K_q = diagonal("K_q", self.K_q, n)
        b = last_axis(observation.tip_angular_jacobian[0])
        line = observation.contact_point[0] - observation.contact_point[1]
        t = np.cross(b, line / np.linalg.norm(line))
        ways = [
            sign * np.linalg.pinv(J, rcond=1e-6) @ t
            for sign, J in zip((1.0, -1.0), observation.tip_jacobian, strict=True)
        ]
        holding = observation.N_F + observation.J_CF_f.T @ observation.f_C + observation.J_CF_tau.T @ observation.tau_C
        gains = K_q, diagonal("K_d", self.K_d, n)
        return gains, observation.joint_position + holding / K_q, b, sum(ways), 0.0, observation.time

    def torque(self, observation: Observation, memory: Any) -> tuple[Torque, Any]:
        """The law of the class."""
        gains, q_bias, b, way, integral, before = memory
        K_q, K_d = gains
        e = float(b @ rotation_vector(observation.object_rotation, rotation_of(observation.desired.coordinates[3:])))
        integral += e * (observation.time - before)
        q_d = q_bias + way * (self.K_P * e + self.K_I * integral)
        u = -K_q * observation.joints_from(q_d) - K_d * observation.joint_velocity
        return u, (gains, q_bias, b, way, integral, observation.time)
