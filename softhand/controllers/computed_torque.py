"""Computed torque: the equations of motion of hand and object, solved for the torques."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.controllers.controller import Controller, Torque
from softhand.controllers.gains import diagonal, pose_diagonal
from softhand.controllers.grasp_force import grasp_torque
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain


class ComputedTorque(Controller):
    """Computed torque: rigid-contact dynamics inverted, so that the pose error obeys e'' + K_d e' + K_p e = 0.

    With G = J_O^fT, J_h = J_CF^f, A = J_h^-1 G^T (so that q_F' = A q_O' while the contacts do not give way) and
    a = q_Od'' - K_d e' - K_p e, e = q_O - q_Od:

        tau = J_h^T { G^+ [M_O a + C_O q_O' + N_O] + K f_Nd } + M_F (A a + A' q_O') + C_F q_F' + N_F - K_v q_F'

    This is the law of Murray, Li and Sastry, tau = J_h^T (G^+ F + f_N) with F = M~ a + C~ q_O' + N~ and
    M~ = M_O + G J_h^-T M_F A, where the f_N in ker G is the one that does not turn the fingers' weight into squeeze.
    Form: certain, for rigid contacts; K_v is not part of it. Soft tips put a spring between hand and object: the gains
    must stay well below its frequency, 20 to 30 Hz in the reference hand. Where J_h is not square, A is the least-norm
    solution. A' is a difference of two samples.
    """

    torsion_compensation: bool = True
    """Whether the measured torsion moments are compensated. Rigid point contacts, as in the original, have none."""
    K_p_position: Gain = 200.0
    """Stiffness of the error of the position [1/s^2], one number or three."""
    K_p_orientation: Gain = 200.0
    """Stiffness of the error of roll, pitch, yaw [1/s^2], one number or three."""
    K_d_position: Gain = 15.0
    """Damping of the error of the position [1/s], one number or three."""
    K_d_orientation: Gain = 12.0
    """Damping of the error of roll, pitch, yaw [1/s], one number or three."""
    K_v: Gain = 0.005
    """Damping of the joints [N m s/rad], one number or one a joint."""

    def start(self, observation: Observation) -> Any:
        """The gains, and A of the previous sample with its time."""
        gains = (
            pose_diagonal("K_p", self.K_p_position, self.K_p_orientation),
            pose_diagonal("K_d", self.K_d_position, self.K_d_orientation),
            diagonal("K_v", self.K_v, observation.joint_position.shape[0]),
        )
        return gains, _follow(observation), observation.time

    def torque(self, observation: Observation, memory: Any) -> tuple[Torque, Any]:
        """The law of the class."""
        desired = observation.desired
        (K_p, K_d, K_v), A_before, before = memory
        rate = observation.q_O_rate
        a = desired.coordinates_acceleration - K_d * (rate - desired.coordinates_rate)
        a -= K_p * (observation.q_O - desired.coordinates)
        A = _follow(observation)
        A_rate = (A - A_before) / (observation.time - before) if observation.time > before else np.zeros_like(A)
        wrench = observation.M_O @ a + observation.velocity_terms_O + observation.N_O
        tau = grasp_torque(observation, wrench, desired.internal_force, self.torsion_compensation)
        tau += (
            observation.M_F @ (A @ a + A_rate @ rate)
            + observation.velocity_terms_F
            + observation.N_F
            - K_v * observation.joint_velocity
        )
        return tau, ((K_p, K_d, K_v), A, observation.time)


def _follow(observation: Observation) -> Any:
    """A with q_F' = A q_O' in rigid contact, J_CF^f A = J_O^f."""
    return np.linalg.lstsq(observation.J_CF_f, observation.J_O_f, rcond=1e-6)[0]
