"""Steps of Levenberg and Marquardt over the parameters and the states where the pieces begin."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from softhand.calibration.bench import Linear, Run
from softhand.calibration.elimination import Eliminated, eliminate, step_of
from softhand.calibration.problem import Problem
from softhand.calibration.settling import settled
from softhand.calibration.weights import Weights, noise_left, slack_of
from softhand.errors import MeasurementError, SofthandError
from softhand.numerics.arrays import Array
from softhand.plant.state import State

_MOST_TRIES, _STILL = 100, 1e-3
_TIGHTER, _LOOSER = 0.1, 3.0  # of the slack, after a step, and after a search that gets stuck
_FIRST_DAMPING, _LEAST_DAMPING, _STUCK = 1e-2, 1e-12, 1e4
_TRUSTED = 0.1  # damping below which a good step tightens the slack
_WEIGHINGS, _LOOSENINGS = 4, 4
_LITTLE = 0.03  # share of the sum by which a step lowers it at the end of a level of slack
_FLAT, _FLAT_TRIES = 1e-3, 15  # share of the sum that so many tries gain where it is flat
_NEAR = 1.0  # square of standard deviations, a parameter, up to which a flat sum is at rest


class Search:
    """A point, the pieces there, and steps from it.

    Attributes:
        loose: how many times the least slack is allowed between two pieces each.
        steps: that were done.
        tries: that were made.
        tight: the least slack of each state.
        free: parameters that move, shape (p,).
    """

    def __init__(
        self, problem: Problem, x: Array, states: Sequence[State], sigma: Array, which: Sequence[int], hold: bool,
        progress: Callable[[int, float], None] | None,
    ) -> None:  # fmt: skip
        self.problem, self.which, self.sigma, self._progress = problem, list(which), sigma, progress
        self.x, self.bounds, self.free = x.copy(), bounds_of(problem), np.full(len(x), not hold)
        self.steps, self.tries = 0, 0
        self.tight = slack_of(problem)
        problem.at(self.x)
        self.settle(states)

    @property
    def weights(self) -> Weights:
        """Of the sum of squares, now."""
        return Weights(self.sigma, np.outer(self.loose, self.tight))

    def settle(self, states: Sequence[State]) -> None:
        """Begin anew at some states, settled, with as much slack as the pieces are apart."""
        self.states = settled(self.problem, states, self.sigma, self.which)
        self.restrict(self.which)

    def restrict(self, which: Sequence[int]) -> None:
        """Go on with these pieces."""
        self.which = list(which)
        self._be_there()
        self.loose = np.maximum(self._apart(), 1.0)

    def _be_there(self) -> None:
        """The pieces where the search is, with the kicks that belong to it."""
        problem, which = self.problem, self.which
        problem.hand_on(problem.runs(self.states, which), which)
        self.linear = problem.linear(self.states, which)
        self.defects = defects_of(problem, self.linear, which, self.states)
        self._must_be_numbers()

    def cost(self) -> float:
        """The sum of squares there."""
        return cost_of(self.problem, self.linear, self.which, self.defects, self.weights)

    def _pairs(self) -> list[tuple[Linear, int]]:
        return list(zip(self.linear, self.which, strict=True))

    def descend(self, is_last: bool) -> bool:
        """Go on until a step is small, or the sum flat, at the least slack that leads there; whether it came to that.

        Args:
            is_last: whether the noise is weighed anew at the end.
        """
        damping, raised, weighings, loosenings, least = _FIRST_DAMPING, 2.0, 0, 0, np.ones(len(self.loose))
        first, before, since = self.tries, np.inf, self.tries
        while self.tries - first < _MOST_TRIES:
            cost, is_level = self.cost(), bool(np.all(self.loose <= least))
            if not is_level or cost < (1.0 - _FLAT) * before:
                before, since = cost, self.tries
            elif self.tries - since >= _FLAT_TRIES:
                if self._is_near():
                    return True
                since = self.tries
            found = eliminate(self.problem, self.linear, self.which, self.defects, self.weights, damping)
            dx = step_of(found, damping, self.x, *self.bounds, self.free)
            after = self._moved(found, dx)
            now = self._tried(self.x + dx, after)
            ahead = max(cost - float(np.sum((found.R @ dx - found.r) ** 2)), 1e-300)
            if not now < cost:
                self.problem.at(self.x)
                if is_level and ahead < 1e-6 * cost:
                    return True
                damping, raised = raised * max(damping, 1e-6), 2.0 * raised
                if damping > _STUCK:
                    loosenings += 1
                    if loosenings > _LOOSENINGS:
                        return False
                    least = self.loose = np.where(self._apart() > self.loose, _LOOSER, 1.0) * self.loose
                    damping, raised = _FIRST_DAMPING, 2.0
                continue
            gain = (cost - now) / ahead
            is_still = float(np.sum((found.R @ dx) ** 2)) < _STILL * max(len(dx), 1) and cost - now < 1e-4 * cost
            is_good = gain > 0.5 and damping <= _TRUSTED
            is_small = damping < 1e-3 and is_still
            self.x, self.states, self.steps = self.x + dx, after, self.steps + 1
            factor = 0.1 if gain > 0.5 else max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3)
            damping, raised = max(factor * damping, _LEAST_DAMPING), 2.0
            self._be_there()
            if not is_level:
                if is_good or cost - now < _LITTLE * cost:
                    self.loose = np.maximum(_TIGHTER * self.loose, least)
            elif is_small:
                if not is_last:
                    return True
                new = noise_left(self.problem, self.linear, self.which)
                if weighings >= _WEIGHINGS or float(np.max(np.abs(new / self.sigma - 1.0))) < 0.05:
                    self.sigma = new
                    return True
                self.sigma, weighings = new, weighings + 1
        return False

    def _is_near(self) -> bool:
        """Whether the linear model has its least within a standard deviation.

        Where a state is hardly seen, as the turn of an object whose position alone is measured, steps get short where
        the sum is flat already. What the model has left to go is in the intervals, see `intervals.spread_of`.
        """
        found = eliminate(self.problem, self.linear, self.which, self.defects, self.weights)
        dx = step_of(found, 0.0, self.x, *self.bounds, self.free)
        return float(np.sum((found.R @ dx) ** 2)) < _NEAR * max(len(dx), 1)

    def _moved(self, found: Eliminated, dx: Array) -> list[State]:
        """The states that follow when the parameters move by dx."""
        after = list(self.states)
        for c, S, k in zip(found.c, found.S, self.which, strict=True):
            after[k] = self.problem.moved(self.states[k], c - S @ dx)
        return after

    def _tried(self, x: Array, states: Sequence[State]) -> float:
        """The sum of squares at another point; infinite where the scenario does not take such parameters."""
        problem, which, now = self.problem, self.which, np.inf
        self.tries += 1
        try:
            problem.at(x)
            runs = problem.runs(states, which)
            now = cost_of(problem, runs, which, defects_of(problem, runs, which, states), self.weights)
        except SofthandError:
            pass
        if self._progress is not None:
            self._progress(self.steps, now)
        return now

    def _apart(self) -> Array:
        """How many times the least slack two pieces each are apart."""
        return np.array([np.sqrt(np.mean((defect / self.tight) ** 2)) for defect in self.defects])

    def _must_be_numbers(self) -> None:
        problem = self.problem
        for one, k in self._pairs():
            parts = (one.r, one.by_start, one.by_parameters, one.end_by_start, one.end_by_parameters)
            if not all(bool(np.all(np.isfinite(part))) for part in parts):
                raise MeasurementError(
                    f"{problem.log.source}: the run computed anew breaks down behind t = {problem.time(k):.4g} s: a "
                    "tip leaves the range of its law, or the grasp is lost. Begin from values nearer to the truth, "
                    "take shorter pieces (--piece), or cut the log there.", column="", value=problem.time(k),
                )  # fmt: skip


def cost_of(
    problem: Problem,
    runs: Sequence[Run | Linear],
    which: Sequence[int],
    defects: Sequence[Array],
    weights: Weights,
) -> float:
    """The sum of squares; infinite where a run does not come to its end."""
    with np.errstate(over="ignore", invalid="ignore"):
        total = sum(
            float(np.sum((one.r * weights.of_residuals(problem, k)) ** 2)) for one, k in zip(runs, which, strict=True)
        )
        total += float(np.sum((np.reshape(defects, weights.slack.shape) / weights.slack) ** 2))
    return total if np.isfinite(total) else np.inf


def defects_of(
    problem: Problem, runs: Sequence[Run | Linear], which: Sequence[int], states: Sequence[State]
) -> list[Array]:
    """By how much the states are beyond the ends of the pieces before them; 0 behind a gap."""
    nothing = np.zeros(problem.n_states)
    return [
        problem.defect(states[after], one.end) if after == k + 1 else nothing
        for one, k, after in zip(runs[:-1], which[:-1], which[1:], strict=True)
    ]


def bounds_of(problem: Problem) -> tuple[Array, Array]:
    """Lowest and highest x."""
    return (
        np.array([one.to_x(one.lower) if np.isfinite(one.lower) else -np.inf for one in problem.parameters]),
        np.array([one.to_x(one.upper) if np.isfinite(one.upper) else np.inf for one in problem.parameters]),
    )
