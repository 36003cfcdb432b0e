"""The function V of Theorem 1 at one state, and what its rate is made of."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from softhand.assembly.probe import Probe
from softhand.closed_loop.gains import Gains
from softhand.contact.kinematics import deformation_jacobian
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.sensing.observation import Observation

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_NODES, _WEIGHTS = 0.5 + 0.5 * _NODES, 0.5 * _WEIGHTS
_STEP = 1e-6  # of differences, times the radius for dr
_SOLVED = 1e-11  # of the force


@dataclass(frozen=True)
class Storage:
    """V of (61) at one state and what its rate is made of.

    Attributes:
        kinetic_hand: q_F'^T M_F q_F' / 2 [J].
        kinetic_object: q_O'^T M_O q_O' / 2 [J].
        spring: e^T K_O e / 2 [J], e the pose error of the law, q_O - q_Od in the paper.
        deformation: P of (62) [J]; NaN where no deformation answers to f_d, for instance where it pulls.
        desired_force: f_d of (63), Fr [N], Ftheta, Fphi [N m], shape (nc, 3).
        desired_deformation: delta_d, dr [m], dtheta, dphi [rad], shape (nc, 3).
        dissipation: - q_F'^T K_v q_F' [W].
        contact_rate: rate of P by the change of phi and dpsi [W].
        damping: - (J_delta^T C_F - dF)^T delta', rows of dr, dtheta, dphi: (59) makes up for the torsion [W].
        reference: rate of the spring's energy by the motion of what is desired, - q_Od'^T K_O e in the paper [W].
    """

    kinetic_hand: float
    kinetic_object: float
    spring: float
    deformation: float
    desired_force: Array
    desired_deformation: Array
    dissipation: float
    contact_rate: float
    damping: float
    reference: float

    @property
    def value(self) -> float:
        """V [J]."""
        return self.kinetic_hand + self.kinetic_object + self.spring + self.deformation


def evaluate(probe: Probe, observation: Observation, gains: Gains) -> Storage:
    """V at the state that was last given to a probe.

    By (64) the torsion part of P is always zero: delta_d of the torsion is the torsion itself, as
    tau_C = Fpsi. The rest is integrated along the straight line from delta_d to delta with phi and dpsi held; for a law
    whose parts do not depend on each other then, such as the paper's, the way does not matter.

    Args:
        probe: at the state.
        observation: what it returned.
        gains: of (59).
    """
    q_F, twist, task = observation.joint_velocity, observation.object_twist, gains.task(observation)
    f = gains.asked_forces(observation)
    J_delta = _deformation_jacobians(observation, [law.radius for law in probe.laws])
    # f_d = J_delta^fT f + J_delta^tauT tau_C of (63)
    f_d = np.einsum("iab,ia->ib", J_delta, np.column_stack([f.reshape(-1, 3), observation.tau_C]))[:, :3]
    damped = np.einsum("iab,ia->ib", J_delta, observation.contact_force)
    damped -= probe.plant.tip_contacts["deformation_force"]
    delta_d = np.empty_like(f_d)
    deformation, contact_rate = 0.0, 0.0
    for i, law in enumerate(probe.laws):
        delta, phi, dpsi = observation.deformation[i, :3], observation.eta[i, 1], observation.deformation[i, 3]
        delta_d[i] = _solve_deformation(law, f_d[i], delta, dpsi, phi)
        deformation += _work(law, delta_d[i], delta, dpsi, phi) - f_d[i] @ (delta - delta_d[i])
        by_phi = _work(law, delta_d[i], delta, dpsi, phi + _STEP) - _work(law, delta_d[i], delta, dpsi, phi - _STEP)
        by_dpsi = _work(law, delta_d[i], delta, dpsi + _STEP, phi) - _work(law, delta_d[i], delta, dpsi - _STEP, phi)
        rates = observation.eta_rate[i, 1], observation.deformation_rate[i, 3]
        contact_rate += (by_phi * rates[0] + by_dpsi * rates[1]) / (2.0 * _STEP)
    return Storage(
        kinetic_hand=0.5 * float(q_F @ observation.M_F @ q_F),
        kinetic_object=0.5 * float(twist @ observation.object_mass_matrix @ twist),
        spring=0.5 * float(gains.K_O @ task.error**2),
        deformation=deformation,
        desired_force=f_d,
        desired_deformation=delta_d,
        dissipation=-float(gains.K_v @ q_F**2),
        contact_rate=contact_rate,
        reference=-float((gains.K_O * task.error) @ (np.linalg.solve(task.map, twist) - task.rate)),
        damping=-float(np.sum(damped[:, :3] * observation.deformation_rate[:, :3])),
    )


def _deformation_jacobians(observation: Observation, radii: list[float]) -> Array:
    """J_delta of each contact, (37), shape (nc, 4, 4)."""
    J_delta = np.empty((len(radii), 4, 4))
    for i, radius in enumerate(radii):
        Phi = observation.contact_angles[i, 1]
        deformation_jacobian(radius - observation.deformation[i, 0], math.sin(Phi), math.cos(Phi), J_delta[i])
    return J_delta


def _force(law: Law, delta: Array, dpsi: float, phi: float, parameters: list[float]) -> Array:
    dr, dtheta, dphi = delta.tolist()
    return np.array(law.force(dr, dtheta, dphi, dpsi, phi, *parameters)[:3])


def _work(law: Law, start: Array, end: Array, dpsi: float, phi: float) -> float:
    """Integral of (Fr, Ftheta, Fphi) along the straight line, phi and dpsi held [J]."""
    parameters, way = law.parameters().tolist(), end - start
    return float(sum(w * (_force(law, start + s * way, dpsi, phi, parameters) @ way)
                     for s, w in zip(_NODES, _WEIGHTS, strict=True)))  # fmt: skip


def _solve_deformation(law: Law, wanted: Array, start: Array, dpsi: float, phi: float) -> Array:
    """(dr, dtheta, dphi) that the law answers with a force, phi and dpsi held; NaN if there is none, shape (3,)."""
    parameters = law.parameters().tolist()
    lengths = np.array([law.radius, 1.0, 1.0])
    size = float(np.linalg.norm(wanted * [law.radius, 1.0, 1.0])) or 1.0
    delta = np.array([max(start[0], 1e-3 * law.radius), *start[1:]])
    for _ in range(60):
        excess = _force(law, delta, dpsi, phi, parameters) - wanted
        if np.linalg.norm(excess * lengths) <= _SOLVED * size:
            return delta
        slope = np.column_stack([
            (_force(law, delta + move, dpsi, phi, parameters) - _force(law, delta - move, dpsi, phi, parameters))
            / (2.0 * _STEP) for move in np.diag(_STEP * lengths)
        ])  # fmt: skip
        try:
            step = lengths * np.linalg.solve(slope, excess)
        except np.linalg.LinAlgError:
            break
        delta = delta - step
        delta[0] = max(delta[0], 1e-9 * law.radius)
    return np.full(3, math.nan)
