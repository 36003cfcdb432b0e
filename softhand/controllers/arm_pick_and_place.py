"""A hand on an arm that fetches an object: the arm carries the palm along, the fingers hold."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from softhand.controllers.blocks import hold_joints
from softhand.controllers.palm import PLACE_SIZE, Palm, carry_palm, palm_of, palm_place, set_palm_terms
from softhand.controllers.pick_and_place import FINE, HOLDS, POSTURE, VERDICT, PickAndPlace, Tuning, judge, set_feet
from softhand.controllers.regulation import regulation, regulation_by_angles
from softhand.numerics.compiled import compiled
from softhand.numerics.spatial import rotation_of
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain, NonNegative, Positive


class ArmPickAndPlace(PickAndPlace):
    """The fingers as in `pick-and-place`, and an arm or a wrist that carries the palm along by computed torque.

    The palm keeps the place that it had at the start to the object as it is desired, but for the standoff that the
    reference asks for, by which the open hand comes and goes. With p, R of the palm, e = (p - p_d, log(R_d^T R)), and
    J its Jacobian, the accelerations a of the joints that move it solve

        J a + J' q_F' = V_d' - D_palm (V - V_d) - K_palm e
        tau = (torque of pick-and-place) + M_F a + C_F q_F'

    The torque of (59) goes through all joints, J_CF^fT f_C, so that the arm bears what the fingers hold. Free tips are
    drawn to places that are fixed to the palm, by their own joints; K_v damps these joints only. Of an arm of more than
    six joints the idle motion is drawn to the start by K_idle; one that is near a singular posture is not slowed down.
    """

    K_v: Gain = 0.015
    """As in `pick-and-place`, of the joints of the fingers [N m s/rad or N s/m], one number or one a joint."""
    K_palm: Positive = 900.0
    """Stiffness of the place of the palm [1/s^2]."""
    D_palm: Positive = 60.0
    """Damping of the palm, and of what an arm of more than six joints can do beside [1/s]."""
    K_idle: NonNegative = 100.0
    """Stiffness of idle motions of such an arm to the posture of the start [1/s^2]."""

    @property
    def formula(self) -> Any:  # type: ignore[override]
        """The law of the class, with (59) in either form."""
        return arm_pick_and_place_by_angles if self.orientation_error == "euler" else arm_pick_and_place

    def constants(self, observation: Observation) -> Any:
        """The settings, what is known of tips and object, and the palm."""
        tuning = self._tuning(observation)
        palm = palm_of("arm-pick-and-place", observation, self.K_palm, self.D_palm, self.K_idle)
        for gain in (tuning.K_v, tuning.held.K_v, tuning.held.K_posture):
            gain *= palm.moves
        return Carrying(tuning, palm)

    def start(self, observation: Observation) -> Any:
        """All tips free, at their feet, and the palm in its place."""
        known, memory = self.constants(observation), super().start(observation)
        n, nc = observation.joint_position.shape[0], len(observation.fingertips)
        feet, desired = np.empty((2, nc, 3)), rotation_of(observation.object_rpy_desired)
        origin = observation.object_position_desired + observation.standoff_desired
        set_feet(observation.tip_position, origin, desired, known.fingers.normals, known.fingers.offsets, *feet)
        memory = np.concatenate([memory[: POSTURE + n], palm_place(known.palm, observation), feet.ravel()])
        _fix_to_palm(known.palm.terms.poses[known.palm.joint], feet, memory[-6 * nc :].reshape(2, nc, 3))
        return memory


class Carrying(NamedTuple):
    """The settings of `ArmPickAndPlace`."""

    fingers: Tuning
    palm: Palm


@compiled
def arm_pick_and_place(observed, known, memory, torque):
    """The law of the class; `memory` as `start` returns it."""
    if _is_in_hand(observed, known, memory, torque):
        regulation(observed, known.fingers.held, memory[POSTURE : POSTURE + torque.shape[0]], torque)
    _carry(observed, known, memory, torque)


@compiled
def arm_pick_and_place_by_angles(observed, known, memory, torque):
    """The same with (59) by q_O."""
    if _is_in_hand(observed, known, memory, torque):
        regulation_by_angles(observed, known.fingers.held, memory[POSTURE : POSTURE + torque.shape[0]], torque)
    _carry(observed, known, memory, torque)


@compiled
def _is_in_hand(observed, known, memory, torque):
    """Take hold or let go; whether (59) is to hold the object. If not, the torque is set."""
    held, nc = memory[HOLDS], known.fingers.radii.shape[0]
    judge(observed, known.fingers, memory)
    if memory[VERDICT] != FINE:
        torque[:] = np.nan
        return False
    set_palm_terms(observed, known.palm)
    if memory[HOLDS]:
        return True
    pose, feet = known.palm.terms.poses[known.palm.joint], memory[memory.shape[0] - 6 * nc :].reshape(2, nc, 3)
    if held:
        _fix_to_palm(pose, feet, feet)
    _hold_off(observed, known, pose, feet, torque)
    return False


@compiled
def _carry(observed, known, memory, torque):
    if memory[VERDICT] == FINE:
        begin = POSTURE + torque.shape[0]
        place, posture = memory[begin : begin + PLACE_SIZE], memory[POSTURE:begin]
        carry_palm(observed, known.palm, place, posture, torque)


@compiled
def _fix_to_palm(pose, feet, fixed):
    """Feet and normals in the axes of the palm; both may be the same array."""
    way, normal = np.empty(3), np.empty(3)
    for i in range(feet.shape[1]):
        for k in range(3):
            way[k] = normal[k] = 0.0
            for m in range(3):
                way[k] += pose[3 * k + m] * (feet[0, i, m] - pose[9 + m])
                normal[k] += pose[3 * k + m] * feet[1, i, m]
        for k in range(3):
            fixed[0, i, k], fixed[1, i, k] = way[k], normal[k]


@compiled
def _hold_off(observed, known, pose, feet, torque):
    """Springs from the tips to their places before the palm, by the joints of the fingers."""
    nc, n, moves, tuning = feet.shape[1], torque.shape[0], known.palm.moves, known.fingers
    hold_joints(observed.gravity_torque, tuning.K_v, observed.joint_velocity, torque)
    for i in range(nc):
        off = tuning.radii[i] + observed.opening_desired[0]
        for k in range(3):
            force = pose[9 + k]
            for m in range(3):
                force += pose[3 * m + k] * (feet[0, i, m] + off * feet[1, i, m])
            force = tuning.K_tip * (force - observed.tip_position[i, k])
            for j in range(n):
                force -= tuning.D_tip * moves[j] * observed.tip_jacobian[i, k, j] * observed.joint_velocity[j]
            for j in range(n):
                torque[j] += moves[j] * observed.tip_jacobian[i, k, j] * force
