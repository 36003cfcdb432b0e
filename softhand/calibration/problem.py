"""Residuals of a log by piece, and their derivatives by the start of each piece and by the parameters, in threads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np

from softhand.assembly.resolve import Setup
from softhand.calibration.bench import Bench, Linear, Run
from softhand.calibration.handing_on import Kick
from softhand.calibration.layout import Layout
from softhand.calibration.log import Log
from softhand.calibration.parameters import Parameter, values_of
from softhand.derivatives.model import beyond
from softhand.model.configuration import integrate
from softhand.numerics.arrays import Array
from softhand.plant.state import State

T = TypeVar("T")


class Problem:
    """The pieces of a log, and what a scenario predicts of them.

    Attributes:
        layout: of the pieces.
        log: of which.
        setup: of the scenario.
        parameters: that are fitted.
        step: of the stepper [s].
        world: hand and object.
        can_slip: whether friction has a limit at any contact.
        n_states: numbers of a state.
        remembered: row and column of the numbers of z that belong to it.
        sticks: whether no tip slips, whatever its friction; seen by `at`.
        kicks: with which the pieces go on; None where one starts afresh.

    Args:
        log: checked against the hand.
        setup: as the attribute.
        parameters: likewise.
        length: of a piece [s].
        threads: at work at the same time.

    Raises:
        ScenarioError: the stepper is another than midpoint, or its step does not fit into the period of the log.
    """

    def __init__(self, log: Log, setup: Setup, parameters: Sequence[Parameter], length: float, threads: int) -> None:
        self.log, self.setup, self.parameters = log, setup, list(parameters)
        self.layout = layout = Layout(log, setup, parameters, length)
        self.pieces, self.names, self.channels, self.channel = (
            layout.pieces, layout.names, layout.channels, layout.channel,
        )  # fmt: skip
        self.period, self.step = layout.period, layout.stepper.step
        self.sticks = False
        self.kicks: list[Kick | None] = [None] * len(self.pieces)
        self._threads = max(1, min(threads, len(self.pieces)))
        x = np.array([one.to_x(one.value) for one in self.parameters])
        self._benches = [Bench(layout, setup, self.parameters, x) for _ in range(self._threads)]
        first = self._benches[0]
        self.n_states, self.remembered = first.n_states, first.remembered
        self.world, self.can_slip = first.plant.world, first.plant.can_slip

    @property
    def friction(self) -> float:
        """The largest of the tips."""
        return self._benches[0].friction

    def values(self, x: Array) -> Array:
        """Values of the parameters at some x."""
        return values_of(self.parameters, x)

    def at(self, x: Array) -> None:
        """Be the problem with these parameters."""
        self._each(lambda bench, _: bench.become(x, self.sticks), range(self._threads))

    def runs(self, states: Sequence[State], which: Sequence[int]) -> list[Run]:
        """Some pieces that begin at these states; NaN where one does not come to its end."""
        return self._each(lambda bench, k: bench.run(k, states[k], self.kicks[k]), which)

    def linear(self, states: Sequence[State], which: Sequence[int]) -> list[Linear]:
        """Likewise with their derivatives."""
        return self._each(lambda bench, k: bench.linear(k, states[k], self.kicks[k]), which)

    def hand_on(self, runs: Sequence[Run | Linear], which: Sequence[int]) -> None:
        """Let each piece go on with the kick of the one before."""
        for one, k, after in zip(runs[:-1], which[:-1], which[1:], strict=True):
            if after == k + 1:
                self.kicks[after] = one.kick if one.kick.is_finite else None

    def go(self, state: State, first: int, count: int) -> State:
        """On from a state at a sample of the log, so many periods."""
        return self._benches[0].go(state, first, count)

    def defect(self, state: State, end: State) -> Array:
        """By how much a state is beyond the end of the piece before it, in tangent coordinates, shape (states,)."""
        rows, columns = self.remembered.T
        flat = np.array([[*one.q, *one.v, *one.z[rows, columns]] for one in (state, end)])
        return np.asarray(beyond(self._benches[0].plant, flat[:1], flat[1])[0])

    def moved(self, state: State, dx: Array) -> State:
        """A state moved in its tangent coordinates."""
        nv, after = self.world.nv, state.copy()
        integrate(self.world.joints, state.q, dx[:nv], 1.0, after.q)
        after.v[:] += dx[nv : 2 * nv]
        rows, columns = self.remembered.T
        after.z[rows, columns] += dx[2 * nv :]
        return after

    def time(self, k: int) -> float:
        """At which a piece begins [s]."""
        return self.layout.time(k)

    def times(self, k: int) -> Array:
        """Of each row of the residuals of a piece [s]."""
        return self.layout.times(k)

    def _each(self, work: Callable[[Bench, int], T], which: Sequence[int]) -> list[T]:
        if self._threads == 1:
            return [work(self._benches[0], k) for k in which]
        parts = np.array_split(np.asarray(list(which)), self._threads)
        with ThreadPoolExecutor(self._threads) as pool:
            found = list(
                pool.map(lambda pair: [work(pair[0], int(k)) for k in pair[1]], zip(self._benches, parts, strict=True))
            )
        return [one for part in found for one in part]
