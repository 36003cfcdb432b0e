"""Where the work of the joints went: the energy ledger of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.analysis.joint_energy import joint_energy, rotor_energy
from softhand.assembly.plant import read_plant
from softhand.assembly.probe import check_states, recorded_scenario, recorded_state
from softhand.contact.elements import TRIAL
from softhand.contact.pads import Contact
from softhand.laws.law import Law
from softhand.laws.rolling import slope_of
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.recording.recording import Recording

_STEP = 1e-5  # of the lean
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)


@dataclass(frozen=True, eq=False)
class Ledger(Record):
    """Energy since the start of a run, at some of its samples; all arrays of shape (times,).

    Attributes:
        time: [s].
        work: of the joint torques [J].
        pushed: work of pushes from outside [J].
        kinetic: change of the kinetic energy [J].
        gravity: change of the potential energy of the weights [J].
        elastic: change of what the tips would give back, see `tip_energy` [J].
        damping: taken by the material of the tips, viscosity and relaxation [J].
        slip: work of friction at the tips [J].
        joint_damping: taken by the damping of the joints [J].
        joint_friction: taken by their dry friction [J].
        stops: change of what their stops hold [J].
        stop_damping: taken by these beside [J].
        is_spring: whether all laws are springs, see `is_spring`.
    """

    units: ClassVar = {
        "time": "s", "work": "J", "pushed": "J", "kinetic": "J", "gravity": "J", "elastic": "J", "damping": "J",
        "slip": "J", "joint_damping": "J", "joint_friction": "J", "stops": "J", "stop_damping": "J", "residual": "J",
        "lost": "J", "exchanged": "J",
    }  # fmt: skip

    time: Array
    work: Array
    pushed: Array
    kinetic: Array
    gravity: Array
    elastic: Array
    damping: Array
    slip: Array
    joint_damping: Array
    joint_friction: Array
    stops: Array
    stop_damping: Array
    is_spring: bool

    @property
    def taken(self) -> Array:
        """What drives and pushes gave and bodies and joints do not have: it is in the tips or lost there [J]."""
        given = self.work + self.pushed - self.kinetic - self.gravity
        return given - self.joint_damping - self.joint_friction - self.stops - self.stop_damping

    @property
    def lost(self) -> float:
        """What is left of all work at the end [J]: lost in the tips, by damping, slip or a law that is no spring.

        Negative if the tips gave more than was put in, which a law that is no spring can do.
        """
        return float(self.taken[-1] - self.elastic[-1])

    @property
    def residual(self) -> Array:
        """What no account explains [J]: the error of steps and samples, and the work of a law that is no spring."""
        return self.taken - self.elastic - self.damping - self.slip

    @property
    def exchanged(self) -> float:
        """The largest amount in any one account [J], to judge the residual by."""
        return max(float(np.max(np.abs(getattr(self, name)))) for name in self.accounts)

    @property
    def accounts(self) -> dict[str, str]:
        """`ACCOUNTS`, without pushes where nothing pushed, and without what the joints do not take."""
        return {name: label for name, label in ACCOUNTS.items() if name not in _RARE or np.any(getattr(self, name))}

    def rows(self) -> list[tuple[str, str]]:
        """Label and value at the end of each account."""
        rows = [(label, f"{1e3 * getattr(self, name)[-1]:.4g} mJ") for name, label in self.accounts.items()]
        return [*rows, (self.residual_name, f"{1e3 * self.residual[-1]:.4g} mJ")]

    @property
    def residual_name(self) -> str:
        """What the residual is."""
        return "residual, error of steps and samples" if self.is_spring else "lost by a law that is no spring"


ACCOUNTS = {
    "work": "work of the joint torques",
    "pushed": "work of pushes",
    "kinetic": "kinetic energy",
    "gravity": "energy of height",
    "elastic": "elastic energy of the tips",
    "damping": "damped in the tips",
    "slip": "lost to slip",
    "joint_damping": "damped in the joints",
    "joint_friction": "lost to friction of the joints",
    "stops": "elastic energy of the stops",
    "stop_damping": "damped in the stops",
}
"""Arrays of a `Ledger`, in words; the first two together equal the sum of the others and the residual."""

_RARE = ("pushed", "joint_damping", "joint_friction", "stops", "stop_damping")


def energy_ledger(
    recording: Recording, plant: Plant | None = None, samples: Sequence[int] | NDArray[np.integer] = (0, -1)
) -> Ledger:
    """The energy ledger of a run:

        work + pushed = kinetic + gravity + elastic + damping + slip + what joints take + residual

    The torque is held over a control period, so its work is the sum of tau . (q_F(next) - q_F): exact. Damping by the
    controller is in this work already. Pushes are held over a step: their work is as exact where a control period is
    one step, else that of the push at the begin of the period is taken for all of it. What the material damps is the
    integral of J_delta^T f - F over the deformation, F the force of the law, from sample to sample by the trapezoidal
    rule; what F stores beyond `tip_energy`, where tips relax, is in the same account. Slip is `slip_loss` of the
    recording. Rotors are in the kinetic energy; what joints take is in `joint_energy`. The work of servos is that of
    the torques that they give.

    Args:
        recording: with at least one sample.
        plant: of that run; read only for its model and materials. Built from the recording's scenario if not given.
        samples: where the accounts are wanted.

    Raises:
        RecordingError: the scenario in the recording cannot be read, or arrays are missing or not of that scenario.
        SofthandError: as `build`, where that scenario can no longer be built.
    """
    plant = Plant(plant.world, plant.fingertips, plant.supports) if plant else _recorded_plant(recording)
    nt, is_damped = plant.world.n_tips, bool(np.any(plant.pads["is_damped"]))
    leans = plant.pads["slope_function"] != 0
    needed = ["joint_torque", "contact_force", *(["support_force"] if plant.supports else [])]
    needed += ["element_force"] if plant.n_elements and is_damped else []
    needed += [name for name, own in (("contact_moment", leans[:nt]), ("support_moment", leans[nt:])) if own.any()]
    check_states(plant, recording, *needed)
    count = len(recording)
    chosen = np.arange(count)[np.asarray(samples)]
    moved = np.diff(np.unwrap(recording.joint_position, axis=0), axis=0)
    work = _summed(np.sum(recording.joint_torque[:-1] * moved, axis=1))
    damping = np.zeros(count)
    if is_damped:
        excess, deformation = np.stack([_beyond_law(recording, plant, k) for k in range(count)], axis=1)
        damping = _summed(np.sum(0.5 * (excess[1:] + excess[:-1]) * np.diff(deformation, axis=0), axis=(1, 2)))
    slip = np.zeros(count)
    if "slip_loss" in recording.variables:
        slip = np.sum(recording.slip_loss, axis=1)
    if "support_slip_loss" in recording.variables:
        slip += np.sum(recording.support_slip_loss, axis=1)
    pushed, joints = _push_work(recording, plant), joint_energy(recording, plant)
    energies = np.array([_energies(recording, plant, sample) for sample in (0, *chosen)])
    kinetic, gravity, elastic, relaxing = (energies[1:] - energies[0]).T
    return Ledger(
        time=recording.time[chosen],
        work=work[chosen],
        pushed=pushed[chosen],
        kinetic=kinetic,
        gravity=gravity,
        elastic=elastic,
        damping=damping[chosen] + relaxing,
        slip=slip[chosen] - slip[0],
        joint_damping=joints.damping[chosen],
        joint_friction=joints.friction[chosen],
        stops=joints.stops[chosen],
        stop_damping=joints.stop_damping[chosen],
        is_spring=all(is_spring(tip.law) for tip in plant.materials),
    )


def is_spring(law: Law) -> bool:
    """Whether the law has an energy of the deformation alone; or one of the lean too, and its `moment` is the slope."""
    if law.energy is None:
        return False
    deformation = np.array([0.1 * law.radius, 0.02 * law.radius, 0.03 * law.radius, 0.1])
    places = [law.arguments(deformation, *place) for place in ((1.0, 0.5), (1.3, 1.5))]
    if law.moment is None:
        here, there = (law.energy(*place) for place in places)
        return bool(here == there)
    return all(np.allclose(law.moment(*place), _rolling_moment(law, place), rtol=1e-5, atol=0.0) for place in places)


def _rolling_moment(law: Law, place: Array) -> tuple[float, float]:
    """m_1, m_2 of the energy, by central differences."""
    assert law.energy is not None
    slopes = []
    for column in (4, 5):
        move = _STEP * (np.arange(len(place)) == column)
        slopes.append((law.energy(*(place + move)) - law.energy(*(place - move))) / (2.0 * _STEP))
    upright = float(np.sqrt(1.0 - place[4] ** 2 - place[5] ** 2))
    return -slopes[1] * upright, slopes[0] * upright


def tip_energy(tip: Contact, contact: np.void) -> float:
    """What a tip, or a support, gives back when it is let go slowly [J].

    The energy of its law, where it has one. Else the work along a straight line at fixed Phi and lean, the integral of
    dF(s delta) . delta over s from 0 to 1: for a law that is no spring, such as the paper's, it depends on the way, and
    the straight line is a convention. Of a tip that relaxes the share c_0 of that.

    Args:
        tip: law and damping.
        contact: row of `records.CONTACT`: its deformation, angles and lean.
    """
    law, deformation, Phi = tip.law, contact["deformation"], float(contact["angles"][1])
    bearing = float(np.arctan2(contact["lean"][1], contact["lean"][0]))
    if law.energy is not None:
        return tip.damping.relaxed() * float(law.energy(*law.arguments(deformation, Phi, bearing)))
    work = [law(share * deformation, Phi, bearing) @ deformation for share in 0.5 * (_NODES + 1.0)]
    return tip.damping.relaxed() * 0.5 * float(_WEIGHTS @ work)


def _recorded_plant(recording: Recording) -> Plant:
    scenario = recorded_scenario(recording)
    return read_plant(scenario)


def _push_work(recording: Recording, plant: Plant) -> Array:
    """Work of the recorded pushes up to each sample [J]: external . (q(next) - q)."""
    work = np.zeros(len(recording) - 1)
    if "external_force" in recording.variables:
        external, model = recording.external_force, plant.world.coordinates
        for k in np.flatnonzero(np.any(external[:-1], axis=1)).tolist():
            here, there = (recorded_state(plant, recording, sample).q for sample in (k, k + 1))
            work[k] = external[k] @ pin.difference(model, here, there)
    return _summed(work)


def _summed(parts: Array) -> Array:
    """Sums up to each sample, the first 0."""
    return np.concatenate([[0.0], np.cumsum(parts)])


def _put(recording: Recording, plant: Plant, sample: int) -> State:
    """Bring the plant to one sample."""
    known = recorded_state(plant, recording, sample)
    plant.update(known.q, known.v, known.z)
    return known


def _energies(recording: Recording, plant: Plant, sample: int) -> tuple[float, float, float, float]:
    """Kinetic, gravitational and elastic energy at one sample, and what else relaxing tips hold [J]."""
    state = _put(recording, plant, sample)
    world = plant.world
    model, data, q = world.model, world.model.createData(), world.configuration(state.q)
    elastic, relaxing = 0.0, 0.0
    for tip, contact, rows in zip(plant.materials, plant.contacts, plant.elements, strict=True):
        left = tip.damping.relaxed()
        parts = _parts(tip, contact, rows)
        stored = sum(tip_energy(tip, part) for part in parts) / len(parts)
        elastic += stored
        relaxing += stored * (1.0 - left) / left
    kinetic = pin.computeKineticEnergy(model, data, q, world.velocity(state.v)) + rotor_energy(plant, state.v)
    return float(kinetic), float(pin.computePotentialEnergy(model, data, q)), elastic, relaxing


def _parts(tip: Contact, contact: np.void, rows: Array) -> list[np.void]:
    """The contact, or contacts that are all like one of its elements, with the deformation that was recorded."""
    if tip.elements == 1:
        return [contact]
    parts = [contact.copy() for _ in range(tip.elements)]
    for part, row in zip(parts, rows, strict=False):
        part["deformation"][1:] = row[TRIAL : TRIAL + 3]
    return parts


def _beyond_law(recording: Recording, plant: Plant, sample: int) -> tuple[Array, Array]:
    """J_delta^T f - F of all contacts at one sample, and their deformation, lean included; each of shape (parts, 6).

    A part is a contact, or 1/n of it where it has n elements.
    """
    _put(recording, plant, sample)
    contacts = plant.contacts
    force = recording.contact_force[sample]
    if plant.supports:
        force = np.concatenate([force, recording.support_force[sample]])
    slope = _recorded_slope(recording, plant, sample)
    beyond, deformation = [], []
    for i, (tip, contact, rows) in enumerate(zip(plant.materials, contacts, plant.elements, strict=True)):
        parts = _parts(tip, contact, rows)
        forces = [force[i]] if len(parts) == 1 else recording.element_force[sample, i]
        for part, own in zip(parts, forces, strict=False):
            by_law = np.concatenate([part["deformation_force"], part["lean_force"]])
            if len(parts) > 1:
                by_law = _by_law(tip, part)
            beyond.append((np.concatenate([_in_law(part, own), slope[i]]) - by_law) / len(parts))
            deformation.append(np.concatenate([part["deformation"], part["lean"]]))
    return np.array(beyond), np.array(deformation)


def _recorded_slope(recording: Recording, plant: Plant, sample: int) -> Array:
    """By the moments at one sample, what a turn of the lean takes [J], shape (nc, 2)."""
    contacts, nt, leans = plant.contacts, plant.world.n_tips, plant.pads["slope_function"] != 0
    slope = np.zeros((len(contacts), 2))
    for name, own in (("contact_moment", slice(nt)), ("support_moment", slice(nt, None))):
        if leans[own].any():
            moment = recording[name][sample]
            slope[own] = np.column_stack([moment[:, 1], -moment[:, 0]]) / contacts["sin_Phi"][own, None]
    slope[~leans] = 0.0
    return slope


def _in_law(contact: np.void, force: Array) -> Array:
    """J_delta^T f; the normal force and the torsion alone of a contact that does not touch."""
    if not contact["deformation"][0] > 0.0:
        return np.array([force[2], 0.0, 0.0, force[3]])
    along = (force[0] - contact["psi_per_x"] * force[3]) / contact["theta_per_x"]
    return np.array([force[2], along, force[1] / contact["phi_per_y"], force[3]])


def _by_law(tip: Contact, contact: np.void) -> Array:
    """F and dU/dlean at the deformation of the contact, shape (6,)."""
    law, (l1, l2) = tip.law, contact["lean"]
    place = contact["deformation"], float(contact["angles"][1]), float(np.arctan2(l2, l1))
    if law.moment is None:
        return np.append(law(*place), [0.0, 0.0])
    return np.append(law(*place), slope_of(*law.moment(*law.arguments(*place)), l1, l2))
