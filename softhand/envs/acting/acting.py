"""What an action is made into: what the law at the bottom of a world is told for the next control periods."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from softhand.batch.worlds import Worlds
from softhand.controllers.controller import Controller
from softhand.numerics.arrays import AnyArray, Array


class Acting(ABC):
    """One kind of action, for worlds side by side.

    Args:
        worlds: which act.
        goals: poses that are asked for, live, shape (worlds, 7).
        begins_open: whether the fingers start off the object.

    Attributes:
        size: numbers of an action, each from -1 to 1.
        limits: largest of each number of `asked`, shape (numbers,).
    """

    size: int
    limits: Array

    law: ClassVar[Controller | None] = None
    """The law at the bottom; that of the scenario if None."""
    holds: ClassVar[bool] = False
    """Whether the law holds the object by itself."""

    def __init__(self, worlds: Worlds, goals: Array, begins_open: bool) -> None:
        self.worlds, self.goals, self.begins_open = worlds, goals, begins_open

    @staticmethod
    def commands(joints: int) -> int:
        """How many numbers the law is told, of a hand of so many joints."""
        return 0

    @abstractmethod
    def begin(self, index: int) -> None:
        """One world is at its start."""

    @abstractmethod
    def act(self, actions: Array, goes: AnyArray) -> None:
        """Take the next actions.

        Args:
            actions: shape (worlds, size).
            goes: which worlds go on, shape (worlds,); the actions of the others mean nothing.
        """

    @abstractmethod
    def asked(self) -> Array:
        """What is asked for now, a part of the observation, shape (worlds, numbers)."""


def stepped(now: Array, change: Array, goes: AnyArray, lowest: Array | float, highest: Array | float) -> None:
    """now += change within limits, in the worlds that go on."""
    now[goes] = np.clip(now[goes] + change[goes], lowest, highest)
