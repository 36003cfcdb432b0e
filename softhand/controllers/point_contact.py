"""Point contact: the fingers as if their tips were rigid, with friction and torsion moments."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from softhand.controllers.blocks import (
    add_pose_spring,
    add_twist_damper,
    hold_joints,
    hold_weight,
    pose_error,
    push_contacts,
    share_wrench,
)
from softhand.controllers.controller import Controller
from softhand.controllers.gains import diagonal, pose_diagonal
from softhand.controllers.tips import cross, pairs_of, radii
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled
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

    @property
    def formula(self) -> Any:  # type: ignore[override]
        """The law of the class."""
        return point_contact

    def constants(self, observation: Observation) -> Gains:
        """The gains as arrays, and what is known of tips and object."""
        return Gains(
            pose_diagonal("K", self.K_position, self.K_orientation),
            pose_diagonal("D", self.D_position, self.D_orientation),
            diagonal("K_v", self.K_v, observation.joint_position.shape[0]),
            self.torsion_compensation,
            radii(observation),
            pairs_of(observation),
            observation.object_mass,
            observation.object_lever.copy(),
            observation.gravity.copy(),
        )


class Gains(NamedTuple):
    """The settings of `PointContact` as diagonals, and what is known of tips and object."""

    K: Array
    D: Array
    K_v: Array
    compensate: bool
    radii: Array
    pairs: AnyArray
    mass: float
    lever: Array
    gravity: Array


@compiled
def point_contact(observed, known, memory, torque):
    """The law of the class."""
    nc, n = known.radii.shape[0], torque.shape[0]
    arms, forces = np.empty((nc, 3)), np.empty(3 * nc)
    rows, J_f, wrench = np.empty((3 * nc, 6)), np.empty((3 * nc, n)), np.empty(6)
    _set_wrench(observed, known, wrench)
    hold_joints(observed.gravity_torque, known.K_v, observed.joint_velocity, torque)
    for i in range(nc):
        normal, spin = observed.contact_rotation[i, :, 2], observed.tip_angular_jacobian[i]
        for k in range(3):
            arms[i, k] = known.radii[i] * normal[k]
        _set_rows(arms[i], observed.tip_position[i], observed.object_coordinates, rows[3 * i : 3 * i + 3])
        _set_carried(observed.tip_jacobian[i], spin, arms[i], J_f[3 * i : 3 * i + 3])
        if known.compensate:
            torsion = observed.contact_force[i, 3]
            for k in range(3):
                wrench[3 + k] -= normal[k] * torsion
                for j in range(n):
                    torque[j] += spin[k, j] * normal[k] * torsion
    share_wrench(rows, wrench, forces)
    _squeeze(observed.tip_position, arms, known.pairs, observed.internal_force_desired, forces)
    push_contacts(J_f, forces, torque)


@compiled
def _set_wrench(observed, known, wrench):
    """F_d about the origin of the object frame, world axes, shape (6,)."""
    error, still = np.empty(6), np.zeros(6)
    hold_weight(known.mass, known.lever, observed.object_rotation, known.gravity, wrench)
    pose_error(observed.object_coordinates, observed.object_rotation, observed.object_coordinates_desired, error)
    add_pose_spring(known.K, error, observed.object_rotation, wrench)
    add_twist_damper(known.D, observed.object_twist, still, wrench)


@compiled
def _set_rows(arm, tip, origin, rows):
    """The rows of G_f^T of a contact, world axes: velocity of the object there, v - p x w, shape (3, 6)."""
    x, y, z = tip[0] + arm[0] - origin[0], tip[1] + arm[1] - origin[1], tip[2] + arm[2] - origin[2]
    rows[:] = 0.0
    rows[0, 0] = rows[1, 1] = rows[2, 2] = 1.0
    rows[0, 4], rows[0, 5], rows[1, 3] = z, -y, -z
    rows[1, 5], rows[2, 3], rows[2, 4] = x, y, -x


@compiled
def _set_carried(velocity, spin, arm, J):
    """J = velocity + spin x arm, Jacobian of the point at an arm from a tip centre, shape (3, n)."""
    for j in range(J.shape[1]):
        moved = cross(spin[:, j], arm)
        for k in range(3):
            J[k, j] = velocity[k, j] + moved[k]


@compiled
def _squeeze(tips, arms, pairs, magnitudes, forces):
    """forces += N f_N: along the lines between the points [N], world axes, shape (3 nc,)."""
    line = np.empty(3)
    for pair in range(pairs.shape[0]):
        i, j = pairs[pair, 0], pairs[pair, 1]
        square = 0.0
        for k in range(3):
            line[k] = tips[j, k] + arms[j, k] - tips[i, k] - arms[i, k]
            square += line[k] * line[k]
        for k in range(3):
            force = magnitudes[pair] * line[k] / np.sqrt(square)
            forces[3 * i + k] += force
            forces[3 * j + k] -= force
