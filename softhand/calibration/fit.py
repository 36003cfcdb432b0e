"""Parameters fitted to a log from one start or several, with what the log tells looked at first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from softhand.assembly.resolve import Setup
from softhand.calibration.intervals import Spread, information, spread_of
from softhand.calibration.log import Log
from softhand.calibration.parameters import Parameter
from softhand.calibration.problem import Problem
from softhand.calibration.solving import Solution, solve
from softhand.calibration.starting import first_states
from softhand.calibration.told import Direction, untold
from softhand.calibration.weights import noise_of
from softhand.errors import MeasurementError, SofthandError
from softhand.numerics.arrays import Array

_AROUND = 0.15  # of x, by which other starts are off


class Fitted(NamedTuple):
    """A fit.

    Attributes:
        problem: at the solution.
        solution: where it came to rest.
        spread: how well the parameters are known.
        which: pieces that were fitted.
        held_out: pieces that were not.
        others: x of the other starts, and their costs.
        left: residuals of the pieces that were fitted.
        left_held: of those that were not.
    """

    problem: Problem
    solution: Solution
    spread: Spread
    which: list[int]
    held_out: list[int]
    others: list[tuple[Array, float]]
    left: list[Array]
    left_held: list[Array]


def sensitivity(log: Log, setup: Setup, parameters: Sequence[Parameter], length: float, threads: int) -> Array:
    """R of a log at the values that the scenario has, shape (p, p): see `told.untold`."""
    problem = Problem(log, setup, parameters, length, threads)
    x = begin_of(parameters)
    problem.at(x)
    states = first_states(problem, setup.grasp.state, x)
    solution = Solution(x, states, [None] * len(states), noise_of(problem), np.ones(len(states) - 1), 0.0, 0, False)
    return information(problem, solution, range(len(problem.pieces)))[0].R


def begin_of(parameters: Sequence[Parameter]) -> Array:
    """x where the fit begins."""
    return np.array([one.to_x(one.value) for one in parameters])


def look(log: Log, setup: Setup, parameters: Sequence[Parameter], length: float, threads: int) -> list[Direction]:
    """What the log does not tell."""
    return untold(sensitivity(log, setup, parameters, length, threads), parameters)


def fit(
    log: Log,
    setup: Setup,
    parameters: Sequence[Parameter],
    length: float,
    share_held_out: float,
    starts: int,
    seed: int,
    threads: int,
    progress: Callable[[str], None] | None = None,
) -> Fitted:
    """Fit parameters to a log.

    Args:
        log: checked.
        setup: of the scenario.
        parameters: that are fitted.
        length: of a piece [s].
        share_held_out: of the pieces, at the end of the log, which are predicted and not fitted.
        starts: how many, the first from the values of the scenario.
        seed: of the others.
        threads: at work at the same time.
        progress: called with what is being done.

    Raises:
        MeasurementError: no start comes to rest.
    """
    problem = Problem(log, setup, parameters, length, threads)
    count = len(problem.pieces)
    kept = count - round(share_held_out * count)
    which, rest = list(range(kept)), list(range(kept, count))
    rng, sigma = np.random.default_rng(seed), noise_of(problem)
    found: list[Solution] = []
    problems: list[str] = []
    for start in range(starts):
        x = begin_of(parameters)
        if start:
            x = _other(x, parameters, rng)
        try:
            problem.at(x)
            states = first_states(problem, setup.grasp.state, x)
            note = None if progress is None else _note(progress, start, starts)
            found.append(solve(problem, x, states, sigma, which, note))
        except SofthandError as error:
            if start == 0:
                raise
            problems.append(str(error))
    best = min(found, key=lambda one: (not one.is_done, one.cost))
    if not best.is_done:
        raise MeasurementError(
            f"{log.source}: the fit does not come to rest from {starts} start{'s' * (starts > 1)}; begin from values "
            "nearer to the truth, fit fewer parameters, or allow more starts.", column="", value=starts,
        )  # fmt: skip
    spread = spread_of(problem, best, which)
    others = [(one.x, one.cost) for one in found if one is not best]
    left = [run.r for run in problem.runs(best.states, which)]
    return Fitted(
        problem, best, spread, which, rest, others, left, _held_out(problem, setup, best, rest) if rest else []
    )


def _held_out(problem: Problem, setup: Setup, solution: Solution, which: list[int]) -> list[Array]:
    """Residuals of pieces that were not fitted: the parameters stay, and the states follow what was measured there."""
    states = first_states(problem, setup.grasp.state, solution.x)
    held = solve(problem, solution.x, states, solution.sigma, which, hold=True)
    return [run.r for run in problem.runs(held.states, which)]


def held_out_ratio(fitted: Fitted) -> Array:
    """Root mean square of the residuals of the held-out pieces over the noise, by channel; NaN without any."""
    problem = fitted.problem
    squares, count = np.zeros(len(problem.channels)), np.zeros(len(problem.channels))
    for k, r in zip(fitted.held_out, fitted.left_held, strict=True):
        squares += np.bincount(problem.channel[k], r**2, len(squares))
        count += np.bincount(problem.channel[k], minlength=len(squares))
    with np.errstate(invalid="ignore"):
        return np.sqrt(squares / np.where(count > 0, count, np.nan)) / fitted.solution.sigma


def _other(x: Array, parameters: Sequence[Parameter], rng: np.random.Generator) -> Array:
    lower = np.array([one.to_x(one.lower) if np.isfinite(one.lower) else -np.inf for one in parameters])
    upper = np.array([one.to_x(one.upper) if np.isfinite(one.upper) else np.inf for one in parameters])
    return np.clip(x + _AROUND * rng.uniform(-1.0, 1.0, len(x)), lower, upper)


def _note(progress: Callable[[str], None], start: int, starts: int) -> Callable[[int, float], None]:
    return lambda step, cost: progress(f"start {start + 1} of {starts}, step {step}")
