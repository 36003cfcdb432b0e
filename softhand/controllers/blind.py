"""Blind manipulation: the fingertips stand for the object that they hold."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.controllers.controller import Controller, Torque
from softhand.controllers.gains import diagonal
from softhand.controllers.tips import attraction, need_fingers, pushed, radii, strength
from softhand.numerics.rotations import rotation_vector
from softhand.numerics.spatial import cross_matrix, rotation_of
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain, NonNegative


class Blind(Controller):
    """Blind manipulation, in the manner of Tahara and Arimoto: a virtual object frame from the tips, no sensing.

        u_i = f_d / sum(r) sum_j J_i^T (x_j - x_i) - C_i q_i' + K_p J_i^T (x_d - x_v) / nc
              + K_o J_W,i^T log(R_vd R_v^T) + N_F,i - J_i^T m g / nc

    x_i is the centre of a flat face, J_i its Jacobian. The virtual frame has x_v = mean of x_i, r_z along
    (x_3 - x_1) x (x_2 - x_1), r_y along x_1 - x_2, r_x = r_y x r_z; these are the columns of R_v. J_W,i is the share of
    finger i in its angular velocity, so that K_p and K_o are springs of the virtual frame and the law is passive. Its
    desired pose is its pose at the start moved as the object shall be moved: the pose of the object is used once, at
    the start. The first term pulls all tips together; f_d is chosen so that at the start the mean of
    f_d |x_j - x_i| / sum(r) is that of f_Nd.
    Structure: certain; the details of the original, among them which Jacobian J_W,i is, are not. Three fingers or more.
    Tips that roll and give way move against the object: an error remains that joint sensing cannot see.
    """

    K_p: NonNegative = 200.0
    """Stiffness of the virtual position [N/m]."""
    K_o: NonNegative = 0.3
    """Stiffness of the virtual attitude [N m/rad]."""
    mass: NonNegative = 0.2
    """Mass of the object, which the fingers carry in equal parts [kg]."""
    damping: Gain = 0.005
    """Damping C of the joints [N m s/rad or N s/m], one number or one a joint."""

    def start(self, observation: Observation) -> Any:
        """The damping, the virtual frame and the object's pose at the start, and f_d for squeezes of 1 N."""
        need_fingers("blind", observation, 3)
        C = diagonal("damping", self.damping, observation.joint_position.shape[0])
        centre, axes = virtual_frame(observation.tip_position)
        arm = observation.object_rotation.T @ (centre - observation.object_position)
        per_newton = strength(observation, np.ones_like(observation.internal_force))
        return C, arm, observation.object_rotation.T @ axes, per_newton

    def torque(self, observation: Observation, memory: Any) -> tuple[Torque, Any]:
        """The law of the class."""
        desired = observation.desired
        C, arm, axes_in_object, per_newton = memory
        count = len(observation.fingertips)
        wanted = rotation_of(desired.coordinates[3:])
        x_v, axes = virtual_frame(observation.tip_position)
        x_d = desired.coordinates[:3] + wanted @ arm
        f_d = per_newton * float(np.mean(desired.internal_force))
        forces = f_d / radii(observation).sum() * attraction(observation.tip_position)
        forces += (self.K_p * (x_d - x_v) - self.mass * observation.gravity) / count
        moment = self.K_o * rotation_vector(axes, wanted @ axes_in_object)
        forces[:3] += np.einsum("iab,a->ib", virtual_turning(observation.tip_position, axes), moment)
        return pushed(observation.tip_jacobian, forces) + observation.N_F - C * observation.joint_velocity, memory


def virtual_frame(x: Any) -> tuple[Any, Any]:
    """x_v [m], shape (3,), and axes r_x, r_y, r_z as columns, shape (3, 3), of the first three tips."""
    r_z = cross_matrix(x[2] - x[0]) @ (x[1] - x[0])
    r_z /= np.linalg.norm(r_z)
    r_y = (x[0] - x[1]) / np.linalg.norm(x[0] - x[1])
    return x.mean(axis=0), np.column_stack([cross_matrix(r_y) @ r_z, r_y, r_z])


def virtual_turning(x: Any, axes: Any) -> Any:
    """Angular velocity of the virtual frame from the velocities of the first three tips, shape (3, 3, 3).

    The sum over i of B_i x_i', [rad/s] in world axes.
    """
    r_x, r_y, r_z = axes.T
    length = np.linalg.norm(x[0] - x[1])
    along, across = r_y @ (x[2] - x[0]) / length, r_x @ (x[2] - x[0])
    line = np.outer(r_x, r_z) / length - np.outer(r_z, r_x) / length  # of the velocity of tip 1 less that of tip 2
    third = np.outer(r_y, r_z) / across  # of the velocity of the line beside tip 3 less that of tip 3
    return np.stack([line + (1.0 + along) * third, -line - along * third, -third])
