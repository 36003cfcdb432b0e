"""Computed torque: the equations of motion of hand and object, solved for the torques."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.controllers.controller import Controller, Torque
from softhand.controllers.gains import diagonal, pose_diagonal
from softhand.controllers.grasp_force import grasp_torque
from softhand.controllers.pose import OrientationError, pose_task
from softhand.numerics.arrays import Array
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain


class ComputedTorque(Controller):
    """Computed torque: rigid-contact dynamics inverted, so that the pose error obeys e'' + K_d e' + K_p e = 0.

    With t the twist of the object, G = G^f its grasp matrix, J_h = J_CF^f, A = J_h^-1 G^T (so that q_F' = A t while the
    contacts do not give way) and b the acceleration t' at which e'' = -K_d e' - K_p e + (that of the reference):

        tau = J_h^T { G^+ [M_O b + C_O t + N_O] + K f_Nd } + M_F (A b + A' t) + C_F q_F' + N_F - K_v q_F'

    This is the law of Murray, Li and Sastry, tau = J_h^T (G^+ F + f_N) with F = M~ a + C~ q_O' + N~ and
    M~ = M_O + G J_h^-T M_F A, where the f_N in ker G is the one that does not turn the fingers' weight into squeeze.
    Form: certain, for rigid contacts; K_v is not part of it. Soft tips put a spring between hand and object: the gains
    must stay well below its frequency, 20 to 30 Hz in the reference hand. Where J_h is not square, A is the least-norm
    solution. A' is a difference of two samples.
    """

    orientation_error: OrientationError = "rotation-vector"
    """As in `regulation`; gains of the orientation are about the axes of the object, or those of roll, pitch, yaw."""
    torsion_compensation: bool = True
    """Whether the measured torsion moments are compensated. Rigid point contacts, as in the original, have none."""
    K_p_position: Gain = 200.0
    """Stiffness of the error of the position [1/s^2], one number or three."""
    K_p_orientation: Gain = 200.0
    """Stiffness of the error of the orientation [1/s^2], one number or three."""
    K_d_position: Gain = 15.0
    """Damping of the error of the position [1/s], one number or three."""
    K_d_orientation: Gain = 12.0
    """Damping of the error of the orientation [1/s], one number or three."""
    K_v: Gain = 0.005
    """Damping of the joints [N m s/rad or N s/m], one number or one a joint."""

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
        (K_p, K_d, K_v), A_before, before = memory
        b, twist = self._acceleration(observation, K_p, K_d), observation.object_twist
        A = _follow(observation)
        A_rate = (A - A_before) / (observation.time - before) if observation.time > before else np.zeros_like(A)
        wrench = observation.object_mass_matrix @ b + observation.object_velocity_terms + observation.object_gravity
        tau = grasp_torque(observation, wrench, observation.internal_force_desired, self.torsion_compensation)
        tau += observation.hand_mass_matrix @ (A @ b + A_rate @ twist) + observation.hand_velocity_terms
        tau += observation.gravity_torque - K_v * observation.joint_velocity
        return tau, ((K_p, K_d, K_v), A, observation.time)

    def _acceleration(self, observation: Observation, K_p: Array, K_d: Array) -> Array:
        """b, the rate of the twist, shape (6,)."""
        task = pose_task("ComputedTorque", observation, self.orientation_error)
        b = task.map @ (task.acceleration - K_d * task.rate - K_p * task.error)
        if self.orientation_error == "euler":
            b += observation.coordinate_map_rate_of_coordinates
        return b


def _follow(observation: Observation) -> Any:
    """A with q_F' = A t in rigid contact, J_CF^f A = G^fT."""
    return np.linalg.lstsq(observation.hand_force_jacobian, observation.object_force_jacobian, rcond=1e-6)[0]
