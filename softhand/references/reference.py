"""Desired object pose and internal force against time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from softhand.numerics.arrays import Array
from softhand.numerics.prepared import prepared
from softhand.references.goal import Desired, Goal
from softhand.references.legs import Legs
from softhand.references.sampled import sample
from softhand.settings.settings import Settings


class Reference(Settings):
    """What the controller is asked for. Its fields are the keys of the section `reference` of a scenario.

    One of your own has `at`:

        class Circle(Reference):
            radius: Positive = 0.005

            def at(self, time, start):
                pose = np.array(start.coordinates)
                pose[:2] += self.radius * np.array([np.sin(time), 1.0 - np.cos(time)])
                return Goal(pose, start.internal_force)

    Those that ship have `start` in its place, with a compiled formula.
    """

    def at(self, time: float, start: Goal) -> Goal:
        """What is asked for at a time.

        Args:
            time: since the start of the run [s]; a little before 0 too, where rates are told from differences.
            start: where the run starts: pose of the object, internal force, opening of the fingers.
        """
        raise NotImplementedError(f"{type(self).__name__} needs a method `at`")

    def start(self, start: Goal) -> Motion:
        """Ready to be asked, from where the run starts.

        Raises:
            ScenarioError: `at` raises, or what it returns cannot be asked for.
        """
        now, twist = np.zeros((3, len(start.row()))), np.zeros((2, 6))
        return Motion(now, twist, sample(type(self).__name__, partial(self.at, start=start), now, twist))


class Motion:
    """A reference on its way from one start.

    Attributes:
        desired: at the time of the last `update`; live.
        phases: name and time of the begin [s] of each named phase, in the order of time.
        now: values, rates and accelerations at that time, as below.
        twist: of the object and its rate, likewise.
        stops: when it comes to rest somewhere [s]; none if it never does, or nobody knows.
    """

    def __init__(
        self,
        now: Array,
        twist: Array,
        move: Callable[[float], None],
        phases: tuple[tuple[str, float], ...] = (),
        stops: tuple[float, ...] = (),
    ) -> None:
        """From two arrays and what fills them for a time [s].

        Args:
            now: values, rates, accelerations, each in the order of `Goal.row`, shape (3, 11 + pairs).
            twist: of the object, world axes, and its rate, shape (2, 6).
            move: fills both.
            phases: as the attribute.
            stops: as the attribute.
        """
        self.phases, self.stops, self._move = phases, stops, move
        self.now, self.twist = now, twist
        self.desired = desired_of(now, twist)

    def update(self, time: float) -> Desired:
        """Set `desired` for a time [s].

        Raises:
            SimulationStopped: a reference of one's own fails.
        """
        self._move(time)
        return self.desired


def desired_of(now: Array, twist: Array) -> Desired:
    """The parts of both as views.

    Args:
        now: values, rates, accelerations, each in the order of `Goal.row`, shape (3, 11 + pairs).
        twist: of the object, world axes, and its rate, shape (2, 6).
    """
    pose, rate, acceleration = now[:, :6]
    opening, carried = now[0, -5:-4], now[0, -4:-3]
    return Desired(pose, rate, acceleration, now[0, 6:-5], twist[0], twist[1], opening, carried, *now[:, -3:])


def motion_along(
    legs: Legs,
    move: Callable[..., None],
    phases: tuple[tuple[str, float], ...] = (),
    stops: tuple[float, ...] = (),
) -> Motion:
    """The motion along legs by a compiled function (legs, now, twist, time)."""
    now, twist = np.zeros((3, legs.rows.shape[1])), np.zeros((2, 6))
    return Motion(now, twist, prepared(move, legs, now, twist, varying=(0.0,)), phases, stops)


def resting(goal: Goal) -> Motion:
    """What asks for the same at all times."""
    now = np.zeros((3, len(goal.row())))
    now[0] = goal.row()
    return Motion(now, np.zeros((2, 6)), lambda time: None, stops=(0.0,))
