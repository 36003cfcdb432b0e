"""Opposing fingers: two tips pull towards each other, and nothing is measured but the joints."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from softhand.controllers.blocks import hold_joints, push_tips
from softhand.controllers.controller import Controller
from softhand.controllers.gains import diagonal
from softhand.controllers.tips import attract, last_axis, moved, need_fingers, radii, strength
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain, NonNegative, Positive


class Opposing(Controller):
    """Opposing fingers, in the manner of Nguyen and Arimoto: stable pinching by two fingers without any sensing.

        u_i = f_d / (r_1 + r_2) J_i^T (x_j - x_i) - r_i N_i e_i - C q_i' + N_F,i - J_i^T m g / 2
        N_i = (r_i / gamma) e_i^T (q_i - q_i(0))

    x_i is the centre of the flat face, J_i its Jacobian. Each tip is pulled towards the other: a squeeze of
    f_d |x_1 - x_2| / (r_1 + r_2). f_d is chosen so that this is f_Nd at the start. e_i is 1 for the joints that turn
    the tip as its last joint does, 0 for those across it, so that e_i^T (q_i - q_i(0)) is the turn of the tip; it
    stands for the tangential force. Structure: certain; the details of the original, which is planar, are not. The
    last two terms, gravity of the fingers and of an object of known mass, are added: the original moves in a level
    plane. Two fingers only. The pose is not regulated: it comes to rest where the pull has no moment.
    """

    gamma: Positive = 2e-5
    """Softness of the tips' attitude [m^2 rad/(N m)]; r_i^2 / gamma is the stiffness of tip i."""
    mass: NonNegative = 0.2
    """Mass of the object, which the fingers carry in equal parts [kg]."""
    damping: Gain = 0.005
    """Damping C of the joints [N m s/rad or N s/m], one number or one a joint."""

    @property
    def formula(self) -> Any:  # type: ignore[override]
        """The law of the class."""
        return opposing

    def constants(self, observation: Observation) -> Gains:
        """The damping as an array, and what is known of the tips."""
        C = diagonal("damping", self.damping, observation.joint_position.shape[0])
        r, pull = radii(observation), -0.5 * self.mass * observation.gravity
        return Gains(C, self.gamma, r, pull, observation.is_continuous.copy())

    def start(self, observation: Observation) -> Any:
        """q_F(0), e_i as rows, and f_d / sum(r) for a squeeze of 1 N."""
        need_fingers("opposing", observation, 2, 2)
        e = [spin.T @ last_axis(spin) for spin in observation.tip_angular_jacobian]
        per_newton = strength(observation, np.ones_like(observation.internal_force)) / radii(observation).sum()
        return np.concatenate([observation.joint_position, *e, [per_newton]])


class Gains(NamedTuple):
    """The settings of `Opposing`, and what is known of the tips."""

    C: Array
    gamma: float
    radii: Array
    lift: Array
    """What a finger carries of the object [N], shape (3,)."""
    is_continuous: AnyArray


@compiled
def opposing(observed, known, memory, torque):
    """The law of the class; `memory` as `start` returns it."""
    n, x = torque.shape[0], observed.tip_position
    forces = np.empty((2, 3))
    for k in range(3):
        forces[0, k] = forces[1, k] = known.lift[k]
    attract(x, memory[3 * n] * observed.internal_force_desired[0], forces)
    hold_joints(observed.gravity_torque, known.C, observed.joint_velocity, torque)
    push_tips(observed.tip_jacobian, forces, torque)
    for i in range(2):
        e, turned = memory[n + i * n : 2 * n + i * n], 0.0
        for j in range(n):
            turned += e[j] * moved(observed.joint_position[j], memory[j], known.is_continuous[j])
        for j in range(n):
            torque[j] -= known.radii[i] * known.radii[i] / known.gamma * turned * e[j]
