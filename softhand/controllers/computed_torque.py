"""Computed torque: the equations of motion of hand and object, solved for the torques."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from softhand.controllers.blocks import hold_joints
from softhand.controllers.controller import Controller
from softhand.controllers.formula import Law
from softhand.controllers.gains import diagonal, pose_diagonal
from softhand.controllers.grasp_force import add_grasp_torque
from softhand.controllers.pose import (
    OrientationError,
    add_twist,
    irregular,
    set_coordinates_rate,
    set_task,
)
from softhand.model.rigid import rigid_terms
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.linear import least_norm_columns
from softhand.numerics.rotations import rates_to_turning
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain


class ComputedTorque(Controller):
    """Computed torque: rigid-contact dynamics inverted, so that the pose error obeys e'' + K_d e' + K_p e = 0.

    With t the twist of the object, G = G^f its grasp matrix, J_h = J_CF^f, A = J_h^-1 G^T (so that q_F' = A t while the
    contacts do not give way) and b the acceleration t' at which e'' = -K_d e' - K_p e + (that of the reference):

        tau = J_h^T { G^+ [M_O b + C_O t + N_O] + K f_Nd } + M_F (A b + A' t) + C_F q_F' + N_F - K_v q_F'

    This is the law of Murray, Li and Sastry, tau = J_h^T (G^+ F + f_N) with F = M~ a + C~ q_O' + N~ and
    M~ = M_O + G J_h^-T M_F A, where the f_N in ker G is the one that does not turn the fingers' weight into squeeze.
    Form: certain, for rigid contacts; K_v is not part of it. Soft tips put a spring between hand and object: the gains
    must stay well below its frequency, 20 to 30 Hz in the reference hand. Where J_h is not square, A is the least-norm
    solution. A' is a difference of two samples.
    """

    orientation_error: OrientationError = "rotation-vector"
    """As in `regulation`; gains of the orientation are about the axes of the object, or those of roll, pitch, yaw."""
    torsion_compensation: bool = True
    """Whether the measured torsion moments are compensated. Rigid point contacts, as in the original, have none."""
    K_p_position: Gain = 200.0
    """Stiffness of the error of the position [1/s^2], one number or three."""
    K_p_orientation: Gain = 200.0
    """Stiffness of the error of the orientation [1/s^2], one number or three."""
    K_d_position: Gain = 15.0
    """Damping of the error of the position [1/s], one number or three."""
    K_d_orientation: Gain = 12.0
    """Damping of the error of the orientation [1/s], one number or three."""
    K_v: Gain = 0.005
    """Damping of the joints [N m s/rad or N s/m], one number or one a joint."""

    @property
    def formula(self) -> Any:  # type: ignore[override]
        """The law of the class."""
        return computed_torque

    def constants(self, observation: Observation) -> Gains:
        """The gains, and the rigid bodies."""
        tree, terms = observation.known.rigid.compiled
        return Gains(
            pose_diagonal("K_p", self.K_p_position, self.K_p_orientation),
            pose_diagonal("K_d", self.K_d_position, self.K_d_orientation),
            diagonal("K_v", self.K_v, observation.joint_position.shape[0]),
            self.orientation_error == "euler",
            self.torsion_compensation,
            tree._replace(gravity=np.zeros(3)),
            terms,
        )

    def start(self, observation: Observation) -> Any:
        """The time, and A of the sample before."""
        A = np.empty((observation.joint_position.shape[0], 6))
        least_norm_columns(observation.hand_force_jacobian, observation.object_force_jacobian, A)
        return np.concatenate([[observation.time], A.ravel()])

    def complaint(self, observation: Observation, law: Law) -> Exception | None:
        """Roll, pitch and yaw cannot be used."""
        pitches = observation.object_rpy[1], observation.object_rpy_desired[1]
        is_euler = self.orientation_error == "euler"
        return irregular("ComputedTorque", observation.time, *pitches) if is_euler else None


class Gains(NamedTuple):
    """The settings of `ComputedTorque` as diagonals, and the rigid bodies."""

    K_p: Array
    K_d: Array
    K_v: Array
    is_euler: bool
    compensate: bool
    tree: Any
    """`model.tree.Tree` without gravity, which is held apart."""
    terms: Any
    """Room for `rigid_terms`."""


@compiled
def computed_torque(observed, gains, memory, torque):
    """The law of the class; `memory` has the time and A of the sample before, row by row."""
    n, twist, R = torque.shape[0], observed.object_twist, observed.object_rotation
    b, wrench, moved = np.zeros(6), np.empty(6), np.empty(6)
    _set_acceleration(observed, gains, b)
    v, a = np.empty(n + 6), np.empty(n)
    _set_follow(observed, memory, b, a)
    for j in range(n):
        v[j] = observed.joint_velocity[j]
    for k in range(3):  # in axes of the object; R^T (v' - w x v) is the acceleration of its own velocity
        v[n + k] = R[0, k] * twist[0] + R[1, k] * twist[1] + R[2, k] * twist[2]
        v[n + 3 + k] = R[0, k] * twist[3] + R[1, k] * twist[4] + R[2, k] * twist[5]
    x = b[0] - (twist[4] * twist[2] - twist[5] * twist[1])
    y = b[1] - (twist[5] * twist[0] - twist[3] * twist[2])
    z = b[2] - (twist[3] * twist[1] - twist[4] * twist[0])
    for k in range(3):
        moved[k] = R[0, k] * x + R[1, k] * y + R[2, k] * z
        moved[3 + k] = R[0, k] * b[3] + R[1, k] * b[4] + R[2, k] * b[5]
    hold_joints(observed.gravity_torque, gains.K_v, observed.joint_velocity, torque)
    _add_inertial(observed.configuration, v, a, moved, gains.tree, gains.terms, torque)
    for k in range(3):
        wrench[k], wrench[3 + k] = observed.object_gravity[k], observed.object_gravity[3 + k]
        for i in range(3):
            wrench[k] += R[k, i] * moved[i]
            wrench[3 + k] += R[k, i] * moved[3 + i]
    add_grasp_torque(observed, wrench, observed.internal_force_desired, gains.compensate, torque)


@compiled
def _set_acceleration(observed, gains, b):
    """b, the rate of the twist at which e'' = -K_d e' - K_p e + (that of the reference); zero before."""
    error, rate, sought = np.empty(6), np.empty(6), np.empty(6)
    set_task(observed, gains.is_euler, error, rate, sought)
    for k in range(6):
        sought[k] -= gains.K_d[k] * rate[k] + gains.K_p[k] * error[k]
    if gains.is_euler:  # T_O' q_O'
        still, unused = np.zeros(3), np.empty(3)
        set_coordinates_rate(observed.coordinate_map, observed.object_twist, rate)
        rates_to_turning(observed.object_coordinates[3:6], rate[3:6], still, unused, b[3:6])
    add_twist(observed, gains.is_euler, sought, b)


@compiled
def _set_follow(observed, memory, b, a):
    """a = A b + A' t with A = J_CF^f+ G^fT, the joint accelerations in rigid contact; and A for the next sample."""
    n, twist, elapsed = a.shape[0], observed.object_twist, observed.clock[0] - memory[0]
    A = np.empty((n, 6))
    least_norm_columns(observed.hand_force_jacobian, observed.object_force_jacobian, A)
    for j in range(n):
        a[j] = 0.0
        for k in range(6):
            place = 1 + 6 * j + k
            a[j] += A[j, k] * b[k]
            if elapsed > 0.0:
                a[j] += (A[j, k] - memory[place]) / elapsed * twist[k]
            memory[place] = A[j, k]
    memory[0] = observed.clock[0]


@compiled
def _add_inertial(q, v, a, moved, tree, terms, torque):
    """torque += M_F a + C_F q_F'; `moved`, the acceleration of the object, becomes what it needs, in its own axes."""
    n, needed = torque.shape[0], np.empty(6)
    rigid_terms(tree, q, v, terms)
    for j in range(n):
        torque[j] += terms.nle[j]
        for i in range(n):
            torque[j] += terms.M[min(i, j), max(i, j)] * a[i]
    for k in range(6):
        needed[k] = terms.nle[n + k]
        for i in range(6):
            needed[k] += terms.M[n + min(i, k), n + max(i, k)] * moved[i]
    for k in range(6):
        moved[k] = needed[k]
