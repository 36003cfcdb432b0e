"""What a controller sees: everything about the grasp at one instant, as ready arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.contact.pads import Fingertip
from softhand.contact.pairs import contact_pairs
from softhand.model.world import Tip
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import carried, cross_matrix
from softhand.plant.plant import Plant
from softhand.references.reference import Desired


class Observation:
    """The grasp at one instant. SI units; world axes unless said otherwise.

    The arrays are live: the next control period overwrites them. Copy what you keep, write to none of them.
    n joints, nc contacts, np = nc (nc - 1) / 2 pairs of contacts.

    Attributes:
        time: [s].
        configuration: q of the rigid-body model, `State.q`, shape (nq,).
        joint_position: q_F [rad], shape (n,).
        joint_velocity: q_F' [rad/s], shape (n,).
        q_O: position of the object frame [m], then roll, pitch, yaw [rad], R = R_z R_y R_x, shape (6,).
        object_position: its first half, shape (3,).
        object_rpy: its second half, shape (3,).
        object_rotation: axes of the object frame, shape (3, 3).
        object_twist: velocity of the object frame's origin [m/s], then angular velocity [rad/s], shape (6,).
        T_O: object_twist = T_O q_O', shape (6, 6).
        contact_point: contact points [m], shape (nc, 3).
        contact_rotation: axes of the contact frames C_F (x_C, y_C, outward normal of the tip), shape (nc, 3, 3).
        contact_force: f_x, f_y, f_z [N] and tau [N m] on the object, in C_F, shape (nc, 4).
        contact_angles: Theta, Phi [rad], shape (nc, 2).
        deformation: dr [m], dtheta, dphi, dpsi [rad], or dr, s1, s2 [m], psi [rad] under a law in surface coordinates,
            shape (nc, 4).
        deformation_rate: its rate, shape (nc, 4).
        tip_position: centres of the hemispheres' flat faces [m], shape (nc, 3).
        friction_use: |f_t| / (mu f_z), 1 at the edge of the friction cone, shape (nc,).
        limit_surface_use: the same with torsion, sqrt{(|f_t| / (mu f_z))^2 + (tau / tau_max)^2}, shape (nc,).
        is_slipping: 1 where the last step slipped, shape (nc,).
        eta: theta, phi [rad], alpha_o [m or rad] (two), psi [rad] of each contact, shape (nc, 5), see
            `contact_coordinates`.
        eta_rate: its rate by (38)-(41), with the sign of (39) mended, shape (nc, 5).
        J_CF_f: Jacobian from q_F' to the tip's velocity at the contacts in C_F, rows of the forces, shape (3 nc, n).
        J_CF_tau: the same, rows of the torsion moments, shape (nc, n).
        J_O_f: Jacobian from q_O' to the object's velocity at the contacts in C_F, shape (3 nc, 6).
        J_O_tau: the same, rows of the torsion moments, shape (nc, 6).
        K: kernel of J_O_f^T, one column a pair of contacts, (58); f_N > 0 squeezes, shape (3 nc, np).
        internal_force: f_N = K^+ f_C [N], shape (np,).
        N_F: gravity terms of the joints [N m], shape (n,).
        N_O: gravity terms of the object in the coordinates q_O, shape (6,).
        effort_limit: largest torque of each joint [N m], shape (n,).
        desired: what the reference asks for now.
        fingertips: law, friction and face (in the object frame) of each tip; constants.
        tip_names: of the fingertips, in their order; constants.
        object_mass: [kg]; a constant.
        object_lever: from the origin of the object frame to the centre of mass, in that frame [m], shape (3,); a
            constant.
        gravity: [m/s^2], world axes, shape (3,); a constant.
    """

    def __init__(self, plant: Plant, desired: Desired) -> None:
        world = plant.world
        contacts: Any = plant.tip_contacts
        n, nc, pairs = world.n_joints, world.n_tips, len(contact_pairs(world.n_tips))
        self.time = 0.0
        self.desired = desired
        self.effort_limit = world.effort_limit
        self.joint_position, self.joint_velocity = np.zeros(n), np.zeros(n)
        self.q_O, self.object_twist = np.zeros(6), np.zeros(6)
        self.object_position, self.object_rpy = self.q_O[:3], self.q_O[3:]
        self.object_rotation, self.T_O = np.zeros((3, 3)), np.zeros((6, 6))
        self.contact_point, self.contact_rotation = contacts["point"], contacts["rotation"]
        self.contact_force, self.contact_angles = contacts["force"], contacts["angles"]
        self.deformation, self.deformation_rate = contacts["deformation"], contacts["deformation_rate"]
        self.tip_position = contacts["tip"]
        self.limit_surface_use, self.is_slipping = contacts["limit_surface_use"], contacts["is_slipping"]
        self.friction_use, self.eta, self.eta_rate = np.zeros(nc), np.zeros((nc, 5)), np.zeros((nc, 5))
        self.J_CF_f, self.J_CF_tau = np.zeros((3 * nc, n)), np.zeros((nc, n))
        self.J_O_f, self.J_O_tau = np.zeros((3 * nc, 6)), np.zeros((nc, 6))
        self.K, self.internal_force = np.zeros((3 * nc, pairs)), np.zeros(pairs)
        self.N_F, self.N_O = np.zeros(n), np.zeros(6)
        inertia = world.model.inertias[world.object_joint]
        self.fingertips: tuple[Fingertip, ...] = plant.fingertips
        self.tip_names = tuple(tip.name for tip in world.tips)
        self.object_mass, self.object_lever = float(inertia.mass), np.array(inertia.lever)
        self.gravity = world.gravity
        self.configuration = np.zeros(world.model.nq)
        self._snapshot, self._tips = plant.snapshot, world.tips

    @property
    def J_CF(self) -> Array:
        """[J_CF_f; J_CF_tau] with the four rows of each contact together, as in (43), shape (4 nc, n). A copy."""
        return _interleave(self.J_CF_f, self.J_CF_tau)

    @property
    def J_O(self) -> Array:
        """[J_O_f; J_O_tau] with the four rows of each contact together, as in (43), shape (4 nc, 6). A copy."""
        return _interleave(self.J_O_f, self.J_O_tau)

    @property
    def tip_rotation(self) -> Array:
        """Axes of the finger frames F, shape (nc, 3, 3). A copy. Depends on q_F alone, as `tip_position` does."""
        poses = self._snapshot.poses
        return np.stack([poses[tip.joint, :9].reshape(3, 3).T @ tip.rotation for tip in self._tips])

    @property
    def tip_jacobian(self) -> Array:
        """J_i, Jacobian from q_F' to the velocity of `tip_position`, shape (nc, 3, n). A copy."""
        at_origin = _cut(self._snapshot.J[:3], self._tips, self.N_F.shape[0])
        return carried(at_origin, self.tip_angular_jacobian, self.tip_position)

    @property
    def tip_angular_jacobian(self) -> Array:
        """Jacobian from q_F' to the angular velocity of the tips, world axes, shape (nc, 3, n). A copy."""
        return _cut(self._snapshot.J[3:], self._tips, self.N_F.shape[0])

    @property
    def q_O_rate(self) -> Array:
        """q_O' [m/s, rad/s], shape (6,). A copy."""
        return np.asarray(np.linalg.solve(self.T_O, self.object_twist))

    @property
    def velocity_terms_F(self) -> Array:
        """Coriolis and centrifugal terms of the hand, C_F q_F' [N m], shape (n,). A copy."""
        return self._velocity_terms()[: self.N_F.shape[0]]

    @property
    def velocity_terms_O(self) -> Array:
        """Coriolis and centrifugal terms of the object in the coordinates q_O, C_O q_O', shape (6,). A copy."""
        n, R = self.N_F.shape[0], self.object_rotation
        velocity, turning = self.object_twist[:3], self.object_twist[3:]
        roll_rate, pitch_rate, yaw_rate = self.q_O_rate[3:]
        roll_axis, pitch_axis, yaw_axis = self.T_O[3:, 3:].T
        # acceleration of the body's own velocity where q_O'' = 0
        tilting = pitch_rate * yaw_rate * cross_matrix(yaw_axis) @ pitch_axis
        tilting += roll_rate * cross_matrix(yaw_rate * yaw_axis + pitch_rate * pitch_axis) @ roll_axis
        bias = np.concatenate([-R.T @ cross_matrix(turning) @ velocity, R.T @ tilting])
        M_body = self._snapshot.mass_matrix(self.configuration)[n:, n:]
        return self._to_body.T @ (M_body @ bias + self._velocity_terms()[n:])

    def _velocity_terms(self) -> Array:
        R, twist = self.object_rotation, self.object_twist
        v = np.concatenate([self.joint_velocity, R.T @ twist[:3], R.T @ twist[3:]])
        return self._snapshot.velocity_terms(self.configuration, v)

    @property
    def _to_body(self) -> Array:
        """Velocity of the object in its own frame from q_O', shape (6, 6)."""
        to_body = np.zeros((6, 6))
        to_body[:3, :3] = to_body[3:, 3:] = self.object_rotation.T
        return to_body @ self.T_O

    @property
    def M_F(self) -> Array:
        """Mass matrix of the hand, shape (n, n). A copy."""
        n = self.joint_position.shape[0]
        return self._snapshot.mass_matrix(self.configuration)[:n, :n]

    @property
    def M_O(self) -> Array:
        """Mass matrix of the object in the coordinates q_O, shape (6, 6). A copy."""
        n = self.joint_position.shape[0]
        return self._to_body.T @ self._snapshot.mass_matrix(self.configuration)[n:, n:] @ self._to_body

    @property
    def f_C(self) -> Array:
        """Contact forces without the torsion moments, (49) [N], shape (3 nc,). A copy."""
        return self.contact_force[:, :3].ravel()

    @property
    def tau_C(self) -> Array:
        """Torsion moments, (49) [N m], shape (nc,). A view."""
        return self.contact_force[:, 3]


def _cut(J: Array, tips: tuple[Tip, ...], n: int) -> Array:
    """The columns of J that move each tip, zero elsewhere, shape (nc, 3, n)."""
    rows = np.zeros((len(tips), 3, n))
    for row, tip in zip(rows, tips, strict=True):
        columns = list(tip.columns)
        row[:, columns] = J[:, columns]
    return rows


def _interleave(force_rows: Array, moment_rows: Array) -> Array:
    nc, columns = moment_rows.shape
    return np.concatenate([force_rows.reshape(nc, 3, columns), moment_rows[:, None, :]], axis=1).reshape(-1, columns)
