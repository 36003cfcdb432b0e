"""Object impedance: the object answers to a push as a mass on a spring and a damper would."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from softhand.controllers.blocks import hold_joints
from softhand.controllers.controller import Controller
from softhand.controllers.formula import Law
from softhand.controllers.gains import diagonal, pose_diagonal
from softhand.controllers.grasp_force import add_grasp_torque
from softhand.controllers.pose import OrientationError, add_wrench, irregular, set_task
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
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

    @property
    def formula(self) -> Any:  # type: ignore[override]
        """The law of the class."""
        return object_impedance

    def constants(self, observation: Observation) -> Gains:
        """The gains as arrays."""
        n, pairs = observation.joint_position.shape[0], observation.internal_force.shape[0]
        return Gains(
            pose_diagonal("M", self.M_position, self.M_orientation),
            pose_diagonal("D", self.D_position, self.D_orientation),
            pose_diagonal("K", self.K_position, self.K_orientation),
            diagonal("K_int", self.K_int, pairs),
            diagonal("K_v", self.K_v, n),
            self.orientation_error == "euler",
            self.torsion_compensation,
        )

    def complaint(self, observation: Observation, law: Law) -> Exception | None:
        """Roll, pitch and yaw cannot be used."""
        pitches = observation.object_rpy[1], observation.object_rpy_desired[1]
        is_euler = self.orientation_error == "euler"
        return irregular("ObjectImpedance", observation.time, *pitches) if is_euler else None


class Gains(NamedTuple):
    """The settings of `ObjectImpedance` as diagonals."""

    M_d: Array
    D: Array
    K: Array
    K_int: Array
    K_v: Array
    is_euler: bool
    compensate: bool


@compiled
def object_impedance(observed, gains, memory, torque):
    """The law of the class."""
    error, rate, force, wrench = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    set_task(observed, gains.is_euler, error, rate, force)
    for k in range(6):
        force[k] = gains.M_d[k] * force[k] - gains.D[k] * rate[k] - gains.K[k] * error[k]
        wrench[k] = observed.object_gravity[k]
    add_wrench(observed, gains.is_euler, force, wrench)
    squeeze = np.empty(gains.K_int.shape[0])
    for k in range(squeeze.shape[0]):
        squeeze[k] = gains.K_int[k] * observed.internal_force_desired[k]
    hold_joints(observed.gravity_torque, gains.K_v, observed.joint_velocity, torque)
    add_grasp_torque(observed, wrench, squeeze, gains.compensate, torque)
