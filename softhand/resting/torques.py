"""The torques of joints that stand still: held, or those of a controller and what it remembers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.probe import Probe
from softhand.closed_loop.feedback import numbers_of, rebuilt
from softhand.controllers.controller import Controller
from softhand.numerics.arrays import Array
from softhand.plant.state import State

_STEP = 1e-6
"""Of differences in the memory."""
_FAR, _CALLS, _SETTLED = 1e-4, 8, 1e-12
"""Displacement beside which a memory is seen to drift, over how many calls, and by what share of it [rad, m]."""


class Answer(NamedTuple):
    """What is commanded at one state."""

    command: Array
    """Before effort limits [N m, N], shape (n,)."""
    memory: Any
    """Of the controller after it has spoken."""
    change: Array
    """By how much what matters of its memory is off rest, shape (m,)."""


class Torques(ABC):
    """What the joints are given.

    Attributes:
        sizes: of the numbers of the memory that are sought beside the state, shape (m,).
    """

    sizes: Array = np.zeros(0)

    @abstractmethod
    def ask(self, state: State, memory: Any, more: Array) -> Answer:
        """At a state without velocity.

        Args:
            state: with the contacts of the plant evaluated there.
            memory: of the controller, as the way up to here left it.
            more: put on the numbers of it that are sought, once it has seen the state, shape (m,).
        """

    @abstractmethod
    def go_on(self) -> None:
        """The clock of a controller runs on."""

    @abstractmethod
    def set_time(self, time: float) -> None:
        """The reference is followed to a time [s]."""


class HeldTorques(Torques):
    """The same at each state."""

    def __init__(self, torque: Array) -> None:
        self._torque = torque

    def ask(self, state: State, memory: Any, more: Array) -> Answer:
        """Those that are held."""
        return Answer(self._torque, memory, more)

    def go_on(self) -> None:
        """There is no clock."""

    def set_time(self, time: float) -> None:
        """There is no clock."""


class ControllerTorques(Torques):
    """Those of a controller.

    What it remembers follows the way, as it is asked at each point of it, until it has seen the point: an estimate that
    sums up joint motions stays right. Numbers that go on changing where the state does not, as those of a filter or of
    an integral, are sought together with the state, if the torque depends on them.

    Args:
        controller: of the run.
        probe: of the plant, with what is asked for.
        state: where the way begins.
        memory: there.
        period: between two calls [s].
        ways: displacements of the state to see what the memory depends on, as functions of a length.
    """

    def __init__(
        self, controller: Controller, probe: Probe, state: State, memory: Any, period: float, ways: list[Any]
    ) -> None:
        self._controller, self._probe, self._period = controller, probe, period
        self._time, self._late = state.time, 0.0
        self._chosen: NDArray[np.int64] = np.zeros(0, np.int64)
        self._calls = 0
        held = _numbers(memory)
        if len(held):
            self._choose(state, memory, held, ways)

    def ask(self, state: State, memory: Any, more: Array) -> Answer:
        """What it answers, once its memory has seen the state."""
        for calls in range(self._calls):
            _, memory = self._say(state, memory, calls)
        if not len(self._chosen):
            command, after = self._say(state, memory, self._calls)
            return Answer(command, after, more)
        values = _numbers(memory)
        values[self._chosen] += more
        command, after = self._say(state, rebuilt(memory, iter(values)), self._calls)
        return Answer(command, after, (_numbers(after) - values)[self._chosen])

    def go_on(self) -> None:
        """By the calls of a point."""
        self._late += (1 + self._calls) * self._period

    def set_time(self, time: float) -> None:
        """The clock is that of the reference, and late by the calls before."""
        self._time = time

    def before(self, state: State, memory: Any) -> Any:
        """The memory with which it is asked at the time of a state, having been asked a period before."""
        self._time, self._late = state.time, -self._period
        return self._say(state, memory, 0)[1]

    def _say(self, state: State, memory: Any, calls: int) -> tuple[Array, Any]:
        observation = self._probe.at(state, self._time + self._late + calls * self._period)
        command, after = self._controller.torque(observation, memory)
        return np.array(command, dtype=float), after

    def _choose(self, state: State, memory: Any, held: Array, ways: list[Any]) -> None:
        """Find how many calls it takes until the memory has seen a state, and which numbers then still change."""

        def trail(beside: State) -> Array:
            rows, after = [held], memory
            for calls in range(_CALLS):
                _, after = self._say(beside, after, calls)
                rows.append(_numbers(after))
            return np.array(rows)

        unmoved, size = trail(state), np.maximum(1.0, np.abs(held))
        moved = np.array([trail(way(_FAR)) - unmoved for way in ways])
        differs = np.any(np.abs(moved - moved[:, -1:]) > _SETTLED * size, axis=0)
        places = np.flatnonzero(differs[-3])
        settles = np.any(differs[:, ~differs[-3]], axis=1)
        self._calls = int(np.count_nonzero(settles))
        if not len(places):
            return

        def answer(values: Array) -> Array:
            command, after = self._say(state, rebuilt(memory, iter(values)), 0)
            return np.concatenate([command, _numbers(after)[places]])

        moves = _STEP * np.eye(len(held))[places]
        both = np.array([(answer(held + move) - answer(held - move)) / (2.0 * _STEP) for move in moves])
        n = both.shape[1] - len(places)
        matters, to_others = np.any(both[:, :n] != 0.0, axis=1), both[:, n:] != 0.0
        for _ in places:
            matters |= np.any(to_others[:, matters], axis=1)
        self._chosen = places[matters]
        self.sizes = size[self._chosen]


def _numbers(memory: Any) -> Array:
    return np.concatenate([[], *numbers_of(memory)])
