"""Plant and controller together, linear about a state: how fast small motions grow."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from softhand.closed_loop.feedback import Feedback, differentiate
from softhand.closed_loop.linearize import LinearModel, linearize_plant
from softhand.closed_loop.start import HeldStart
from softhand.numerics.arrays import Array

ROUNDING = 1e-6
"""A growth within this of zero is zero [1/s]: some motion stays as it is."""


@dataclass(frozen=True, eq=False)
class Loop:
    """The linear closed loop.

    Attributes:
        model: the plant.
        feedback: the controller.
    """

    model: LinearModel
    feedback: Feedback

    def growth(self) -> float:
        """Rate at which the fastest growing motion grows without sampling [1/s]; below zero all motions die out.

        NaN for a controller whose torque depends on its memory of earlier samples: it has no law without sampling.
        """
        return growth(self.model, self.feedback.by_state) if self.feedback.is_smooth else math.nan

    def held_growth(self, period: float) -> float:
        """The same with the torque held for a period [s], and what the controller remembers from one to the next."""
        return float(np.log(np.max(np.abs(np.linalg.eigvals(self.step(period))))) / period)

    def step(self, period: float) -> Array:
        """What becomes of (x, m) in one period [s], m the memory of the controller, shape (s + m, s + m)."""
        (move, push), control = held(self.model, period), self.feedback
        return np.block(
            [
                [move + push @ control.by_state, push @ control.by_memory],
                [control.memory_by_state, control.memory_by_memory],
            ]
        )


def close_loop(start: HeldStart) -> Loop:
    """The loop of a scenario about its start, which is asked to stay there."""
    feedback = differentiate(start.controller, start.probe, start.state, start.period)
    return Loop(linearize_plant(start.probe.plant, start.state, feedback.torque), feedback)


def growth(model: LinearModel, by_state: Array) -> float:
    """Largest real part of the eigenvalues of A + B K [1/s], K the feedback of the state, shape (n, s)."""
    return float(np.max(np.linalg.eigvals(model.A + model.B @ by_state).real))


def held(model: LinearModel, period: float) -> tuple[Array, Array]:
    """Phi and Gamma of x(t + period) = Phi x(t) + Gamma u, the torque held for a period [s]."""
    states, inputs = model.B.shape
    both = np.zeros((states + inputs, states + inputs))
    both[:states, :states], both[:states, states:] = model.A, model.B
    result = expm(period * both)
    return result[:states, :states], result[:states, states:]
