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

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.instruments import read_actuation
from softhand.assembly.parts import read_controller
from softhand.assembly.probe import Probe, check_states, recorded_scenario, recorded_state
from softhand.assembly.unmodelled import must_model, must_slip_as_a_whole
from softhand.closed_loop.gains import Gains, read_gains
from softhand.closed_loop.invariant_set import InvariantSeries, examine
from softhand.closed_loop.storage import Storage, evaluate
from softhand.errors import RecordingError
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.recording.recording import Recording

_ROUNDING = 1e-9  # of the largest V
_MOST = 5000  # samples; two milliseconds each
_LONGEST = 3  # stretches that are named

TERMS = {
    "desired": "the motion of f_d",
    "contact": "phi and dpsi in P",
    "damping": "the damping of the tips",
    "reference": "the motion of the reference",
    "actuation": "held, limited or uncompensated torques",
}
"""What the proof leaves out: names of arrays of `Lyapunov`, in words."""


@dataclass(frozen=True, eq=False)
class Lyapunov(Record):
    """V along a run; all arrays of shape (samples,).

    Attributes:
        recorded: samples of the run, of which at most 5000 are taken.
        time: of those that are taken [s].
        kinetic, spring, deformation: parts of V [J].
        rate: V' by central differences [W].
        dissipation: - q_F'^T K_v q_F', what (70) says V' is [W].
        desired: - f_d'^T (delta - delta_d), by differences of f_d [W].
        contact: rate of P by the change of phi and dpsi [W].
        damping: - (J_delta^T C_F - dF)^T delta' [W].
        reference: - q_Od'^T K_O e, e the pose error, q_O - q_Od in the paper [W].
        actuation: q_F'^T (applied torque - (59)), mean of the torques before and after a sample [W].
        invariant: L of (60) along the run.
    """

    units: ClassVar = {
        "recorded": "1", "time": "s", "kinetic": "J", "spring": "J", "deformation": "J", "value": "J", "rate": "W",
        "dissipation": "W", "desired": "W", "contact": "W", "damping": "W", "reference": "W", "actuation": "W",
        "remainder": "W",
    }  # fmt: skip

    recorded: int
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
    invariant: InvariantSeries

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
        if len(self.time) < self.recorded:
            rows.append(("samples", f"{len(self.time)} of {self.recorded}, at equal distances"))
        rows.append(("smallest singular value of L", f"{self.invariant.smallest.min():.4g} (SI)"))
        rows.append(("largest share of the contact stiffness", f"{self.invariant.use.max():.3g}  (L is singular at 1)"))
        return rows

    def notes(self) -> list[str]:
        """Where V rises most, a sentence each, and that by (70) it never does; nothing if it does not."""
        spans = sorted(self.spans(), key=lambda span: -span[2])
        notes = [
            f"V rises by {1e3 * gain:.3g} mJ from t = {begin:.4g} s to {end:.4g} s, most by {self.cause(begin, end)}."
            for begin, end, gain in spans[:_LONGEST]
        ]
        if len(spans) > _LONGEST:
            notes.append(f"And in {len(spans) - _LONGEST} shorter or smaller stretches.")
        return [*notes, "By (70) it never rises; see docs/stability.md."] if notes else []

    def _integral(self, power: Array) -> str:
        known = np.isfinite(power)
        return f"{1e3 * np.trapezoid(np.where(known, power, 0.0), self.time):+.4g} mJ"


def lyapunov(recording: Recording, every: int = 20, progress: Callable[[float], None] | None = None) -> Lyapunov:
    """V of Theorem 1 and its rate along a run, and L of (60).

    Of a long run every second, third, ... sample is taken, so that there are at most 5000.

    Args:
        recording: of a run with the controller `regulation`, at least three samples.
        every: samples taken between two at which L is examined.
        progress: called now and then with the number of samples done.

    Raises:
        RecordingError: another controller, too short, or the plant cannot be built anew.
        LawError: the law is not in the paper's coordinates, or a tip relaxes.
        ModelError: a tip touches a curved surface, for which L is not written.
    """
    if len(recording) < 3:
        raise RecordingError("The recording is too short: V needs at least three samples.", file=None)
    recorded = len(recording)
    stride = -(-recorded // _MOST)
    if stride > 1:
        recording = replace(recording, variables={name: array[::stride] for name, array in recording.variables.items()})
    scenario = recorded_scenario(recording)
    probe = Probe.of_scenario(scenario)
    probe.require_polar()
    world = probe.plant.world
    drives = read_actuation(scenario, world, read_controller(scenario))
    must_model("The proof of Theorem 1", world.mechanics, drives, ("damping", "friction", "stop_stiffness"))
    must_slip_as_a_whole("The proof of Theorem 1", probe.plant.fingertips)
    check_states(probe.plant, recording, "joint_torque", "internal_force")
    gains = read_gains(scenario, probe.plant.world.n_joints, recording.internal_force.shape[1])
    parts: list[Storage] = []
    torques, examined = np.empty_like(recording.joint_torque), []
    memory: Any = None
    for k, time in enumerate(recording.time):
        observation = probe.at(recorded_state(probe.plant, recording, k), float(time))
        memory = gains.law.start(observation) if k == 0 else memory
        torques[k], memory = gains.law.torque(observation, memory)
        parts.append(evaluate(probe, observation, gains))
        if k % every == 0:
            examined.append(examine(probe, observation, gains.spring(observation)))
        if progress is not None and k % 20 == 0:
            progress(float(k * stride))
    smallest, use = (np.array([getattr(one, name) for one in examined]) for name in ("smallest", "use"))
    return _along(recording, recorded, gains, parts, torques, InvariantSeries(recording.time[::every], smallest, use))


def _along(
    recording: Recording, recorded: int, gains: Gains, parts: list[Storage], torques: Array, invariant: InvariantSeries
) -> Lyapunov:
    time = recording.time
    f_d = np.array([part.desired_force for part in parts])
    gap = recording.deformation[:, :, :3] - np.array([part.desired_deformation for part in parts])
    applied = recording.joint_torque.copy()
    applied[1:-1] = 0.5 * (applied[1:-1] + applied[:-2])  # central differences reach over both
    excess = applied - torques
    excess[-1] = 0.0
    return Lyapunov(
        recorded=recorded,
        time=time,
        kinetic=np.array([part.kinetic_hand + part.kinetic_object for part in parts]),
        spring=np.array([part.spring for part in parts]),
        deformation=np.array([part.deformation for part in parts]),
        rate=np.gradient(np.array([part.value for part in parts]), time),
        dissipation=np.array([part.dissipation for part in parts]),
        desired=-np.einsum("kir,kir->k", np.gradient(f_d, time, axis=0), gap),
        contact=np.array([part.contact_rate for part in parts]),
        damping=np.array([part.damping for part in parts]),
        reference=np.array([part.reference for part in parts]),
        actuation=np.einsum("kr,kr->k", recording.joint_velocity, excess),
        invariant=invariant,
    )
