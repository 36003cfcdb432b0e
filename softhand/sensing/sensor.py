"""Bringing an observation up to date: one compiled call after Pinocchio."""

from __future__ import annotations

import math

import numpy as np

from softhand.contact.damping import forbid_pull
from softhand.contact.friction import limit_surface_use, spin_length
from softhand.contact.kinematics import contact_coordinates, move_contacts
from softhand.contact.layer import evaluate_contacts
from softhand.contact.pairs import contact_pairs
from softhand.model.configuration import CONTINUOUS
from softhand.model.gravity import gravity_forces
from softhand.numerics.compiled import compiled
from softhand.numerics.prepared import prepared
from softhand.plant.plant import Plant
from softhand.plant.state import State, is_at
from softhand.references.reference import Desired
from softhand.sensing.internal_forces import internal_forces
from softhand.sensing.observation import Observation


class Sensor:
    """Keeps an observation up to date; without Pinocchio where the stepper has left the plant at the very state."""

    def __init__(self, plant: Plant, desired: Desired) -> None:
        self._plant = plant
        self._pairs = np.array(contact_pairs(plant.world.n_tips), dtype=np.int64)
        self.observation = Observation(plant, desired)
        self._moments, self._gravity = np.zeros((plant.world.model.njoints, 4)), np.zeros(plant.world.model.nv)
        self._state: State | None = None

    def observe(self, state: State, time: float) -> Observation:
        """The observation at a state and a time [s]."""
        if state is not self._state:
            self._prepare(state)
        if not self._observe(True):
            self._plant.snapshot.sense(state.q)
            self._observe(False)
        self.observation.time = time
        return self.observation

    def _prepare(self, state: State) -> None:
        plant, snapshot, seen = self._plant, self._plant.snapshot, self.observation
        self._state, seen.configuration = state, state.q
        self._observe = prepared(
            _observe, plant.pads, plant.columns, plant.joints, self._pairs, snapshot.poses, snapshot.J,
            plant.world.bodies, plant.world.gravity, self._moments, self._gravity, plant.at, state.q, state.v, state.z,
            plant.contacts, plant.contact_columns, seen.joint_position, seen.joint_velocity, seen.q_O,
            seen.object_rotation, seen.object_twist, seen.T_O, seen.N_F, seen.N_O, seen.J_CF_f, seen.J_CF_tau,
            seen.J_O_f, seen.J_O_tau, seen.friction_use, seen.eta, seen.eta_rate, seen.K, seen.internal_force,
            varying=(True,),
        )  # fmt: skip


@compiled
def _observe(
    pads, columns, joints, pairs, poses, J, bodies, acceleration, moments, gravity, at, q, v, z, contacts,
    contact_columns, joint_position, joint_velocity, q_O, rotation, twist, T_O, N_F, N_O, J_CF_f, J_CF_tau, J_O_f,
    J_O_tau, friction_use, eta, eta_rate, K, internal_force, evaluated,
):  # fmt: skip
    """Everything but the time; False if the plant is said to be evaluated at this state and is not."""
    if not evaluated:
        evaluate_contacts(pads, columns, poses, J, v, z, 0.0, False, contacts, contact_columns)
        at[0] = math.nan
    elif is_at(q, v, z, at):
        move_contacts(columns, contacts, contact_columns, v)
        forbid_pull(pads, contacts)
    else:
        return False
    gravity_forces(bodies, acceleration, poses, J, moments, gravity)
    for k in range(joint_position.shape[0]):
        i = joints[k, 1]
        joint_position[k] = math.atan2(q[i + 1], q[i]) if joints[k, 0] == CONTINUOUS else q[i]
        joint_velocity[k], N_F[k] = v[k], gravity[k]
    _describe_object(poses[poses.shape[0] - 1], v, gravity, q_O, rotation, twist, T_O, N_O)
    _describe_contacts(pads, contacts, columns, contact_columns, poses, J, v, T_O, J_CF_f, J_CF_tau, J_O_f, J_O_tau,
                       friction_use, eta, eta_rate)  # fmt: skip
    internal_forces(contacts, pairs, K, internal_force)
    return True


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
    for k in range(3):
        T_O[k, k] = 1.0
    T_O[3, 3], T_O[4, 3], T_O[5, 3] = rotation[0, 0], rotation[1, 0], rotation[2, 0]
    T_O[3, 4], T_O[4, 4], T_O[5, 4] = -sin_yaw, cos_yaw, 0.0
    T_O[3, 5], T_O[4, 5], T_O[5, 5] = 0.0, 0.0, 1.0
    column = v.shape[0] - 6
    for k in range(6):
        twist[k], N_O[k] = 0.0, 0.0
    for row in range(3):
        moment = 0.0
        for k in range(3):
            twist[row] += rotation[row, k] * v[column + k]
            twist[3 + row] += rotation[row, k] * v[column + 3 + k]
            N_O[row] += rotation[row, k] * gravity[column + k]
            moment += rotation[row, k] * gravity[column + 3 + k]
        for k in range(3):
            N_O[3 + k] += T_O[3 + row, 3 + k] * moment


@compiled
def _describe_contacts(
    pads, contacts, columns, jacobian, poses, J, v, T_O, J_CF_f, J_CF_tau, J_O_f, J_O_tau, friction_use, eta, eta_rate
):  # fmt: skip
    object_pose = poses[poses.shape[0] - 1]
    for i in range(eta.shape[0]):
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
        limit = contact.friction * max(f[2], 0.0)
        tangential = math.hypot(f[0], f[1])
        friction_use[i] = tangential / limit if limit > 0.0 else (math.inf if tangential > 0.0 else 0.0)
        if pads[i].can_slip and pads[i].is_damped:  # the limit was kept before viscosity followed the velocity
            most = contact.limit_surface_use * contact.static_friction / contact.friction
            friction_use[i] = min(friction_use[i], most)
        if not pads[i].can_slip:
            length = spin_length(pads[i], contact.distance)
            contact.limit_surface_use = limit_surface_use(f, contact.friction, length)
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
