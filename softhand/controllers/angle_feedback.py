"""Angle feedback: two fingers press along the normals and turn the object by its measured angle."""

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


class AngleFeedback(Controller):
    """Angle feedback, in the manner of Doulgeri and Fasoulas: press along the normals, turn by tangential forces.

    With b the normal of the plane of the fingers, c_i the contact points, n_i the normals into the object,
    e = b . log(R_d R^T) the missing angle about b and w = b x (c_1 - c_2):

        tau = J_C^T (n_i f_Nd +- M w / |w|^2 - m g / 2) + N_F - K_v q_F'
        M = K e - D b . w_O - b . sum (c_i - p_c) x (n_i f_Nd - m g / 2)

    so that M is what is left for the tangential forces, + at finger 1 and - at finger 2. They add up to nothing: the
    position is not regulated and stays where the motion leaves it. w_O is the angular velocity of the object, p_c its
    centre of mass, J_C the Jacobian at the contact points. Structure: certain; the details of the original, which is
    planar and without gravity, are not. Two fingers only; contact points, normals and the object's orientation are
    measured.
    """

    K: NonNegative = 0.3
    """Stiffness of the angle [N m/rad]."""
    D: NonNegative = 0.002
    """Damping of the angle [N m s/rad]."""
    K_v: Gain = 0.005
    """Damping of the joints [N m s/rad or N s/m], one number or one a joint."""

    def start(self, observation: Observation) -> Any:
        """The joint damping as an array, and b: the axis of the last joint of finger 1."""
        need_fingers("angle-feedback", observation, 2, 2)
        K_v = diagonal("K_v", self.K_v, observation.joint_position.shape[0])
        return K_v, last_axis(observation.tip_angular_jacobian[0])

    def torque(self, observation: Observation, memory: Any) -> tuple[Torque, Any]:
        """The law of the class."""
        K_v, b = memory
        f_C = np.einsum("iba,ib->ia", observation.contact_rotation, self.forces(observation, b)).ravel()
        return observation.J_CF_f.T @ f_C + observation.N_F - K_v * observation.joint_velocity, memory

    def forces(self, observation: Observation, b: Any) -> Any:
        """What the tips shall do to the object at the contact points [N], world axes, shape (2, 3)."""
        centre = observation.object_position + observation.object_rotation @ observation.object_lever
        normals, points = observation.contact_rotation[:, :, 2], observation.contact_point
        forces = observation.desired.internal_force[0] * normals - 0.5 * observation.object_mass * observation.gravity
        missing = rotation_vector(observation.object_rotation, rotation_of(observation.desired.coordinates[3:]))
        M = b @ (
            self.K * missing - self.D * observation.object_twist[3:] - np.cross(points - centre, forces).sum(axis=0)
        )
        way = np.cross(b, points[0] - points[1])
        return forces + np.outer([1.0, -1.0], M / (way @ way) * way)
