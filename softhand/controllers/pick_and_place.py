"""Closing the fingers on an object, lifting it, putting it down and letting go."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from softhand.controllers.controller import Controller, Torque
from softhand.controllers.gains import diagonal
from softhand.controllers.pose import OrientationError
from softhand.controllers.regulation import Regulation
from softhand.controllers.tips import pushed, radii
from softhand.errors import ControllerError
from softhand.numerics.arrays import Array
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain, NonNegative, Positive


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

    def start(self, observation: Observation) -> Any:
        """Law (59) at its start; all tips free, at their feet."""
        law = Regulation(**{key: getattr(self, key) for key in Regulation.model_fields})
        K_v = diagonal("K_v", self.K_v, observation.joint_position.shape[0])
        return _Memory(law, law.start(observation), K_v, False, observation.time, *_feet(observation))

    def torque(self, observation: Observation, memory: Any) -> tuple[Torque, Any]:
        """The law of the class."""
        desired = observation.desired
        memory = self._judged(observation, memory)
        if memory.holds:
            return memory.law.torque(observation, memory.regulation)[0], memory
        places = memory.feet + (radii(observation)[:, None] + desired.opening) * memory.normals
        J = observation.tip_jacobian
        forces = self.K_tip * (places - observation.tip_position) - self.D_tip * (J @ observation.joint_velocity)
        return observation.N_F - memory.K_v * observation.joint_velocity + pushed(J, forces), memory

    def _judged(self, observation: Observation, memory: _Memory) -> _Memory:
        """Take hold or let go if it is time, and see that all is as it has to be.

        Raises:
            ControllerError: it is not.
        """
        wanted = float(np.mean(observation.desired.internal_force)) >= self.touch_force
        if not wanted:
            if memory.holds:
                _check_standing(observation)
                feet, normals = _feet(observation)
                memory = replace(memory, holds=False, feet=feet, normals=normals)
            return replace(memory, touched=observation.time)
        apart = observation.contact_force[:, 2] <= 0.0
        if not apart.any():
            memory = replace(memory, holds=True, touched=observation.time)
        elif observation.time - memory.touched > self.patience:
            i = int(np.argmax(apart))
            gap = 1e3 * -float(observation.deformation[i, 0])
            what = "lost the object" if memory.holds else "does not reach the object"
            raise _given_up(
                observation,
                f"{observation.tip_names[i]} {what}: it is {gap:.3g} mm off after {self.patience:g} s of waiting",
            )
        away = float(np.linalg.norm(observation.object_position - observation.desired.coordinates[:3]))
        if away > self.lost:
            raise _given_up(
                observation, f"the object slipped out: it is {1e3 * away:.3g} mm from where it is asked to be"
            )
        return memory


@dataclass(frozen=True)
class _Memory:
    law: Regulation
    regulation: Any
    K_v: Array
    holds: bool
    touched: float
    """When all tips touched for the last time, or did not have to [s]."""
    feet: Array
    """Nearest points of the faces to the tips when they were last let go, in the world [m], shape (nc, 3)."""
    normals: Array
    """Outward normals there, in the world, shape (nc, 3)."""


def _feet(observation: Observation) -> tuple[Array, Array]:
    """Foot of each tip on its face, and the outward normal there, in the world; shape (nc, 3) each."""
    normals = np.array([tip.face.normal for tip in observation.fingertips]) @ observation.object_rotation.T
    offsets = np.array([tip.face.offset for tip in observation.fingertips])
    heights = np.einsum("ik,ik->i", observation.tip_position - observation.object_position, normals) - offsets
    return observation.tip_position - heights[:, None] * normals, normals


def _check_standing(observation: Observation) -> None:
    """Something else than the fingers carries the object before they let go.

    Raises:
        ControllerError: the fingers still carry more than half of its weight.
    """
    weight = observation.object_mass * observation.gravity
    force = np.einsum("iab,ib->a", observation.contact_rotation, observation.contact_force[:, :3])
    if -float(force @ weight) > 0.5 * float(weight @ weight):
        raise _given_up(
            observation,
            "the object does not stand: at the release the fingers still carry more than half of its weight",
        )


def _given_up(observation: Observation, what: str) -> ControllerError:
    return ControllerError(
        f"controller 'PickAndPlace' gave up at t = {observation.time:g} s: {what}.",
        controller="PickAndPlace", reason="given up", time=observation.time,
    )  # fmt: skip
