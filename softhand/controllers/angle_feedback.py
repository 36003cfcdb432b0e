"""Angle feedback: two fingers press along the normals and turn the object by its measured angle."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.controllers.controller import Controller, Torque
from softhand.controllers.gains import diagonal
from softhand.controllers.tips import need_fingers
from softhand.model.configuration import rotation_of, turn_towards
from softhand.observation import Observation
from softhand.settings import Gain, NonNegative


class AngleFeedback(Controller):
    """Angle feedback, in the manner of Doulgeri and Fasoulas: press along the normals, turn by tangential forces.

    With b the normal of the plane of the fingers, c_i the contact points, n_i the normals into the object,
    e = b . 1/2 sum r_k x r_dk the missing angle about b and L, u distance and direction from c_2 to c_1:

        tau = J_C^T (n_i f_Nd +- M / L (b x u) - m g / 2) + N_F - K_v q_F'
        M = K e - D b . w - b . sum (c_i - p_c) x (n_i f_Nd - m g / 2)

    so that M is what is left for the tangential forces, + at finger 1 and - at finger 2. They add up to nothing: the
    position is not regulated and stays where the motion leaves it. J_C is the Jacobian at the contact points, p_c the
    centre of mass. Structure: certain; the details of the original, which is planar and without gravity, are not. Two
    fingers only; contact points, normals and the object's orientation are measured.

    Attributes:
        K: stiffness of the angle [N m/rad].
        D: damping of the angle [N m s/rad].
        K_v: joint damping [N m s/rad], one number or n.
    """

    K: NonNegative = 0.3
    D: NonNegative = 0.002
    K_v: Gain = 0.005

    def start(self, observation: Observation) -> Any:
        """The joint damping as an array, and b: the axis of the last joint of finger 1."""
        need_fingers("angle-feedback", observation, 2, 2)
        turning = observation.tip_angular_jacobian[0]
        last = np.flatnonzero(np.any(turning != 0.0, axis=0))[-1]
        return diagonal("K_v", self.K_v, observation.joint_position.shape[0]), turning[:, last].copy()

    def torque(self, observation: Observation, memory: Any) -> tuple[Torque, Any]:
        """The law of the class."""
        seen = observation
        K_v, b = memory
        centre = seen.object_position + seen.object_rotation @ seen.object_lever
        axes, points = seen.contact_rotation, seen.contact_point
        forces = seen.desired.internal_force[0] * axes[:, :, 2] - 0.5 * seen.object_mass * seen.gravity
        wanted = turn_towards(seen.object_rotation, rotation_of(seen.desired.coordinates[3:]))
        M = b @ (self.K * wanted - self.D * seen.object_twist[3:] - np.cross(points - centre, forces).sum(axis=0))
        line = points[0] - points[1]
        couple = M / (line @ line) * np.cross(b, line)
        forces += np.outer([1.0, -1.0], couple)
        f_C = np.einsum("iba,ib->ia", axes, forces).ravel()
        return seen.J_CF_f.T @ f_C + seen.N_F - K_v * seen.joint_velocity, memory
