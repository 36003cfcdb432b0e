"""The function V of Theorem 1 along a run, its rate, and what the proof leaves out.

The proof of [Nakashima] Theorem 1 concludes V' = - q_F'^T K_v q_F' (70). Its (67) takes the desired deformation forces
f_d of (63) and the contact angles as constant while it differentiates P. With those terms, and with a reference that
moves, tips that are damped, and torques that are held, limited or not compensated,

    V' = - q_F'^T K_v q_F'                       dissipation, (70)
         - f_d'^T (delta - delta_d)              f_d moves with q_O, f_N, tau_C and the contact angles
         + d/d(phi, dpsi) of P times their rate  the deformation force depends on phi, and Fpsi on dr
         - (J_delta^T C_F - dF)^T delta'         the tips are damped: C_F is more than the law's dF
         - q_Od'^T K_O (q_O - q_Od)              the reference moves
         + q_F'^T (applied torque - (59))        the torque is held, limited, or lacks the compensation
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.probe import Probe, recorded_scenario, recorded_state
from softhand.contact.kinematics import deformation_jacobian
from softhand.errors import RecordingError
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.recording.recording import Recording
from softhand.sensing.observation import Observation
from softhand.stability.regulation import Gains, read_gains, regulation

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_NODES, _WEIGHTS = 0.5 + 0.5 * _NODES, 0.5 * _WEIGHTS
_STEP = 1e-6  # of differences, times the radius for dr
_SOLVED = 1e-11  # of the force
_ROUNDING = 1e-9  # of the largest V

TERMS = {
    "desired": "the motion of f_d",
    "contact": "phi and dpsi in P",
    "damping": "the damping of the tips",
    "reference": "the motion of the reference",
    "actuation": "held, limited or uncompensated torques",
}
"""What the proof leaves out: names of arrays of `Lyapunov`, in words."""


@dataclass(frozen=True)
class Storage:
    """V of (61) at one state and what its rate is made of.

    Attributes:
        kinetic_hand: q_F'^T M_F q_F' / 2 [J].
        kinetic_object: q_O'^T M_O q_O' / 2 [J].
        spring: (q_O - q_Od)^T K_O (q_O - q_Od) / 2 [J].
        deformation: P of (62) [J]; NaN where no deformation answers to f_d, for instance where it pulls.
        desired_force: f_d of (63), Fr [N], Ftheta, Fphi [N m], shape (nc, 3).
        desired_deformation: delta_d, dr [m], dtheta, dphi [rad], shape (nc, 3).
        dissipation: - q_F'^T K_v q_F' [W].
        contact_rate: rate of P by the change of phi and dpsi [W].
        damping: - (J_delta^T C_F - dF)^T delta', rows of dr, dtheta, dphi: (59) makes up for the torsion [W].
        torque: (59) with compensation [N m], shape (n,).
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
    torque: Array

    @property
    def value(self) -> float:
        """V [J]."""
        return self.kinetic_hand + self.kinetic_object + self.spring + self.deformation


@dataclass(frozen=True, eq=False)
class Lyapunov:
    """V along a run; all arrays of shape (samples,).

    Attributes:
        time: [s].
        kinetic, spring, deformation: parts of V [J].
        rate: V' by central differences [W].
        dissipation: - q_F'^T K_v q_F', what (70) says V' is [W].
        desired: - f_d'^T (delta - delta_d), by differences of f_d [W].
        contact: rate of P by the change of phi and dpsi [W].
        damping: - (J_delta^T C_F - dF)^T delta' [W].
        reference: - q_Od'^T K_O (q_O - q_Od) [W].
        actuation: q_F'^T (applied torque - (59)), mean of the torques before and after a sample [W].
    """

    time: Array
    kinetic: Array
    spring: Array
    deformation: Array
    rate: Array
    dissipation: Array
    desired: Array
    contact: Array
    damping: Array
    reference: Array
    actuation: Array

    @property
    def value(self) -> Array:
        """V [J]; NaN where it is not defined."""
        return self.kinetic + self.spring + self.deformation

    @property
    def remainder(self) -> Array:
        """What the terms do not explain: the error of the differences [W]."""
        return self.rate - self.dissipation - sum(getattr(self, name) for name in TERMS)

    @property
    def rises(self) -> NDArray[np.bool_]:
        """Whether V rises from each sample to the next, by more than rounding, shape (samples - 1,)."""
        V = self.value
        return np.nan_to_num(np.diff(V)) > _ROUNDING * np.nanmax(np.abs(V), initial=0.0)

    def spans(self) -> list[tuple[float, float, float]]:
        """Begin [s], end [s] and gain of V [J] of each stretch in which V rises."""
        edges = np.flatnonzero(np.diff(np.concatenate([[0], self.rises.astype(np.int8), [0]])))
        return [
            (float(self.time[begin]), float(self.time[end]), float(self.value[end] - self.value[begin]))
            for begin, end in zip(edges[::2], edges[1::2], strict=True)
        ]

    def cause(self, begin: float, end: float) -> str:
        """The term that raises V most from one time to another [s]."""
        within = (self.time >= begin) & (self.time <= end)
        gains = {label: np.trapezoid(np.nan_to_num(getattr(self, name)[within]), self.time[within])
                 for name, label in TERMS.items()}  # fmt: skip
        return max(gains, key=lambda label: gains[label])

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of each line of the table."""
        known = np.isfinite(self.value)
        V = self.value[known]
        rows = [
            ("V at the start, at the end", f"{1e3 * V[0]:.4g}, {1e3 * V[-1]:.4g} mJ"),
            ("change by dissipation, (70)", self._integral(self.dissipation)),
            *((f"by {label}", self._integral(getattr(self, name))) for name, label in TERMS.items()),
            ("error of the differences", self._integral(self.remainder)),
            ("V rises during", f"{100.0 * np.mean(self.rises):.3g} % of the run"),
        ]
        if not known.all():
            rows.append(("V is not defined during", f"{100.0 * np.mean(~known):.3g} % of the run (f_d pulls)"))
        return rows

    def _integral(self, power: Array) -> str:
        known = np.isfinite(power)
        return f"{1e3 * np.trapezoid(np.where(known, power, 0.0), self.time):+.4g} mJ"


def evaluate_run(recording: Recording, progress: Callable[[float], None] | None = None) -> Lyapunov:
    """V and its rate along a run.

    Args:
        recording: of a run with the controller `regulation`, at least three samples.
        progress: called now and then with the number of samples done.

    Raises:
        RecordingError: another controller, too short, or the plant cannot be built anew.
        LawError: the law is not in the paper's coordinates.
    """
    if len(recording) < 3:
        raise RecordingError("The recording is too short: V needs at least three samples.", file=None)
    scenario = recorded_scenario(recording)
    probe = Probe.of_scenario(scenario)
    probe.require_polar()
    world = probe.plant.world
    gains = read_gains(scenario, world.n_joints, recording.internal_force.shape[1])
    parts: list[Storage] = []
    for k, time in enumerate(recording.time):
        parts.append(evaluate(probe, probe.at(recorded_state(probe.plant, recording, k), float(time)), gains))
        if progress is not None and k % 20 == 0:
            progress(float(k))
    return _along(recording, gains, parts)


def _along(recording: Recording, gains: Gains, parts: list[Storage]) -> Lyapunov:
    time = recording.time
    q_O = np.concatenate([recording.object_position, recording.object_rpy], axis=1)
    q_Od = np.concatenate([recording.object_position_desired, recording.object_rpy_desired], axis=1)
    f_d = np.array([part.desired_force for part in parts])
    gap = recording.deformation[:, :, :3] - np.array([part.desired_deformation for part in parts])
    applied = recording.joint_torque.copy()
    applied[1:-1] = 0.5 * (applied[1:-1] + applied[:-2])  # central differences reach over both
    excess = applied - np.array([part.torque for part in parts])
    excess[-1] = 0.0
    return Lyapunov(
        time=time,
        kinetic=np.array([part.kinetic_hand + part.kinetic_object for part in parts]),
        spring=np.array([part.spring for part in parts]),
        deformation=np.array([part.deformation for part in parts]),
        rate=np.gradient(np.array([part.value for part in parts]), time),
        dissipation=np.array([part.dissipation for part in parts]),
        desired=-np.einsum("kir,kir->k", np.gradient(f_d, time, axis=0), gap),
        contact=np.array([part.contact_rate for part in parts]),
        damping=np.array([part.damping for part in parts]),
        reference=-np.einsum("kr,r,kr->k", np.gradient(q_Od, time, axis=0), gains.K_O, q_O - q_Od),
        actuation=np.einsum("kr,kr->k", recording.joint_velocity, excess),
    )


def evaluate(probe: Probe, seen: Observation, gains: Gains) -> Storage:
    """V at the state that was last given to a probe.

    By (64) the torsion part of P is always zero: delta_d of the torsion is the torsion itself, as
    tau_C = Fpsi. The rest is integrated along the straight line from delta_d to delta with phi and dpsi held; for a law
    whose parts do not depend on each other then, such as the paper's, the way does not matter.

    Args:
        probe: at the state.
        seen: what it returned.
        gains: of (59).
    """
    q_F, error = seen.joint_velocity, seen.q_O - seen.desired.coordinates
    twist = np.linalg.solve(seen.T_O, seen.object_twist)
    f, torque = regulation(seen, gains)
    J_delta = _deformation_jacobians(seen, [law.radius for law in probe.laws])
    # f_d = J_delta^fT f + J_delta^tauT tau_C of (63)
    f_d = np.einsum("iab,ia->ib", J_delta, np.column_stack([f.reshape(-1, 3), seen.tau_C]))[:, :3]
    damped = np.einsum("iab,ia->ib", J_delta, seen.contact_force) - probe.plant.tip_contacts["deformation_force"]
    delta_d = np.empty_like(f_d)
    deformation, contact_rate = 0.0, 0.0
    for i, law in enumerate(probe.laws):
        delta, phi, dpsi = seen.deformation[i, :3], seen.eta[i, 1], seen.deformation[i, 3]
        delta_d[i] = _solve_deformation(law, f_d[i], delta, dpsi, phi)
        deformation += _work(law, delta_d[i], delta, dpsi, phi) - f_d[i] @ (delta - delta_d[i])
        by_phi = _work(law, delta_d[i], delta, dpsi, phi + _STEP) - _work(law, delta_d[i], delta, dpsi, phi - _STEP)
        by_dpsi = _work(law, delta_d[i], delta, dpsi + _STEP, phi) - _work(law, delta_d[i], delta, dpsi - _STEP, phi)
        contact_rate += (by_phi * seen.eta_rate[i, 1] + by_dpsi * seen.deformation_rate[i, 3]) / (2.0 * _STEP)
    return Storage(
        kinetic_hand=0.5 * float(q_F @ seen.M_F @ q_F),
        kinetic_object=0.5 * float(twist @ seen.M_O @ twist),
        spring=0.5 * float(gains.K_O @ error**2),
        deformation=deformation,
        desired_force=f_d,
        desired_deformation=delta_d,
        dissipation=-float(gains.K_v @ q_F**2),
        contact_rate=contact_rate,
        damping=-float(np.sum(damped[:, :3] * seen.deformation_rate[:, :3])),
        torque=torque,
    )


def _deformation_jacobians(seen: Observation, radii: list[float]) -> Array:
    """J_delta of each contact, (37), shape (nc, 4, 4)."""
    J_delta = np.empty((len(radii), 4, 4))
    for i, radius in enumerate(radii):
        Phi = seen.contact_angles[i, 1]
        deformation_jacobian(radius - seen.deformation[i, 0], math.sin(Phi), math.cos(Phi), J_delta[i])
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
