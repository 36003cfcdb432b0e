"""The paper's controller without any measurement of the object: Remark 5."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from softhand.controllers.blocks import (
    add_internal_forces,
    add_pose_spring,
    add_torsion,
    euler_error,
    feed_back_internal_forces,
    hold_joints,
    hold_weight,
    pose_error,
    push_contacts,
    share_wrench,
    take_off_torsion,
)
from softhand.controllers.controller import Controller
from softhand.controllers.estimate import estimate_in, room_for_estimate, set_kernel
from softhand.controllers.formula import Law
from softhand.controllers.gains import diagonal, pose_diagonal
from softhand.controllers.object_estimator import ObjectEstimator, known_tips, set_update
from softhand.controllers.pose import OrientationError, irregular
from softhand.controllers.tips import pairs_of
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled
from softhand.numerics.linear import least_norm
from softhand.numerics.rotations import set_rpy
from softhand.numerics.triples import solved
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain


class FingerOnly(Controller):
    """Eq. (59) with q_O, f_N and tau_C computed from q_F, q_F' and f_C: no sensor for the object.

    [Nakashima] Remark 5 says that this is possible and leaves the way to an earlier paper; the way here is that of
    `ObjectEstimator`. The law of the tips, the faces and the weight of the object, and its pose at the start are known;
    after the start nothing else is read than the joints and the contact forces, in C_F. Form of the controller:
    certain. The estimate is as good as the known law. It slides away where tips slip or creep, for as long as they do,
    and nothing brings it back: on target A the object ends 0.31 mm and 0.95 deg off where one tip slips 0.59 mm, and
    0.56 mm and 0.24 deg off with damping `fung`; with `regulation` 0.01 mm and 0.07 deg at the same time.
    """

    orientation_error: OrientationError = "rotation-vector"
    """As in `regulation`."""
    torsion_compensation: bool = True
    """Whether the estimated torsion moments are compensated."""
    K_O_position: Gain = 100.0
    """Stiffness of the position [N/m], one number or three."""
    K_O_orientation: Gain = 0.3
    """Stiffness of the orientation [N m/rad], one number or three, as in `regulation`."""
    K_v: Gain = 0.005
    """Damping of the joints [N m s/rad or N s/m], one number or one a joint."""
    K_N: Gain = 1.5
    """Gain of the internal force [1], one number or one a pair of contacts."""

    @property
    def formula(self) -> Any:  # type: ignore[override]
        """The law of the class."""
        return finger_only

    def constants(self, observation: Observation) -> Tuning:
        """The gains, and what is known of tips and object."""
        n, pairs = observation.joint_position.shape[0], observation.internal_force.shape[0]
        nc = len(observation.fingertips)
        return Tuning(
            pose_diagonal("K_O", self.K_O_position, self.K_O_orientation),
            diagonal("K_v", self.K_v, n),
            diagonal("K_N", self.K_N, pairs),
            self.orientation_error == "euler",
            self.torsion_compensation,
            known_tips(observation),
            pairs_of(observation),
            observation.object_mass,
            observation.object_lever.copy(),
            observation.gravity.copy(),
            *room_for_estimate(nc, n),
            *room_for_estimate(nc, n),
        )

    def start(self, observation: Observation) -> Any:
        """The reach of the contacts, and the numbers of the estimate at the pose of the start."""
        estimator = ObjectEstimator(observation)
        return np.concatenate([[estimator.reach], *map(np.ravel, estimator.start(observation))])

    def complaint(self, observation: Observation, law: Law) -> Exception | None:
        """Roll, pitch and yaw cannot be used."""
        if self.orientation_error != "euler":
            return None
        now = estimate_in(law.memory[1:], len(observation.fingertips), observation.joint_position.shape[0])
        return irregular("FingerOnly", observation.time, now.q_O[4], observation.object_rpy_desired[1])


class Tuning(NamedTuple):
    """The settings of `FingerOnly` as diagonals, what is known of tips and object, and room."""

    K_O: Array
    K_v: Array
    K_N: Array
    is_euler: bool
    compensate: bool
    tips: Any
    """`object_estimator.Tips`."""
    pairs: AnyArray
    mass: float
    lever: Array
    gravity: Array
    numbers_before: Array
    before: Any
    """`Estimate`, a view of the numbers."""
    numbers: Array
    now: Any


@compiled
def finger_only(observed, known, memory, torque):
    """(59) at the estimate; `memory` as `start` returns it."""
    before, now = known.before, known.now
    for k in range(known.numbers.shape[0]):
        known.numbers_before[k] = known.numbers[k] = memory[1 + k]
    set_update(observed, known.tips, memory[0], before, now)
    for k in range(known.numbers.shape[0]):
        memory[1 + k] = known.numbers[k]
    nc, pairs = known.tips.radii.shape[0], known.pairs.shape[0]
    K, measured, f_C = np.empty((3 * nc, pairs)), np.empty(3 * nc), np.empty(3 * nc)
    f_N, squeeze, wrench = np.empty(pairs), np.empty(pairs), np.empty(6)
    for i in range(nc):
        for k in range(3):
            measured[3 * i + k] = observed.contact_force[i, k]
    set_kernel(now.point, now.axes, known.pairs, K)
    least_norm(K, False, measured, f_N)
    hold_weight(known.mass, known.lever, now.rotation, known.gravity, wrench)
    _add_spring(observed.object_coordinates_desired, known, now, wrench)
    hold_joints(observed.gravity_torque, known.K_v, observed.joint_velocity, torque)
    if known.compensate:
        take_off_torsion(now.torsion_rows, now.tau_C, wrench)
        add_torsion(now.J_CF_tau, now.tau_C, torque)
    share_wrench(now.force_rows, wrench, f_C)
    feed_back_internal_forces(f_N, observed.internal_force_desired, known.K_N, squeeze)
    add_internal_forces(K, squeeze, f_C)
    push_contacts(now.J_CF_f, f_C, torque)


@compiled
def _add_spring(desired, known, now, wrench):
    """wrench -= K_O e at the estimate, about the origin of the object, world axes."""
    error, coordinates = np.empty(6), np.empty(6)
    if not known.is_euler:
        pose_error(now.position, now.rotation, desired, error)
        add_pose_spring(known.K_O, error, now.rotation, wrench)
        return
    coordinates[:3] = now.position
    set_rpy(now.rotation, coordinates[3:6])
    euler_error(coordinates, desired, error)
    b, j, c, k = math.cos(coordinates[4]), math.sin(coordinates[4]), math.cos(coordinates[5]), math.sin(coordinates[5])
    for i in range(6):
        error[i] *= known.K_O[i]
    moment = solved((c * b, k * b, -j, -k, c, 0.0, 0.0, 0.0, 1.0), (error[3], error[4], error[5]))  # T^-T
    for i in range(3):
        wrench[i] -= error[i]
        wrench[3 + i] -= moment[i]
