"""Least squeeze: regulation that squeezes no harder than the load of now asks for."""

from __future__ import annotations

from typing import Annotated, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from softhand.contact.limit import set_limit
from softhand.contact.pads import choose_limit
from softhand.contact.records import CONTACT, PAD
from softhand.controllers.barrier import Limits, squeeze_by_barrier
from softhand.controllers.blocks import (
    add_internal_forces,
    add_pose_spring,
    add_torsion,
    feed_back_internal_forces,
    hold_joints,
    pose_error,
    push_contacts,
    share_wrench,
    take_off_torsion,
)
from softhand.controllers.controller import Controller
from softhand.controllers.gains import diagonal, pose_diagonal
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain, NonNegative, Positive

_Share: TypeAlias = Annotated[float, Field(ge=0, lt=1)]


class LeastSqueeze(Controller):
    """The paper's controller (59), with the internal forces that the load of now needs and no more.

        f_Nd = argmin sum f_z,   f = (J_O^fT)^+ [N_O - K_O (q_O - q_Od) - J_O^tauT tau_C] + K f_Nd
        with H(f_t, tau_C / l) <= ((1 - margin) mu f_z)^2 and f_z >= touch at each contact, sum f_z <= most,
        |N_F + J_CF^fT f + J_CF^tauT tau_C| <= effort limits

    the cone program of `softhand squeeze` for the one load that (59) asks the contacts to carry now, torsions as they
    are measured; a push counts as it moves the object. What the reference asks for as internal force is not used. It is
    solved by a barrier, see `controllers.barrier`, which leaves it a smooth function of the load, and filtered: upwards
    with the time `rise`, downwards with `release`. If no squeeze holds, it is the one that is least beyond the limits.
    """

    margin: _Share = 0.3
    """Share of the limit surface that is left free [1]."""
    touch: NonNegative = 0.5
    """Normal force with which each tip presses at least [N]."""
    most: Positive = 60.0
    """Largest sum of the normal forces [N]."""
    rise: Positive = 0.01
    """Time in which the squeeze follows a load that grows [s]."""
    release: Positive = 0.3
    """Time in which it follows one that falls [s]."""
    torsion_compensation: bool = True
    """Whether the measured torsion moments are compensated."""
    K_O_position: Gain = 100.0
    """Stiffness of the position [N/m], one number or three."""
    K_O_orientation: Gain = 0.3
    """Stiffness of the orientation [N m/rad], one number or three."""
    K_v: Gain = 0.005
    """Damping of the joints [N m s/rad or N s/m], one number or one a joint."""
    K_N: Gain = 1.5
    """Gain of the internal force [1], one number or one a pair of contacts."""

    @property
    def formula(self) -> object:  # type: ignore[override]
        """The law of the class."""
        return least_squeeze

    def constants(self, observation: Observation) -> Gains:
        """Gains, and what limits each contact."""
        n, pairs = observation.joint_position.shape[0], observation.internal_force.shape[0]
        tips = observation.fingertips
        pads = np.zeros(len(tips), PAD)
        for pad, tip in zip(pads, tips, strict=True):
            pad["radius"], pad["torsion_share"] = tip.law.radius, tip.law.torsion_share or 0.0
            pad["torsion_length"] = tip.torsion_length or 0.0
            choose_limit(pad, tip.limit, tip.law.torsion_share)
        return Gains(
            pose_diagonal("K_O", self.K_O_position, self.K_O_orientation),
            diagonal("K_v", self.K_v, n),
            diagonal("K_N", self.K_N, pairs),
            Limits(
                np.array([(1.0 - self.margin) * min((tip.friction, *filter(None, tip.face_friction))) for tip in tips]),
                observation.effort_limit.copy(),
                np.array([self.touch, self.most]),
            ),
            np.array([self.rise, self.release]),
            self.torsion_compensation,
            pads,
            np.zeros(len(tips), CONTACT),
        )

    def start(self, observation: Observation) -> Array:
        """f_N of now and the time."""
        return np.array([*observation.internal_force, observation.time])


class Gains(NamedTuple):
    """The settings of `LeastSqueeze` as arrays, and room to work in."""

    K_O: Array
    """[N/m, N m/rad], shape (6,)."""
    K_v: Array
    """[N m s/rad], shape (n,)."""
    K_N: Array
    """Shape (np,)."""
    limits: Limits
    """Of contacts and joints."""
    times: Array
    """Of the filter, rise and release [s]."""
    compensate: bool
    """Whether torsion is compensated."""
    pads: NDArray[np.void]
    """What of `records.PAD` makes the limit surfaces, shape (nc,)."""
    contacts: NDArray[np.void]
    """Room for the limit surfaces, shape (nc,)."""


@compiled
def least_squeeze(observed, gains, memory, torque):
    """The torques, and the memory: f_Nd and the time."""
    nc, pairs = observed.contact_force.shape[0], observed.internal_force.shape[0]
    torsion, basis = observed.contact_force[:, 3], observed.internal_force_basis
    error, wrench, f_C = np.empty(6), np.empty(6), np.empty(3 * nc)
    wanted, squeeze = np.empty(pairs), np.empty(pairs)
    pose_error(observed.object_coordinates, observed.object_rotation, observed.object_coordinates_desired, error)
    for k in range(6):
        wrench[k] = observed.carried_desired[0] * observed.object_gravity[k]
    add_pose_spring(gains.K_O, error, observed.object_rotation, wrench)
    hold_joints(observed.gravity_torque, gains.K_v, observed.joint_velocity, torque)
    if gains.compensate:
        take_off_torsion(observed.object_torsion_jacobian, torsion, wrench)
        add_torsion(observed.hand_torsion_jacobian, torsion, torque)
    share_wrench(observed.object_force_jacobian, wrench, f_C)
    for i in range(nc):
        gains.contacts[i].distance = gains.pads[i].radius - observed.deformation[i, 0]
        set_limit(gains.pads[i], gains.contacts[i])
    squeeze_by_barrier(
        gains.limits, gains.contacts, basis, f_C, torsion, observed.hand_force_jacobian, torque,
        memory[:pairs], wanted,
    )  # fmt: skip
    more = 0.0
    for k in range(pairs):
        for i in range(nc):
            more += basis[3 * i + 2, k] * (wanted[k] - memory[k])
    passed = max(observed.clock[0] - memory[pairs], 0.0)
    share = passed / (passed + (gains.times[0] if more > 0.0 else gains.times[1]))
    for k in range(pairs):
        memory[k] += share * (wanted[k] - memory[k])
    memory[pairs] = observed.clock[0]
    feed_back_internal_forces(observed.internal_force, memory[:pairs], gains.K_N, squeeze)
    add_internal_forces(basis, squeeze, f_C)
    push_contacts(observed.hand_force_jacobian, f_C, torque)
