"""What a stepper is: it carries a state over one time step under held torques."""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import inf
from typing import ClassVar

import numpy as np

from softhand.errors import ScenarioError
from softhand.numerics.arrays import AnyArray, Array
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.settings.settings import Positive, Settings


class Stepper(Settings, ABC):
    """Settings of a time integration. `start` gives the object that does the work."""

    step: Positive = 0.001
    """Time step [s]; a whole number of steps makes a control period."""

    stable_up_to: ClassVar[float] = inf
    """Largest product of the step and the fastest angular frequency of the contacts at which a motion does not grow."""

    holds_friction: ClassVar[bool] = False
    """Whether it knows dry friction of joints, which is no part of `Plant.acceleration`: see `resistance.hold`."""

    @abstractmethod
    def start(self, plant: Plant) -> Integration:
        """Ready to integrate this plant, with its own scratch memory."""


def check_friction(stepper: Stepper, friction: Array) -> None:
    """Dry friction of joints needs a stepper that knows it.

    Raises:
        ScenarioError: there is some, and this one does not.
    """
    if np.any(friction) and not stepper.holds_friction:
        name = type(stepper).__name__
        raise ScenarioError(
            f"hand.joints.friction: the stepper {name} does not know dry friction of joints, as it integrates an "
            'acceleration that is a function of the state; take stepper.name = "midpoint" or "semi-implicit-euler", or '
            "hand.joints.damping in its place.",
            key="hand.joints.friction", value=friction.tolist(),
        )  # fmt: skip


class Integration(ABC):
    """A stepper at work on one plant. Fastest with one `State` that it moves on again and again.

    Attributes:
        torque: room for joint torques [N m], which `advance` takes without a copy, shape (n,).
    """

    def __init__(self, plant: Plant) -> None:
        self.torque = np.zeros(plant.world.n_joints)

    @abstractmethod
    def advance(self, state: State, torque: Array) -> None:
        """Move `state` on by one step, in place, with the joint torques [N m] held, shape (n,)."""

    def carry(self) -> dict[str, AnyArray]:
        """What this stepper takes from one step into the next, as copies; most take nothing."""
        return {}

    def resume(self, carried: dict[str, AnyArray]) -> None:  # noqa: B027
        """Go on with what `carry` gave at the state that comes next."""

    def restart(self) -> None:  # noqa: B027  most steppers have nothing to forget
        """Forget the steps before, so that the next one starts from its state alone."""
