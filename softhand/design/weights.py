"""Weights of a linear-quadratic regulator, by name."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from softhand.controllers.gains import diagonal
from softhand.errors import ScenarioError
from softhand.numerics.arrays import Array
from softhand.settings.settings import Gain, Positive, Settings

Torque = Positive | Annotated[tuple[Positive, ...], Field(min_length=1)]


class Weights(Settings):
    """What a unit squared of each thing costs a second; one number, or one for each. Those left out cost nothing.

    A natural choice is 1 / (what is still good)^2: the defaults of pose, force and torque are those of 1 mm, 1 deg,
    0.2 N and 0.02 N m.
    """

    object_position: Gain = 1e6
    """Of the position error, along axes of the object [1/m^2]."""
    object_orientation: Gain = 3300.0
    """Of the orientation error, about axes of the object [1/rad^2]."""
    internal_force: Gain = 25.0
    """Of the error of the internal forces [1/N^2]."""
    object_velocity: Gain = 0.0
    """Of the velocity [s^2/m^2]."""
    object_angular_velocity: Gain = 0.0
    """Of the angular velocity [s^2/rad^2]."""
    internal_force_rate: Gain = 0.0
    """Of the rate of the internal forces [s^2/N^2]."""
    joint_position: Gain = 0.0
    """Of joints away from where they rest [1/rad^2 or 1/m^2]."""
    joint_velocity: Gain = 0.1
    """Of the velocity of the joints [s^2/rad^2 or s^2/m^2]."""
    torque: Torque = 2500.0
    """Of the torques beyond those of rest [1/(N m)^2 or 1/N^2]; above 0."""
    object_position_integral: Gain = 0.0
    """Of the position error summed over time [1/(m s)^2]; above 0 it is fed back."""
    object_orientation_integral: Gain = 0.0
    """Of the orientation error summed over time [1/(rad s)^2]; likewise."""
    internal_force_integral: Gain = 0.0
    """Of the error of the internal forces summed over time [1/(N s)^2]; likewise."""

    def diagonal(self, name: str, size: int) -> Array:
        """One of them, shape (size,).

        Raises:
            ScenarioError: neither one number nor `size` of them.
        """
        try:
            return diagonal(name, getattr(self, name), size)
        except ScenarioError as error:
            count = np.size(getattr(self, name))
            raise ScenarioError(
                f"weights.{name}: got {count} numbers; give one, or {size}.", key=f"weights.{name}", value=error.value
            ) from None
