"""The classical Runge-Kutta method: fourth order, four evaluations a step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.steppers.flow import Flow
from softhand.steppers.stepper import Integration, Stepper, check_friction


class RungeKutta4(Stepper):
    """Classical fourth-order Runge-Kutta on (q, v, z), quaternions normalised after each step.

    Explicit: it needs h below 2.8 / (highest contact frequency). Use `midpoint` for stiff tips.
    """

    stable_up_to = 2.8

    def start(self, plant: Plant) -> Integration:
        """Ready to integrate this plant."""
        check_friction(self, plant.world.mechanics.friction)
        return _RungeKuttaIntegration(plant, self.step)


class _RungeKuttaIntegration(Integration):
    def __init__(self, plant: Plant, step: float) -> None:
        super().__init__(plant)
        self._plant, self._flow, self._step = plant, Flow(plant), step
        self._y, self._stage = np.zeros(self._flow.size), np.zeros(self._flow.size)
        self._slopes = np.zeros((4, self._flow.size))

    def advance(self, state: State, torque: NDArray[np.float64]) -> None:
        flow, y, stage, k, h = self._flow, self._y, self._stage, self._slopes, self._step
        self._plant.settle(state)
        flow.gather(state, y)
        flow.rate(y, torque, k[0])
        for i, fraction in ((1, 0.5), (2, 0.5), (3, 1.0)):
            np.multiply(k[i - 1], fraction * h, out=stage)
            stage += y
            flow.rate(stage, torque, k[i])
        y += (h / 6.0) * (k[0] + 2.0 * k[1] + 2.0 * k[2] + k[3])
        flow.scatter(y, state)
        self._plant.settle(state, h)
