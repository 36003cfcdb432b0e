"""The controller of the paper: regulates the object's pose and the internal force."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.compiled import compiled, prepared
from softhand.controllers.controller import Controller, Torque
from softhand.errors import ScenarioError
from softhand.linear import least_norm
from softhand.observation import (
    INTERNAL_FORCE,
    J_CF_F,
    J_CF_TAU,
    J_O_F,
    J_O_TAU,
    JOINT_VELOCITY,
    N_F,
    N_O,
    Q_O,
    K,
    Observation,
    part,
    table,
)
from softhand.settings import Gain


class Regulation(Controller):
    """The paper's controller: a spring for the pose, feedback of the internal force, torsion compensated.

        [Nakashima] Eq. (59):
        tau = J_CF^fT { (J_O^fT)^+ [N_O - K_O (q_O - q_Od) - J_O^tauT tau_C] + K [f_N - K_N (f_N - f_Nd)] }
              - K_v q_F' + N_F + J_CF^tauT tau_C

    Without compensation both terms of tau_C are dropped. A gain is a number or a list of its diagonal.

    Attributes:
        torsion_compensation: whether the measured torsion moments are compensated.
        K_O_position: stiffness of the position [N/m], one number or three.
        K_O_orientation: stiffness of roll, pitch, yaw [N m/rad], one number or three.
        K_v: joint damping [N m s/rad], one number or n.
        K_N: gain of the internal force, one number or one a pair of contacts.
    """

    torsion_compensation: bool = True
    K_O_position: Gain = 100.0
    K_O_orientation: Gain = 0.3
    K_v: Gain = 0.005
    K_N: Gain = 1.5

    def start(self, observation: Observation) -> Any:
        """The compiled law with its gains, and room for the torque."""
        n, pairs = observation.joint_position.shape[0], observation.internal_force.shape[0]
        gains = [
            _diagonal("K_O_position", self.K_O_position, 3),
            _diagonal("K_O_orientation", self.K_O_orientation, 3),
            _diagonal("K_v", self.K_v, n),
            _diagonal("K_N", self.K_N, pairs),
        ]
        tau, desired = np.zeros(n), observation.desired
        law = prepared(
            _regulation, observation.buffer, observation.offsets, observation.contact_force, desired.coordinates,
            desired.internal_force, np.concatenate(gains), self.torsion_compensation, tau,
        )  # fmt: skip
        return law, tau

    def torque(self, observation: Observation, memory: Any) -> tuple[Torque, Any]:
        """Eq. (59), compiled."""
        law, tau = memory
        law()
        return tau, memory


def _diagonal(key: str, gain: Any, size: int) -> np.ndarray:
    values = np.atleast_1d(np.asarray(gain, dtype=float))
    if values.size not in (1, size):
        raise ScenarioError(
            f"controller.{key} has {values.size} entries; give one number or {size}.", key=key, value=gain
        )
    return np.broadcast_to(values, (size,)).copy()


@compiled
def _regulation(buffer, offsets, contact_force, q_Od, f_Nd, gains, compensate, tau):
    n, pairs, nc = tau.shape[0], f_Nd.shape[0], contact_force.shape[0]
    K_O, K_v, K_N = gains[:6], gains[6 : 6 + n], gains[6 + n :]
    J_CF_f, J_CF_tau = table(buffer, offsets, J_CF_F, n), table(buffer, offsets, J_CF_TAU, n)
    J_O_f, J_O_tau = table(buffer, offsets, J_O_F, 6), table(buffer, offsets, J_O_TAU, 6)
    q_O, N, kernel = part(buffer, offsets, Q_O), part(buffer, offsets, N_O), table(buffer, offsets, K, pairs)
    f_N, gravity, qd_F = (part(buffer, offsets, INTERNAL_FORCE), part(buffer, offsets, N_F),
                          part(buffer, offsets, JOINT_VELOCITY))  # fmt: skip
    wrench, f_C = np.empty(6), np.empty(3 * nc)
    for k in range(6):
        wrench[k] = N[k] - K_O[k] * (q_O[k] - q_Od[k])
        if compensate:
            for i in range(nc):
                wrench[k] -= J_O_tau[i, k] * contact_force[i, 3]
    least_norm(J_O_f.T, wrench, f_C)
    for k in range(pairs):
        internal = f_N[k] - K_N[k] * (f_N[k] - f_Nd[k])
        for row in range(3 * nc):
            f_C[row] += kernel[row, k] * internal
    for j in range(n):
        tau[j] = gravity[j] - K_v[j] * qd_F[j]
    for row in range(3 * nc):
        for j in range(n):
            tau[j] += J_CF_f[row, j] * f_C[row]
    if compensate:
        for i in range(nc):
            for j in range(n):
                tau[j] += J_CF_tau[i, j] * contact_force[i, 3]
