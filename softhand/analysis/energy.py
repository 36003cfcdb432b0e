"""Where the work of the joints went: the energy balance of a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from softhand.analysis.probe import recorded_state
from softhand.plant import Fingertip, Plant
from softhand.recording import Recording

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)


@dataclass(frozen=True)
class Balance:
    """Energy between the first and the last sample of a run.

    Attributes:
        work: of the joint torques [J].
        kinetic: change of the kinetic energy [J].
        gravity: change of the potential energy of the weights [J].
        elastic: change of what the tips would give back, see `tip_energy` [J].
    """

    work: float
    kinetic: float
    gravity: float
    elastic: float

    @property
    def lost(self) -> float:
        """What is left of the work [J]: lost in the tips, by damping, slip or a law that is no spring.

        Negative if the tips gave more than was put in, which a law that is no spring can do.
        """
        return self.work - self.kinetic - self.gravity - self.elastic


def balance(recording: Recording, plant: Plant) -> Balance:
    """The energy balance of a run.

    The torque is held over a control period, so its work is the sum of tau . (q_F(next) - q_F): exact. Damping by the
    controller is in this work already.

    Args:
        recording: with at least one sample.
        plant: of that run; put at its first and last state.
    """
    moved = np.diff(np.unwrap(recording.joint_position, axis=0), axis=0)
    work = float(np.sum(recording.joint_torque[:-1] * moved))
    ends = [_energies(recording, plant, sample) for sample in (0, len(recording) - 1)]
    kinetic, gravity, elastic = (after - before for before, after in zip(*ends, strict=True))
    return Balance(work, kinetic, gravity, elastic)


def tip_energy(tip: Fingertip, contact: np.void) -> float:
    """What a tip gives back when it is let go slowly [J].

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


def _energies(recording: Recording, plant: Plant, sample: int) -> tuple[float, float, float]:
    """Kinetic, gravitational and elastic energy at one sample [J]."""
    model, state = plant.world.model, recorded_state(plant, recording, sample)
    data = model.createData()
    plant.update(state.q, state.v, state.z)
    return (
        float(pin.computeKineticEnergy(model, data, state.q, state.v)),
        float(pin.computePotentialEnergy(model, data, state.q)),
        sum(tip_energy(tip, contact) for tip, contact in zip(plant.fingertips, plant.contacts, strict=True)),
    )
