"""Angle feedback: two fingers press along the normals and turn the object by its measured angle."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from softhand.controllers.blocks import hold_joints, push_contacts, turn_error
from softhand.controllers.controller import Controller
from softhand.controllers.gains import diagonal
from softhand.controllers.tips import cross, last_axis, need_fingers
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.rotations import set_rotation
from softhand.numerics.triples import dot
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

    @property
    def formula(self) -> Any:  # type: ignore[override]
        """The law of the class."""
        return angle_feedback

    def constants(self, observation: Observation) -> Gains:
        """The gains, and what is known of the object."""
        return Gains(
            self.K,
            self.D,
            diagonal("K_v", self.K_v, observation.joint_position.shape[0]),
            observation.object_mass,
            observation.object_lever.copy(),
            observation.gravity.copy(),
        )

    def start(self, observation: Observation) -> Any:
        """b: the axis of the last joint of finger 1."""
        need_fingers("angle-feedback", observation, 2, 2)
        return last_axis(observation.tip_angular_jacobian[0])


class Gains(NamedTuple):
    """The settings of `AngleFeedback`, and what is known of the object."""

    K: float
    D: float
    K_v: Array
    mass: float
    lever: Array
    gravity: Array


@compiled
def angle_feedback(observed, known, b, torque):
    """The law of the class."""
    forces, f_C = np.empty((2, 3)), np.empty(6)
    contact_forces(observed, known, b, forces)
    for i in range(2):
        for k in range(3):
            f_C[3 * i + k] = dot(observed.contact_rotation[i, :, k], forces[i])
    hold_joints(observed.gravity_torque, known.K_v, observed.joint_velocity, torque)
    push_contacts(observed.hand_force_jacobian, f_C, torque)


@compiled
def contact_forces(observed, known, b, forces):
    """What the tips shall do to the object at the contact points [N], world axes, shape (2, 3)."""
    R, points, axes = observed.object_rotation, observed.contact_point, observed.contact_rotation
    turn, arm, wanted = np.empty(3), np.empty(3), np.empty((3, 3))
    set_rotation(observed.object_coordinates_desired[3:6], wanted)
    turn_error(R, wanted, turn)
    M = known.K * dot(b, turn) - known.D * dot(b, observed.object_twist[3:6])
    for i in range(2):
        for k in range(3):
            centre = observed.object_coordinates[k] + R[k, 0] * known.lever[0] + R[k, 1] * known.lever[1]
            arm[k] = points[i, k] - centre - R[k, 2] * known.lever[2]
            forces[i, k] = observed.internal_force_desired[0] * axes[i, k, 2] - 0.5 * known.mass * known.gravity[k]
        M -= dot(b, cross(arm, forces[i]))
    for k in range(3):
        arm[k] = points[0, k] - points[1, k]
    way = cross(b, arm)
    share = M / dot(way, way)
    for k in range(3):
        forces[0, k] += share * way[k]
        forces[1, k] -= share * way[k]
