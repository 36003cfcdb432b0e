"""Closing the fingers on an object, lifting it, putting it down and letting go."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from softhand.controllers.blocks import hold_joints, push_tips
from softhand.controllers.controller import Controller
from softhand.controllers.formula import Law
from softhand.controllers.gains import diagonal
from softhand.controllers.pose import OrientationError
from softhand.controllers.regulation import Regulation, regulation, regulation_by_angles
from softhand.controllers.tips import radii
from softhand.errors import ControllerError
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain, NonNegative, Positive

HOLDS, TOUCHED, VERDICT, TIP, POSTURE = range(5)
"""Places in the memory: whether the object is held; when all tips touched for the last time, or did not have to [s];
what is wrong, and with which tip; q_F(0) from here on. Then feet and normals of the faces, shape (nc, 3) each."""

FINE, APART, AWAY, FALLS = range(4)
"""Verdicts."""


class PickAndPlace(Controller):
    """Free tips on springs towards their contact points, the paper's law (59) while the object is held.

    What is done when is said by the reference, best by `waypoints`. While the mean of f_Nd is below `touch_force`, each
    tip is drawn to its place before the face, which is p = foot of the tip on its face when it was last let go, n the
    outward normal there, w the desired opening:

        tau = N_F - K_v q_F' + sum J_i^T {K_tip (p_i + (r + w) n_i - x_i) - D_tip x_i'}

    Above it the torque is that of (59) with the desired share of the weight N_O, the rest of which is the table's. An
    opening below 0 presses a little, so that (59) finds all tips in touch. The run ends with the name of the tip or the
    figure at fault when a tip does not touch in time, lets go, when the object is lost, or would fall at the release.
    """

    touch_force: Positive = 0.3
    """Mean of f_Nd above which the object is held [N]."""
    K_tip: Positive = 100.0
    """Stiffness of a free tip [N/m]."""
    D_tip: NonNegative = 4.0
    """Damping of a free tip [N s/m]."""
    patience: NonNegative = 0.2
    """Longest time that a tip may be without touch while the object is held [s]."""
    lost: Positive = 0.015
    """Distance of the object from its desired position at which it is given up [m]."""
    orientation_error: OrientationError = "rotation-vector"
    """As in `regulation`."""
    torsion_compensation: bool = True
    """Whether the measured torsion moments are compensated."""
    K_O_position: Gain = 100.0
    """Stiffness of the position, as in `regulation` [N/m], one number or three."""
    K_O_orientation: Gain = 0.3
    """Stiffness of the orientation, as in `regulation` [N m/rad], one number or three."""
    K_v: Gain = 0.005
    """Damping of the joints [N m s/rad or N s/m], one number or one a joint."""
    K_N: Gain = 1.5
    """Gain of the internal force, as in `regulation` [1], one number or one a pair of contacts."""
    K_posture: Gain = 0.0
    """Stiffness of idle joint motions to the open fingers of the start [N m/rad or N/m], one number or one a joint."""

    @property
    def formula(self) -> Any:  # type: ignore[override]
        """The law of the class, with (59) in either form."""
        return pick_and_place_by_angles if self.orientation_error == "euler" else pick_and_place

    @property
    def _held(self) -> Regulation:
        """The law while the object is held."""
        return Regulation(**{key: getattr(self, key) for key in Regulation.model_fields})

    def constants(self, observation: Observation) -> Any:
        """The settings, and what is known of tips and object."""
        return self._tuning(observation)

    def _tuning(self, observation: Observation) -> Tuning:
        tips = observation.fingertips
        return Tuning(
            self.touch_force,
            self.K_tip,
            self.D_tip,
            diagonal("K_v", self.K_v, observation.joint_position.shape[0]),
            self.patience,
            self.lost,
            self._held.constants(observation),
            radii(observation),
            np.array([tip.face.normal for tip in tips]),
            np.array([tip.face.offset for tip in tips]),
            observation.object_mass * observation.gravity,
        )

    def start(self, observation: Observation) -> Any:
        """All tips free, at their feet."""
        known, feet = self._tuning(observation), np.empty((2, len(observation.fingertips), 3))
        place = observation.tip_position, observation.object_position, observation.object_rotation
        set_feet(*place, known.normals, known.offsets, *feet)
        head = [0.0, observation.time, FINE, 0.0]
        return np.concatenate([head, observation.joint_position, feet.ravel()])

    def complaint(self, observation: Observation, law: Law) -> Exception | None:
        """What is wrong with the grasp, or that roll, pitch and yaw cannot be used."""
        memory, verdict = law.memory, int(law.memory[VERDICT])
        if verdict == FINE:
            return self._held.complaint(observation, law)
        if verdict == APART:
            i = int(memory[TIP])
            gap = 1e3 * -float(observation.deformation[i, 0])
            what = "lost the object" if memory[HOLDS] else "does not reach the object"
            what = f"{observation.tip_names[i]} {what}: it is {gap:.3g} mm off after {self.patience:g} s of waiting"
        elif verdict == AWAY:
            away = float(np.linalg.norm(observation.object_position - observation.object_position_desired))
            what = f"the object slipped out: it is {1e3 * away:.3g} mm from where it is asked to be"
        else:
            what = "the object does not stand: at the release the fingers still carry more than half of its weight"
        return ControllerError(
            f"controller '{type(self).__name__}' gave up at t = {observation.time:g} s: {what}.",
            controller=type(self).__name__, reason="given up", time=observation.time,
        )  # fmt: skip


class Tuning(NamedTuple):
    """The settings of `PickAndPlace`, and what is known of tips and object."""

    touch_force: float
    K_tip: float
    D_tip: float
    K_v: Array
    patience: float
    lost: float
    held: Any
    """Gains of `Regulation`."""
    radii: Array
    normals: Array
    """Of the faces, in the object, shape (nc, 3)."""
    offsets: Array
    """Of the faces [m], shape (nc,)."""
    weight: Array
    """m g [N], shape (3,)."""


@compiled
def pick_and_place(observed, known, memory, torque):
    """The law of the class; `memory` as `start` returns it."""
    judge(observed, known, memory)
    if memory[VERDICT] != FINE:
        torque[:] = np.nan
    elif memory[HOLDS]:
        regulation(observed, known.held, memory[POSTURE : POSTURE + torque.shape[0]], torque)
    else:
        _hold_off(observed, known, memory, torque)


@compiled
def pick_and_place_by_angles(observed, known, memory, torque):
    """The same with (59) by q_O."""
    judge(observed, known, memory)
    if memory[VERDICT] != FINE:
        torque[:] = np.nan
    elif memory[HOLDS]:
        regulation_by_angles(observed, known.held, memory[POSTURE : POSTURE + torque.shape[0]], torque)
    else:
        _hold_off(observed, known, memory, torque)


@compiled
def judge(observed, known, memory):
    """Take hold or let go if it is time, and see that all is as it has to be."""
    f_Nd, now, wanted = observed.internal_force_desired, observed.clock[0], 0.0
    for k in range(f_Nd.shape[0]):
        wanted += f_Nd[k] / f_Nd.shape[0]
    if wanted < known.touch_force:
        if memory[HOLDS]:
            _let_go(observed, known, memory)
        memory[TOUCHED] = now
        return
    apart = -1
    for i in range(known.radii.shape[0] - 1, -1, -1):
        if observed.contact_force[i, 2] <= 0.0:
            apart = i
    if apart < 0:
        memory[HOLDS], memory[TOUCHED] = 1.0, now
    elif now - memory[TOUCHED] > known.patience:
        memory[VERDICT], memory[TIP] = APART, apart
        return
    square = 0.0
    for k in range(3):
        square += (observed.object_coordinates[k] - observed.object_coordinates_desired[k]) ** 2
    if np.sqrt(square) > known.lost:
        memory[VERDICT] = AWAY


@compiled
def _let_go(observed, known, memory):
    """Remember where the tips stand, if something else than the fingers carries the object."""
    carried, square, nc = 0.0, 0.0, known.radii.shape[0]
    for a in range(3):
        square += known.weight[a] * known.weight[a]
        for i in range(nc):
            for b in range(3):
                carried -= observed.contact_rotation[i, a, b] * observed.contact_force[i, b] * known.weight[a]
    if carried > 0.5 * square:
        memory[VERDICT] = FALLS
        return
    memory[HOLDS] = 0.0
    feet = memory[memory.shape[0] - 6 * nc :].reshape(2, nc, 3)
    set_feet(
        observed.tip_position, observed.object_coordinates, observed.object_rotation,
        known.normals, known.offsets, feet[0], feet[1],
    )  # fmt: skip


@compiled
def set_feet(tips, origin, rotation, face_normals, offsets, feet, normals):
    """Foot of each tip on its face, and the outward normal there, in the world; shape (nc, 3) each."""
    for i in range(tips.shape[0]):
        height = -offsets[i]
        for a in range(3):
            normals[i, a] = 0.0
            for b in range(3):
                normals[i, a] += rotation[a, b] * face_normals[i, b]
            height += (tips[i, a] - origin[a]) * normals[i, a]
        for a in range(3):
            feet[i, a] = tips[i, a] - height * normals[i, a]


@compiled
def _hold_off(observed, known, memory, torque):
    """Springs from the tips to their places before the faces."""
    nc, n = known.radii.shape[0], torque.shape[0]
    feet, forces = memory[memory.shape[0] - 6 * nc :].reshape(2, nc, 3), np.empty((nc, 3))
    for i in range(nc):
        off = known.radii[i] + observed.opening_desired[0]
        for k in range(3):
            forces[i, k] = known.K_tip * (feet[0, i, k] + off * feet[1, i, k] - observed.tip_position[i, k])
            for j in range(n):
                forces[i, k] -= known.D_tip * observed.tip_jacobian[i, k, j] * observed.joint_velocity[j]
    hold_joints(observed.gravity_torque, known.K_v, observed.joint_velocity, torque)
    push_tips(observed.tip_jacobian, forces, torque)
