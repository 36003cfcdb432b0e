"""The law below actions on joints: torques, and springs to joint angles."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.controllers.controller import Controller
from softhand.numerics.compiled import compiled
from softhand.sensing.observation import Observation
from softhand.settings.settings import NonNegative


class Commanded(Controller):
    """Joint torques as they are told, beside what the weight of the hand needs, and springs to joint positions.

        tau = gravity N_F + tau_told + K_p (q_told - q) - K_d q'

    tau_told and q_told are the memory, which others write.
    """

    gravity: NonNegative = 1.0
    """Share of the hand's own weight that is held."""
    K_p: NonNegative = 0.0
    """Stiffness [N m/rad or N/m]."""
    K_d: NonNegative = 0.0
    """Damping [N m s/rad or N s/m]."""

    @property
    def formula(self) -> Any:  # type: ignore[override]
        """The law of the class."""
        return commanded

    def start(self, observation: Observation) -> Any:
        """Torques of nothing, and the joint positions of the start."""
        return np.concatenate([np.zeros_like(observation.joint_position), observation.joint_position])


@compiled
def commanded(observed, settings, memory, torque):
    """The law of the class."""
    n = torque.shape[0]
    for j in range(n):
        torque[j] = (
            settings.gravity * observed.gravity_torque[j] + memory[j] - settings.K_d * observed.joint_velocity[j]
        )
        torque[j] += settings.K_p * (memory[n + j] - observed.joint_position[j])
