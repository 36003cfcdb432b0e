"""Point contact: the fingers as if their tips were rigid, with friction and torsion moments."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.contact.grasp_map import grasp_map
from softhand.contact.pairs import contact_pairs
from softhand.controllers.controller import Controller, Torque
from softhand.controllers.gains import diagonal
from softhand.numerics.linear import least_norm
from softhand.numerics.rotations import rotation_vector
from softhand.numerics.spatial import carried, cross_matrix, rotation_of
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain, NonNegative


class PointContact(Controller):
    """Point contact, in the manner of Yokokohji: undeformed tips in the kinematics, torsion moments compensated.

    The contacts are taken to lie at x_i + r z_C,i, the whole radius before the tip centre. There, J_f and J_tau map
    q_F' to velocity and spin of the tips and G_f, G_tau map forces and torsion moments to the object's wrench:

        F_d = W + (K_p (p_d - p_O) - D_p v, K_r log(R_d R^T) - D_r w)
        f_d = G_f^+ (F_d - G_tau tau_C) + N f_Nd
        tau = J_f^T f_d + J_tau^T tau_C + N_F - K_v q_F'

    with W what carries the object's weight and N the unit vectors between the contacts, f_Nd > 0 squeezes. Structure:
    certain; the details of the original are not. The squeeze has no feedback. The contacts are wrong by dr, 2 mm of
    10 mm in the reference hand: a small steady error, where (59) has none, is the price of knowing less.
    """

    torsion_compensation: bool = True
    """Whether the measured torsion moments are compensated."""
    K_position: NonNegative = 100.0
    """Stiffness of the position [N/m]."""
    K_orientation: NonNegative = 0.3
    """Stiffness of the orientation [N m/rad]."""
    D_position: NonNegative = 1.0
    """Damping of the velocity of the object [N s/m]."""
    D_orientation: NonNegative = 0.001
    """Damping of the angular velocity of the object [N m s/rad]."""
    K_v: Gain = 0.005
    """Damping of the joints [N m s/rad or N s/m], one number or one a joint."""

    def start(self, observation: Observation) -> Any:
        """The joint damping as an array."""
        return diagonal("K_v", self.K_v, observation.joint_position.shape[0])

    def torque(self, observation: Observation, memory: Any) -> tuple[Torque, Any]:
        """The law of the class."""
        K_v = memory
        normal = observation.contact_rotation[:, :, 2]
        arm = np.array([[tip.law.radius] for tip in observation.fingertips]) * normal
        point = observation.tip_position + arm
        turning = observation.tip_angular_jacobian
        J_f = carried(observation.tip_jacobian, turning, arm).reshape(-1, turning.shape[2])
        J_tau = np.einsum("ib,ibk->ik", normal, turning)
        wrench = self._wrench(observation)
        if self.torsion_compensation:
            wrench[3:] -= normal.T @ observation.tau_C
        f_d = np.empty(J_f.shape[0])
        least_norm(np.ascontiguousarray(grasp_map(point - observation.object_position).T), True, wrench, f_d)
        f_d += _squeeze(point, observation.desired.internal_force)
        tau = J_f.T @ f_d + observation.N_F - K_v * observation.joint_velocity
        if self.torsion_compensation:
            tau += J_tau.T @ observation.tau_C
        return tau, memory

    def _wrench(self, observation: Observation) -> Any:
        """F_d about the origin of the object frame, world axes, shape (6,)."""
        desired, twist = observation.desired.coordinates, observation.object_twist
        weight = -observation.object_mass * observation.gravity
        force = weight + self.K_position * (desired[:3] - observation.object_position) - self.D_position * twist[:3]
        moment = (
            cross_matrix(observation.object_rotation @ observation.object_lever) @ weight
            - self.D_orientation * twist[3:]
        )
        moment += self.K_orientation * rotation_vector(observation.object_rotation, rotation_of(desired[3:]))
        return np.concatenate([force, moment])


def _squeeze(point: Any, magnitudes: Any) -> Any:
    """N f_N: forces on the object along the lines between the points [N], world axes, shape (3 nc,)."""
    forces = np.zeros_like(point)
    for (i, j), magnitude in zip(contact_pairs(len(point)), magnitudes, strict=True):
        direction = (point[j] - point[i]) / np.linalg.norm(point[j] - point[i])
        forces[i] += magnitude * direction
        forces[j] -= magnitude * direction
    return forces.ravel()
