"""Set points: joints are sent to positions, or to velocities, and their servos do the rest."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from pydantic import model_validator

from softhand.controllers.controller import Controller
from softhand.controllers.gains import diagonal
from softhand.errors import ScenarioError
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.sensing.observation import Observation
from softhand.settings.settings import NonNegative, Vector


class SetPoints(Controller):
    """Set points of the joints along a smooth way, as a hand takes them that has servos of its own.

        q_d = q_0 + offset + s(t) (position - q_0),   or   v_d = s(t) velocity
        s = 10 x^3 - 15 x^4 + 6 x^5,   x = t / duration, at most 1

    q_0 are the joint positions at the start. Nothing of the object or of the contacts is measured: a squeeze is as
    strong as the set points lie beyond the joints, offset times the stiffness of the servos. Needs `actuation.servo` of
    kind "position", or "velocity".
    """

    position: Vector | None = None
    """Where the joints are sent to, one number a joint; where they start if not given [rad or m]."""
    offset: float | Vector = 0.0
    """What is added to the way from its begin on, one number for all joints or one for each [rad or m]."""
    velocity: Vector | None = None
    """Velocities in place of positions, one number a joint [rad/s or m/s]."""
    duration: NonNegative = 1.0
    """Time on the way; 0 for at once [s]."""

    @model_validator(mode="after")
    def _is_one_of_both(self) -> SetPoints:
        if self.velocity is not None and (self.position is not None or np.any(self.offset)):
            raise ValueError("velocity: set points are positions or velocities; remove position and offset, or this.")
        return self

    @property
    def commands(self) -> Literal["torque", "position", "velocity"]:
        """Positions, or velocities where they are given."""
        return "position" if self.velocity is None else "velocity"

    @property
    def formula(self) -> Any:  # type: ignore[override]
        """The law of the class."""
        return set_points

    def start(self, observation: Observation) -> Any:
        """When it starts, where set points begin and where they end."""
        n, here = observation.joint_position.shape[0], observation.joint_position
        if self.velocity is not None:
            begin, end = np.zeros(n), _each("velocity", self.velocity, n)
        else:
            offset, end = diagonal("offset", self.offset, n), here
            if self.position is not None:
                end = _each("position", self.position, n)
            begin, end = here + offset, end + offset
        return np.concatenate([[observation.time], begin, end])


@compiled
def set_points(observed, settings, memory, torque):
    """The law of the class; `memory` as `start` returns it."""
    n, duration = torque.shape[0], settings.duration
    x = min((observed.clock[0] - memory[0]) / duration, 1.0) if duration > 0.0 else 1.0
    s = x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)
    for j in range(n):
        torque[j] = memory[1 + j] + s * (memory[1 + n + j] - memory[1 + j])


def _each(key: str, values: Vector, n: int) -> Array:
    """One number a joint."""
    if len(values) != n:
        raise ScenarioError(
            f"controller.{key}: got {len(values)} numbers, but the hand has {n} joints; give one for each.",
            key=f"controller.{key}", value=values,
        )  # fmt: skip
    return np.array(values)
