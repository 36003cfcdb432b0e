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
_FAR, _CALLS, _SETTLED = 1e-4, 5, 1e-12
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


class HeldTorques(Torques):
    """The same at each state."""

    def __init__(self, torque: Array) -> None:
        self._torque = torque

    def ask(self, state: State, memory: Any, more: Array) -> Answer:
        """Those that are held."""
        return Answer(self._torque, memory, more)

    def go_on(self) -> None:
        """There is no clock."""


class ControllerTorques(Torques):
    """Those of a controller.

    What it remembers follows the way, as it is asked at each point of it: an estimate that sums up joint motions stays
    right. A memory that does not rest by itself where the state does, as that of a filter or of an integral, is sought
    together with the state. These are the numbers that change with the state, and by which the torque does.

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
        self._controller, self._probe, self._period, self._clock = controller, probe, period, state.time
        self._chosen: NDArray[np.int64] = np.zeros(0, np.int64)
        held = _numbers(memory)
        if len(held):
            self._choose(state, memory, held, ways)

    def ask(self, state: State, memory: Any, more: Array) -> Answer:
        """What it answers, having seen the state once before if it has a memory to be sought."""
        if not len(self._chosen):
            command, after = self._say(state, memory, 0)
            return Answer(command, after, more)
        _, memory = self._say(state, memory, 0)
        values = _numbers(memory)
        values[self._chosen] += more
        command, after = self._say(state, rebuilt(memory, iter(values)), 1)
        return Answer(command, after, (_numbers(after) - values)[self._chosen])

    def go_on(self) -> None:
        """By two calls."""
        self._clock += 2.0 * self._period

    def before(self, state: State, memory: Any) -> Any:
        """The memory with which it is asked at the time of a state, having been asked a period before."""
        self._clock = state.time - self._period
        return self._say(state, memory, 0)[1]

    def _say(self, state: State, memory: Any, calls: int) -> tuple[Array, Any]:
        observation = self._probe.at(state, self._clock + calls * self._period)
        command, after = self._controller.torque(observation, memory)
        return np.array(command, dtype=float), after

    def _choose(self, state: State, memory: Any, held: Array, ways: list[Any]) -> None:
        """The numbers that go on changing where the state stays, if it stays elsewhere, and that the torque sees."""

        def drift(beside: State) -> Array:
            first, last = memory, memory
            for calls in range(_CALLS):
                _, last = self._say(beside, last, calls)
                first = last if calls == 0 else first
            return _numbers(last) - _numbers(first)

        unmoved, size = drift(state), np.maximum(1.0, np.abs(held))
        drifts = [np.abs(drift(way(_FAR)) - unmoved) > _SETTLED * size for way in ways]
        places = np.flatnonzero(np.any(drifts, axis=0))

        def answer(values: Array) -> Array:
            command, after = self._say(state, rebuilt(memory, iter(values)), 0)
            return np.concatenate([command, _numbers(after)[places]])

        moves = _STEP * np.eye(len(held))[places]
        both = np.array([(answer(held + move) - answer(held - move)) / (2.0 * _STEP) for move in moves])
        if not len(places):
            return
        n = both.shape[1] - len(places)
        matters, to_others = np.any(both[:, :n] != 0.0, axis=1), both[:, n:] != 0.0
        for _ in places:
            matters |= np.any(to_others[:, matters], axis=1)
        self._chosen = places[matters]
        self.sizes = size[self._chosen]


def _numbers(memory: Any) -> Array:
    return np.concatenate([[], *numbers_of(memory)])
