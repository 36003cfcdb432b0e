"""Where the work of the joints went: the energy balance of a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.laws.law import Law
from softhand.model.configuration import rotation_of
from softhand.plant import Plant
from softhand.recording import Recording

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)


@dataclass(frozen=True)
class Balance:
    """Energy between the first and the last sample of a run.

    Attributes:
        work: of the joint torques [J].
        kinetic: change of the kinetic energy [J].
        gravity: change of the potential energy of the weights [J].
        elastic: change of what the tips would give back, see `give_back` [J].
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
        plant: of that run; read only for its model and laws.
    """
    moved = np.diff(np.unwrap(recording.joint_position, axis=0), axis=0)
    work = float(np.sum(recording.joint_torque[:-1] * moved))
    ends = [_energies(recording, plant, sample) for sample in (0, len(recording) - 1)]
    kinetic, gravity, elastic = (after - before for before, after in zip(*ends, strict=True))
    return Balance(work, kinetic, gravity, elastic)


def give_back(law: Law, deformation: NDArray[np.float64], Phi: float) -> float:
    """Work of a tip that is let go along a straight line, at fixed Phi [J]: the integral of dF(s delta) . delta ds.

    The elastic energy of a law that is a spring. The paper's law is none; there it depends on the way, and the straight
    line is a convention.

    Args:
        law: of the tip.
        deformation: dr [m], dtheta, dphi, dpsi [rad], shape (4,).
        Phi: of the deformed tip [rad].
    """
    shares = 0.5 * (_NODES + 1.0)
    return 0.5 * sum(
        float(weight * (law(share * deformation, Phi) @ deformation))
        for share, weight in zip(shares, _WEIGHTS, strict=True)
    )


def _energies(recording: Recording, plant: Plant, sample: int) -> tuple[float, float, float]:
    """Kinetic, gravitational and elastic energy at one sample [J]."""
    world = plant.world
    q, data = pin.neutral(world.model), world.model.createData()
    rotation = rotation_of(recording.object_rpy[sample])
    world.set_joint_position(recording.joint_position[sample], q)
    q[-7:-4], q[-4:] = recording.object_position[sample], pin.Quaternion(rotation).coeffs()
    twist = recording.object_twist[sample]
    v = np.concatenate([recording.joint_velocity[sample], rotation.T @ twist[:3], rotation.T @ twist[3:]])
    tips = zip(plant.fingertips, recording.deformation[sample], recording.contact_angles[sample, :, 1], strict=True)
    return (
        float(pin.computeKineticEnergy(world.model, data, q, v)),
        float(pin.computePotentialEnergy(world.model, data, q)),
        sum(give_back(tip.law, deformation, Phi) for tip, deformation, Phi in tips),
    )
