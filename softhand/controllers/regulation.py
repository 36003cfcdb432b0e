"""The controller of the paper: regulates the object's pose and the internal force."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.controllers.controller import Controller, Torque
from softhand.controllers.gains import diagonal, pose_diagonal
from softhand.controllers.pose import OrientationError, euler_error, is_regular, pose_error, require_regular
from softhand.numerics.arrays import Array
from softhand.numerics.branches import usually
from softhand.numerics.compiled import compiled
from softhand.numerics.linear import least_norm
from softhand.sensing.bound import Bound
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain


class Regulation(Controller):
    """The paper's controller: a spring for the pose, feedback of the internal force, torsion compensated.

        [Nakashima] Eq. (59):
        tau = J_CF^fT { (J_O^fT)^+ [N_O - K_O (q_O - q_Od) - J_O^tauT tau_C] + K [f_N - K_N (f_N - f_Nd)] }
              - K_v q_F' + N_F + J_CF^tauT tau_C

    With `orientation_error = "euler"` that is the law as it stands. By default q_O - q_Od is the position and the
    rotation vector from the desired orientation, in axes of the object, and J_O, N_O go with them: the same at every
    attitude, and near the paper's while roll and pitch are small. Without compensation both terms of tau_C are dropped.
    A gain is a number or a list of its diagonal.

    A hand with more joints than its contact forces need can move without moving a contact point: J_CF^f q_F' = 0. (59)
    only damps that motion. With K_posture, ours, it is drawn to the joint angles of the start, by

        [1 - (J_CF^f)^+ J_CF^f] K_posture (q_F(0) - q_F)

    which no contact force needs to balance. Where J_CF^f has full column rank, as with three joints a finger, the term
    is zero.
    """

    orientation_error: OrientationError = "rotation-vector"
    """`rotation-vector`, the same at every attitude; or `euler`, q_O - q_Od of roll, pitch, yaw as the paper has it."""
    torsion_compensation: bool = True
    """Whether the measured torsion moments are compensated."""
    K_O_position: Gain = 100.0
    """Stiffness of the position [N/m], one number or three."""
    K_O_orientation: Gain = 0.3
    """Stiffness of the orientation [N m/rad], one number, or three: about axes of the object, or roll, pitch, yaw."""
    K_v: Gain = 0.005
    """Damping of the joints [N m s/rad], one number or one a joint."""
    K_N: Gain = 1.5
    """Gain of the internal force [1], one number or one a pair of contacts."""
    K_posture: Gain = 0.0
    """Stiffness of idle joint motions towards the angles of the start [N m/rad], one number or one a joint."""

    def start(self, observation: Observation) -> Any:
        """The compiled law with its gains and the posture of the start."""
        return self.compiled(observation)

    def compiled(self, observation: Observation) -> Bound:
        """Eq. (59)."""
        n, pairs = observation.joint_position.shape[0], observation.internal_force.shape[0]
        gains = Gains(
            pose_diagonal("K_O", self.K_O_position, self.K_O_orientation),
            diagonal("K_v", self.K_v, n),
            diagonal("K_N", self.K_N, pairs),
            diagonal("K_posture", self.K_posture, n),
            observation.joint_position.copy(),
            observation.is_continuous,
            error=np.zeros(6),
            pull=np.zeros(6),
            wrench=np.zeros(6),
            wanted=np.zeros((3, 3)),
            f_C=np.zeros(observation.hand_force_jacobian.shape[0]),
        )
        is_euler = self.orientation_error == "euler"
        names = _COORDINATES if is_euler else _TWIST
        has_posture = bool(gains.K_posture.any())
        return Bound(n, regulation, Reads, gains, is_euler, self.torsion_compensation, has_posture, **names)

    def torque(self, observation: Observation, memory: Any) -> tuple[Torque, Any]:
        """Eq. (59), compiled."""
        tau = memory(observation)
        if tau[0] != tau[0]:
            pitches = observation.object_rpy[1], observation.object_rpy_desired[1]
            require_regular("Regulation", observation.time, *pitches)
        return tau, memory


class Reads(NamedTuple):
    """What (59) reads of an observation."""

    joint_position: Array
    joint_velocity: Array
    gravity_torque: Array
    object_coordinates: Array
    object_coordinates_desired: Array
    object_rotation: Array
    weight: Array
    carried_desired: Array
    contact_force: Array
    internal_force: Array
    internal_force_desired: Array
    internal_force_basis: Array
    hand_force_jacobian: Array
    hand_torsion_jacobian: Array
    force_rows: Array
    torsion_rows: Array


_COORDINATES = {"weight": "N_O", "force_rows": "J_O_f", "torsion_rows": "J_O_tau"}
_TWIST = {"weight": "object_gravity", "force_rows": "object_force_jacobian", "torsion_rows": "object_torsion_jacobian"}
"""What `Reads` has by coordinates of the object or by its twist."""


class Gains(NamedTuple):
    """The settings of `Regulation` as diagonals, and room to work in."""

    K_O: Array
    """[N/m, N m/rad], shape (6,)."""
    K_v: Array
    """[N m s/rad], shape (n,)."""
    K_N: Array
    """Shape (np,)."""
    K_posture: Array
    """[N m/rad], shape (n,)."""
    posture: Array
    """q_F(0) [rad], shape (n,)."""
    is_continuous: NDArray[np.bool_]
    """Which joints turn without end, shape (n,)."""
    error: Array
    """Room, as the following."""
    pull: Array
    wrench: Array
    wanted: Array
    f_C: Array


@compiled
def regulation(observed, gains, is_euler, compensate, has_posture, tau):
    """tau of (59), shape (n,), from the fields of an observation; N_O by the share that the fingers shall carry."""
    n, pairs, nc = tau.shape[0], observed.internal_force.shape[0], observed.contact_force.shape[0]
    pull, wrench, f_C = gains.pull, gains.wrench, gains.f_C
    # N_O - K_O e - J_O^tauT tau_C, e the pose error; by the coordinates q_O or, in world axes, by the twist
    _pull(observed, gains, is_euler)
    carried = observed.carried_desired[0]
    for k in range(6):
        wrench[k] = carried * observed.weight[k] - pull[k]
        if compensate:
            for i in range(nc):
                wrench[k] -= observed.torsion_rows[i, k] * observed.contact_force[i, 3]
    # f_C = (J_O^fT)^+ wrench + K [f_N - K_N (f_N - f_Nd)]
    least_norm(observed.force_rows, True, wrench, f_C)
    f_N, f_Nd = observed.internal_force, observed.internal_force_desired
    for k in range(pairs):
        internal = f_N[k] - gains.K_N[k] * (f_N[k] - f_Nd[k])
        for row in range(3 * nc):
            f_C[row] += observed.internal_force_basis[row, k] * internal
    # tau = J_CF^fT f_C - K_v q_F' + N_F + J_CF^tauT tau_C
    for j in range(n):
        tau[j] = observed.gravity_torque[j] - gains.K_v[j] * observed.joint_velocity[j]
    for row in range(3 * nc):
        for j in range(n):
            tau[j] += observed.hand_force_jacobian[row, j] * f_C[row]
    if compensate:
        for i in range(nc):
            for j in range(n):
                tau[j] += observed.hand_torsion_jacobian[i, j] * observed.contact_force[i, 3]
    if has_posture:
        _add_posture(observed.hand_force_jacobian, gains, observed.joint_position, tau)


@compiled
def _pull(observed, gains, is_euler):
    """gains.pull = K_O e as a generalized force of q_O, or as a wrench in world axes, shape (6,)."""
    error, pull, R = gains.error, gains.pull, observed.object_rotation
    if is_euler:
        euler_error(observed.object_coordinates, observed.object_coordinates_desired, error)
        pitch, wanted = observed.object_coordinates[4], observed.object_coordinates_desired[4]
        if not usually(is_regular(pitch) & is_regular(wanted)):
            error[:] = math.nan
    else:
        pose_error(observed.object_coordinates, R, observed.object_coordinates_desired, gains.wanted, error)
    for k in range(6):
        error[k] *= gains.K_O[k]
        pull[k] = error[k]
    if not is_euler:
        for k in range(3):
            pull[3 + k] = R[k, 0] * error[3] + R[k, 1] * error[4] + R[k, 2] * error[5]


@compiled
def _add_posture(J, gains, q_F, tau):
    """tau += [1 - J^+ J] K_posture (q_F(0) - q_F)."""
    n, rows = tau.shape[0], J.shape[0]
    pull, carried = np.empty(n), np.empty(rows)
    for j in range(n):
        turned = gains.posture[j] - q_F[j]
        if gains.is_continuous[j]:
            turned -= 2.0 * math.pi * round(turned / (2.0 * math.pi))
        pull[j] = gains.K_posture[j] * turned
        tau[j] += pull[j]
    least_norm(J, True, pull, carried)
    for row in range(rows):
        for j in range(n):
            tau[j] -= J[row, j] * carried[row]
