"""Object impedance: the object answers to a push as a mass on a spring and a damper would."""

from __future__ import annotations

from typing import Any

from softhand.controllers.controller import Controller, Torque
from softhand.controllers.gains import diagonal, pose_diagonal
from softhand.controllers.grasp_force import grasp_torque
from softhand.controllers.pose import OrientationError, pose_task
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain


class ObjectImpedance(Controller):
    """Object impedance: spring, damper and virtual mass at the object, the squeeze as asked without feedback.

        tau = J_CF^fT { (J_O^fT)^+ [M_d q_Od'' - D e' - K e + N_O - J_O^tauT tau_C] + K_int f_Nd }
              + J_CF^tauT tau_C + N_F - K_v q_F'

    with e the pose error, q_O - q_Od, or position and rotation vector with all else in axes of the object.

    Form: certain; impedance control of the grasped object is in many papers and textbooks. K_v is not part of it: the
    damper acts on the object only, and the tips have next to no damping of their own. Valid where tips are much stiffer
    than K: the spring then is that of the object. Torsion as in (59).
    """

    orientation_error: OrientationError = "rotation-vector"
    """As in `regulation`; gains of the orientation are about the axes of the object, or those of roll, pitch, yaw."""
    torsion_compensation: bool = True
    """Whether the measured torsion moments are compensated."""
    M_position: Gain = 0.2
    """Virtual mass [kg], one number or three."""
    M_orientation: Gain = 1e-4
    """Virtual inertia of the orientation [kg m^2], one number or three."""
    D_position: Gain = 2.0
    """Damping of the position [N s/m], one number or three."""
    D_orientation: Gain = 0.002
    """Damping of the orientation [N m s/rad], one number or three."""
    K_position: Gain = 100.0
    """Stiffness of the position [N/m], one number or three."""
    K_orientation: Gain = 0.3
    """Stiffness of the orientation [N m/rad], one number or three."""
    K_int: Gain = 1.0
    """Factor of the desired internal force [1], one number or one a pair of contacts."""
    K_v: Gain = 0.005
    """Damping of the joints [N m s/rad or N s/m], one number or one a joint."""

    def start(self, observation: Observation) -> Any:
        """The gains as arrays."""
        n, pairs = observation.joint_position.shape[0], observation.internal_force.shape[0]
        return (
            pose_diagonal("M", self.M_position, self.M_orientation),
            pose_diagonal("D", self.D_position, self.D_orientation),
            pose_diagonal("K", self.K_position, self.K_orientation),
            diagonal("K_int", self.K_int, pairs),
            diagonal("K_v", self.K_v, n),
        )

    def torque(self, observation: Observation, memory: Any) -> tuple[Torque, Any]:
        """The law of the class."""
        desired = observation.desired
        M_d, D, K, K_int, K_v = memory
        task = pose_task("ObjectImpedance", observation, self.orientation_error)
        wrench = observation.object_gravity + task.wrench(M_d * task.acceleration - D * task.rate - K * task.error)
        tau = grasp_torque(observation, wrench, K_int * desired.internal_force, self.torsion_compensation)
        return tau + observation.N_F - K_v * observation.joint_velocity, memory
