"""The controller of the paper: regulates the object's pose and the internal force."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.controllers.controller import Controller, Torque
from softhand.controllers.gains import diagonal, pose_diagonal
from softhand.numerics.compiled import compiled
from softhand.numerics.linear import least_norm
from softhand.numerics.prepared import prepared
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain


class Regulation(Controller):
    """The paper's controller: a spring for the pose, feedback of the internal force, torsion compensated.

        [Nakashima] Eq. (59):
        tau = J_CF^fT { (J_O^fT)^+ [N_O - K_O (q_O - q_Od) - J_O^tauT tau_C] + K [f_N - K_N (f_N - f_Nd)] }
              - K_v q_F' + N_F + J_CF^tauT tau_C

    Without compensation both terms of tau_C are dropped. A gain is a number or a list of its diagonal.

    A hand with more joints than its contact forces need can move without moving a contact point: J_CF^f q_F' = 0. (59)
    only damps that motion. With K_posture, ours, it is drawn to the joint angles of the start, by

        [1 - (J_CF^f)^+ J_CF^f] K_posture (q_F(0) - q_F)

    which no contact force needs to balance. Where J_CF^f has full column rank, as with three joints a finger, the term
    is zero.

    Attributes:
        torsion_compensation: whether the measured torsion moments are compensated.
        K_O_position: stiffness of the position [N/m], one number or three.
        K_O_orientation: stiffness of roll, pitch, yaw [N m/rad], one number or three.
        K_v: joint damping [N m s/rad], one number or n.
        K_N: gain of the internal force, one number or one a pair of contacts.
        K_posture: stiffness of the posture in the null space of J_CF^f [N m/rad], one number or n.
    """

    torsion_compensation: bool = True
    K_O_position: Gain = 100.0
    K_O_orientation: Gain = 0.3
    K_v: Gain = 0.005
    K_N: Gain = 1.5
    K_posture: Gain = 0.0

    def start(self, observation: Observation) -> Any:
        """The compiled law with its gains, and room for the torque."""
        n, pairs = observation.joint_position.shape[0], observation.internal_force.shape[0]
        K_O = pose_diagonal("K_O", self.K_O_position, self.K_O_orientation)
        K_v, K_N = diagonal("K_v", self.K_v, n), diagonal("K_N", self.K_N, pairs)
        K_posture = diagonal("K_posture", self.K_posture, n)
        seen, desired, tau = observation, observation.desired, np.zeros(n)
        law = prepared(
            _regulation, seen.J_CF_f, seen.J_CF_tau, seen.J_O_f, seen.J_O_tau, seen.K, seen.contact_force,
            seen.internal_force, seen.q_O, desired.coordinates, desired.internal_force, seen.N_F, seen.N_O,
            seen.joint_velocity, K_O, K_v, K_N, self.torsion_compensation, seen.joint_position,
            seen.joint_position.copy(), K_posture, tau,
        )  # fmt: skip
        return law, tau

    def torque(self, observation: Observation, memory: Any) -> tuple[Torque, Any]:
        """Eq. (59), compiled."""
        law, tau = memory
        law()
        return tau, memory


@compiled
def _regulation(
    J_CF_f, J_CF_tau, J_O_f, J_O_tau, K, contact_force, f_N, q_O, q_Od, f_Nd, N_F, N_O, qd_F, K_O, K_v, K_N, compensate,
    q_F, start, K_posture, tau,
):  # fmt: skip
    n, pairs, nc = tau.shape[0], f_Nd.shape[0], contact_force.shape[0]
    wrench, f_C = np.empty(6), np.empty(3 * nc)
    for k in range(6):
        wrench[k] = N_O[k] - K_O[k] * (q_O[k] - q_Od[k])
        if compensate:
            for i in range(nc):
                wrench[k] -= J_O_tau[i, k] * contact_force[i, 3]
    least_norm(J_O_f, True, wrench, f_C)
    for k in range(pairs):
        internal = f_N[k] - K_N[k] * (f_N[k] - f_Nd[k])
        for row in range(3 * nc):
            f_C[row] += K[row, k] * internal
    for j in range(n):
        tau[j] = N_F[j] - K_v[j] * qd_F[j]
    for row in range(3 * nc):
        for j in range(n):
            tau[j] += J_CF_f[row, j] * f_C[row]
    if compensate:
        for i in range(nc):
            for j in range(n):
                tau[j] += J_CF_tau[i, j] * contact_force[i, 3]
    if np.any(K_posture > 0.0):
        _add_posture(J_CF_f, K_posture, start, q_F, tau)


@compiled
def _add_posture(J, K_posture, start, q_F, tau):
    """tau += [1 - J^+ J] K_posture (start - q_F)."""
    n, rows = tau.shape[0], J.shape[0]
    pull, carried = np.empty(n), np.empty(rows)
    for j in range(n):
        pull[j] = K_posture[j] * (start[j] - q_F[j])
        tau[j] += pull[j]
    least_norm(J, True, pull, carried)
    for row in range(rows):
        for j in range(n):
            tau[j] -= J[row, j] * carried[row]
