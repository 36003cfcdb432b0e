"""What a controller sees: everything about the grasp at one instant, as ready arrays."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from softhand.compiled import compiled
from softhand.contact.kinematics import contact_coordinates
from softhand.linear import least_norm
from softhand.model.configuration import CONTINUOUS
from softhand.plant import Plant, State
from softhand.references import Desired

Array = NDArray[np.float64]


def contact_pairs(n_contacts: int) -> list[tuple[int, int]]:
    """Pairs of contacts that an internal force acts between, in the paper's order: (2, 3), (1, 3), (1, 2), from 0."""
    return list(combinations(range(n_contacts), 2))[::-1]


class Observation:
    """The grasp at one instant. SI units; world axes unless said otherwise.

    The arrays are live: the next control period overwrites them. Copy what you keep, write to none of them.
    n joints, nc contacts, np = nc (nc - 1) / 2 pairs of contacts.

    Attributes:
        time: [s].
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
        deformation: dr [m], dtheta, dphi, dpsi [rad], shape (nc, 4).
        deformation_rate: its rate, shape (nc, 4).
        tip_position: centres of the hemispheres' flat faces [m], shape (nc, 3).
        friction_use: |f_t| / (mu f_z), 1 at the edge of the friction cone, shape (nc,).
        eta: theta, phi [rad], alpha_o [m] (two), psi [rad] of each contact, shape (nc, 5).
        eta_rate: its rate by (38)-(40), with the sign of (39) mended, shape (nc, 5).
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
    """

    def __init__(self, plant: Plant, desired: Desired) -> None:
        world = plant.world
        n, nc, pairs = world.n_joints, world.n_tips, len(contact_pairs(world.n_tips))
        contacts = plant.contacts
        self.time = 0.0
        self.desired = desired
        self.effort_limit = world.effort_limit
        self.joint_position, self.joint_velocity = np.zeros(n), np.zeros(n)
        self.q_O, self.object_twist = np.zeros(6), np.zeros(6)
        self.object_position, self.object_rpy = self.q_O[:3], self.q_O[3:]
        self.object_rotation = np.zeros((3, 3))
        self.T_O = np.eye(6)
        self.contact_point, self.contact_rotation = contacts["point"], contacts["rotation"]
        self.contact_force, self.contact_angles = contacts["force"], contacts["angles"]
        self.deformation, self.deformation_rate = contacts["deformation"], contacts["deformation_rate"]
        self.tip_position = contacts["tip"]
        self.friction_use = np.zeros(nc)
        self.eta, self.eta_rate = np.zeros((nc, 5)), np.zeros((nc, 5))
        self.J_CF_f, self.J_CF_tau = np.zeros((3 * nc, n)), np.zeros((nc, n))
        self.J_O_f, self.J_O_tau = np.zeros((3 * nc, 6)), np.zeros((nc, 6))
        self.K, self.internal_force = np.zeros((3 * nc, pairs)), np.zeros(pairs)
        self.N_F, self.N_O = plant.snapshot.gravity[:n], np.zeros(6)
        self._snapshot = plant.snapshot

    @property
    def J_CF(self) -> Array:
        """[J_CF_f; J_CF_tau] with the four rows of each contact together, as in (43), shape (4 nc, n). A copy."""
        return _interleave(self.J_CF_f, self.J_CF_tau)

    @property
    def J_O(self) -> Array:
        """[J_O_f; J_O_tau] with the four rows of each contact together, as in (43), shape (4 nc, 6). A copy."""
        return _interleave(self.J_O_f, self.J_O_tau)

    @property
    def M_F(self) -> Array:
        """Mass matrix of the hand, shape (n, n). A copy."""
        n = self.joint_position.shape[0]
        return _symmetric(self._snapshot.M[:n, :n])

    @property
    def M_O(self) -> Array:
        """Mass matrix of the object in the coordinates q_O, shape (6, 6). A copy."""
        n = self.joint_position.shape[0]
        to_body = np.kron(np.eye(2), self.object_rotation.T) @ self.T_O
        return to_body.T @ _symmetric(self._snapshot.M[n:, n:]) @ to_body

    @property
    def f_C(self) -> Array:
        """Contact forces without the torsion moments, (49) [N], shape (3 nc,). A copy."""
        return self.contact_force[:, :3].ravel()

    @property
    def tau_C(self) -> Array:
        """Torsion moments, (49) [N m], shape (nc,). A view."""
        return self.contact_force[:, 3]


def _interleave(force_rows: Array, moment_rows: Array) -> Array:
    nc, columns = moment_rows.shape
    return np.concatenate([force_rows.reshape(nc, 3, columns), moment_rows[:, None, :]], axis=1).reshape(-1, columns)


def _symmetric(upper: Array) -> Array:
    return np.triu(upper) + np.triu(upper, 1).T


class Sensor:
    """Keeps an observation up to date."""

    def __init__(self, plant: Plant, desired: Desired) -> None:
        self._plant = plant
        self._pairs = np.array(contact_pairs(plant.world.n_tips), dtype=np.int64)
        self._continuous = np.flatnonzero(plant.joints[:-1, 0] == CONTINUOUS)
        self._first = plant.joints[:-1, 1].copy()
        self.observation = Observation(plant, desired)

    def observe(self, state: State, time: float) -> Observation:
        """The observation at a state and a time [s]."""
        plant, seen = self._plant, self.observation
        snapshot = plant.snapshot
        snapshot.sense(state.q)
        plant.touch(state.v, state.z)
        seen.time = time
        np.take(state.q, self._first, out=seen.joint_position)
        for k in self._continuous:
            seen.joint_position[k] = math.atan2(state.q[self._first[k] + 1], state.q[self._first[k]])
        seen.joint_velocity[:] = state.v[:-6]
        _describe_object(snapshot.poses[-1], state.v, snapshot.gravity, seen.q_O, seen.object_rotation,
                         seen.object_twist, seen.T_O, seen.N_O)  # fmt: skip
        _describe_contacts(plant.pads, plant.contacts, plant.columns, plant.contact_columns, snapshot.poses, snapshot.J,
                           state.v, seen.T_O, seen.J_CF_f, seen.J_CF_tau, seen.J_O_f, seen.J_O_tau, seen.friction_use,
                           seen.eta, seen.eta_rate)  # fmt: skip
        internal_forces(plant.contacts, self._pairs, seen.K, seen.internal_force)
        return seen


@compiled
def _describe_object(pose, v, gravity, q_O, rotation, twist, T_O, N_O):
    for row in range(3):
        q_O[row] = pose[9 + row]
        for k in range(3):
            rotation[row, k] = pose[3 * k + row]
    q_O[3] = math.atan2(rotation[2, 1], rotation[2, 2])
    cos_pitch = math.hypot(rotation[0, 0], rotation[1, 0])
    q_O[4] = math.atan2(-rotation[2, 0], cos_pitch)
    q_O[5] = math.atan2(rotation[1, 0], rotation[0, 0])
    # angular velocity = roll' x'' + pitch' y' + yaw' z
    cos_yaw, sin_yaw = math.cos(q_O[5]), math.sin(q_O[5])
    T_O[3, 3], T_O[4, 3], T_O[5, 3] = rotation[0, 0], rotation[1, 0], rotation[2, 0]
    T_O[3, 4], T_O[4, 4], T_O[5, 4] = -sin_yaw, cos_yaw, 0.0
    T_O[3, 5], T_O[4, 5], T_O[5, 5] = 0.0, 0.0, 1.0
    column = v.shape[0] - 6
    moment = np.zeros(3)
    for row in range(3):
        twist[row], twist[3 + row], N_O[row] = 0.0, 0.0, 0.0
        for k in range(3):
            twist[row] += rotation[row, k] * v[column + k]
            twist[3 + row] += rotation[row, k] * v[column + 3 + k]
            N_O[row] += rotation[row, k] * gravity[column + k]
            moment[row] += rotation[row, k] * gravity[column + 3 + k]
    for k in range(3):
        N_O[3 + k] = T_O[3, 3 + k] * moment[0] + T_O[4, 3 + k] * moment[1] + T_O[5, 3 + k] * moment[2]


@compiled
def _describe_contacts(
    pads, contacts, columns, jacobian, poses, J, v, T_O, J_CF_f, J_CF_tau, J_O_f, J_O_tau, friction_use, eta, eta_rate
):  # fmt: skip
    object_pose = poses[poses.shape[0] - 1]
    for i in range(contacts.shape[0]):
        contact = contacts[i]
        for a in range(columns.shape[1]):
            column = columns[i, a]
            if column < 0 or column >= J_CF_tau.shape[1]:
                break
            for row in range(3):
                J_CF_f[3 * i + row, column] = jacobian[i, a, row]
            J_CF_tau[i, column] = jacobian[i, a, 3]
        _object_rows(contact, object_pose, T_O, J_O_f[3 * i : 3 * i + 3], J_O_tau[i])
        f = contact.force
        limit = pads[i].friction * max(f[2], 0.0)
        tangential = math.hypot(f[0], f[1])
        friction_use[i] = tangential / limit if limit > 0.0 else (math.inf if tangential > 0.0 else 0.0)
        contact_coordinates(pads[i], contact, columns[i], object_pose, J, v, eta[i], eta_rate[i])


@compiled
def _object_rows(contact, object_pose, T_O, force_rows, moment_row):
    """J_O: velocity of the object's point at the contact in C_F, from q_O'."""
    R = contact.rotation
    ax, ay, az = (contact.point[0] - object_pose[9], contact.point[1] - object_pose[10],
                  contact.point[2] - object_pose[11])  # fmt: skip
    for column in range(3):
        wx, wy, wz = T_O[3, 3 + column], T_O[4, 3 + column], T_O[5, 3 + column]
        vx, vy, vz = wy * az - wz * ay, wz * ax - wx * az, wx * ay - wy * ax
        for row in range(3):
            force_rows[row, column] = R[column, row]
            force_rows[row, 3 + column] = R[0, row] * vx + R[1, row] * vy + R[2, row] * vz
        moment_row[column] = 0.0
        moment_row[3 + column] = R[0, 2] * wx + R[1, 2] * wy + R[2, 2] * wz


@compiled
def internal_forces(contacts, pairs, K, internal_force):
    """K of (58) and f_N = K^+ f_C.

    Column k of K holds, for the pair (i, j), the unit vector from contact i to j in C_Fi and from j to i in C_Fj.

    Args:
        contacts: table `records.CONTACT`, shape (nc,).
        pairs: contacts of each column, shape (np, 2).
        K: set, shape (3 nc, np).
        internal_force: set [N], shape (np,).
    """
    for k in range(pairs.shape[0]):
        i, j = pairs[k, 0], pairs[k, 1]
        a, b = contacts[i], contacts[j]
        x, y, z = b.point[0] - a.point[0], b.point[1] - a.point[1], b.point[2] - a.point[2]
        scale = 1.0 / math.sqrt(x * x + y * y + z * z)
        for row in range(3):
            K[3 * i + row, k] = scale * (a.rotation[0, row] * x + a.rotation[1, row] * y + a.rotation[2, row] * z)
            K[3 * j + row, k] = -scale * (b.rotation[0, row] * x + b.rotation[1, row] * y + b.rotation[2, row] * z)
    f_C = np.empty(3 * contacts.shape[0])
    for i in range(contacts.shape[0]):
        for row in range(3):
            f_C[3 * i + row] = contacts[i].force[row]
    least_norm(K, f_C, internal_force)
