"""Opposing fingers: two tips pull towards each other, and nothing is measured but the joints."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.controllers.controller import Controller, Torque
from softhand.controllers.gains import diagonal
from softhand.controllers.tips import attraction, last_axis, need_fingers, pushed, radii, strength
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

    def start(self, observation: Observation) -> Any:
        """The damping as an array, q_F(0), e_i as rows, and f_d for a squeeze of 1 N."""
        need_fingers("opposing", observation, 2, 2)
        e = np.stack([spin.T @ last_axis(spin) for spin in observation.tip_angular_jacobian])
        C = diagonal("damping", self.damping, observation.joint_position.shape[0])
        per_newton = strength(observation, np.ones_like(observation.internal_force))
        return C, observation.joint_position.copy(), e, per_newton

    def torque(self, observation: Observation, memory: Any) -> tuple[Torque, Any]:
        """The law of the class."""
        C, q_start, e, per_newton = memory
        r = radii(observation)
        f_d = per_newton * observation.desired.internal_force[0]
        forces = f_d / r.sum() * attraction(observation.tip_position) - 0.5 * self.mass * observation.gravity
        turned = e @ observation.joints_from(q_start)
        tau = pushed(observation.tip_jacobian, forces) - (r**2 / self.gamma * turned) @ e
        return tau + observation.N_F - C * observation.joint_velocity, memory
