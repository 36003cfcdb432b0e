"""The controller of the paper: regulates the object's pose and the internal force."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.controllers.blocks import (
    add_internal_forces,
    add_pose_spring,
    add_torsion,
    euler_error,
    feed_back_internal_forces,
    hold_joints,
    pose_error,
    push_contacts,
    share_wrench,
    take_off_torsion,
)
from softhand.controllers.controller import Controller
from softhand.controllers.formula import Law
from softhand.controllers.gains import diagonal, pose_diagonal
from softhand.controllers.pose import OrientationError, irregular
from softhand.controllers.tips import moved
from softhand.numerics.arrays import Array
from softhand.numerics.branches import usually
from softhand.numerics.compiled import compiled
from softhand.numerics.linear import least_norm
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
    """Damping of the joints [N m s/rad or N s/m], one number or one a joint."""
    K_N: Gain = 1.5
    """Gain of the internal force [1], one number or one a pair of contacts."""
    K_posture: Gain = 0.0
    """Stiffness of idle joint motions towards the angles of the start [N m/rad or N/m], one number or one a joint."""

    @property
    def formula(self) -> Any:  # type: ignore[override]
        """(59) in either form."""
        return regulation_by_angles if self.orientation_error == "euler" else regulation

    def constants(self, observation: Observation) -> Gains:
        """The gains."""
        n, pairs = observation.joint_position.shape[0], observation.internal_force.shape[0]
        return Gains(
            pose_diagonal("K_O", self.K_O_position, self.K_O_orientation),
            diagonal("K_v", self.K_v, n),
            diagonal("K_N", self.K_N, pairs),
            diagonal("K_posture", self.K_posture, n),
            self.torsion_compensation,
            observation.is_continuous.copy(),
            error=np.zeros(6),
            wrench=np.zeros(6),
            squeeze=np.zeros(pairs),
            f_C=np.zeros(observation.hand_force_jacobian.shape[0]),
        )

    def start(self, observation: Observation) -> Any:
        """q_F(0)."""
        return observation.joint_position.copy()

    def complaint(self, observation: Observation, law: Law) -> Exception | None:
        """Roll, pitch and yaw cannot be used."""
        if self.orientation_error != "euler":
            return None
        return irregular("Regulation", observation.time, observation.object_rpy[1], observation.object_rpy_desired[1])


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
    compensate: bool
    """Whether torsion is compensated."""
    is_continuous: NDArray[np.bool_]
    """Which joints turn without end, shape (n,)."""
    error: Array
    """Room, as the following."""
    wrench: Array
    squeeze: Array
    f_C: Array


@compiled
def regulation(observed, gains, posture, tau):
    """tau of (59), shape (n,), from the fields of an observation, with the pose error in axes of the object."""
    error, wrench = gains.error, gains.wrench
    pose_error(observed.object_coordinates, observed.object_rotation, observed.object_coordinates_desired, error)
    for k in range(6):
        wrench[k] = observed.carried_desired[0] * observed.object_gravity[k]
    add_pose_spring(gains.K_O, error, observed.object_rotation, wrench)
    _finish(observed, gains, observed.object_force_jacobian, observed.object_torsion_jacobian, posture, tau)


@compiled
def regulation_by_angles(observed, gains, posture, tau):
    """The same with q_O - q_Od of position, roll, pitch, yaw; NaN near pitch 90 deg."""
    error, wrench = gains.error, gains.wrench
    euler_error(observed.object_coordinates, observed.object_coordinates_desired, error)
    for k in range(6):
        wrench[k] = observed.carried_desired[0] * observed.N_O[k] - gains.K_O[k] * error[k]
    _finish(observed, gains, observed.J_O_f, observed.J_O_tau, posture, tau)


@compiled
def _finish(observed, gains, force_rows, torsion_rows, posture, tau):
    """From N_O - K_O e, in the wrench of the gains, to the torques."""
    torsion, f_C, squeeze = observed.contact_force[:, 3], gains.f_C, gains.squeeze
    hold_joints(observed.gravity_torque, gains.K_v, observed.joint_velocity, tau)
    if gains.compensate:
        take_off_torsion(torsion_rows, torsion, gains.wrench)
        add_torsion(observed.hand_torsion_jacobian, torsion, tau)
    share_wrench(force_rows, gains.wrench, f_C)
    feed_back_internal_forces(observed.internal_force, observed.internal_force_desired, gains.K_N, squeeze)
    add_internal_forces(observed.internal_force_basis, squeeze, f_C)
    push_contacts(observed.hand_force_jacobian, f_C, tau)
    for j in range(tau.shape[0]):
        if usually(gains.K_posture[j] > 0.0):
            _add_posture(observed.hand_force_jacobian, gains, posture, observed.joint_position, tau)
            break


@compiled
def _add_posture(J, gains, posture, q_F, tau):
    """tau += [1 - J^+ J] K_posture (q_F(0) - q_F)."""
    n, rows = tau.shape[0], J.shape[0]
    pull, carried = np.empty(n), np.empty(rows)
    for j in range(n):
        pull[j] = -gains.K_posture[j] * moved(q_F[j], posture[j], gains.is_continuous[j])
        tau[j] += pull[j]
    least_norm(J, True, pull, carried)
    for row in range(rows):
        for j in range(n):
            tau[j] -= J[row, j] * carried[row]
