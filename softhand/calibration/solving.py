"""Least squares over the parameters and the states where all pieces begin, which follow from one another.

    min over x, s_0, s_1, ...  of  sum_i |(y_i - h_i(s_i, x)) / sigma|^2 + sum_i |(s_(i+1) - f_i(s_i, x)) / slack|^2

This is multiple shooting [Bock, 1981] with a little slack between the pieces, by the method of Levenberg and Marquardt.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from softhand.calibration.handing_on import Kick
from softhand.calibration.problem import Problem
from softhand.calibration.search import Search
from softhand.calibration.sticking import begin_sticking
from softhand.numerics.arrays import Array
from softhand.plant.state import State


class Solution(NamedTuple):
    """Where the search came to rest.

    Attributes:
        x: of the parameters.
        states: where each of the pieces begins.
        kicks: with which each goes on.
        sigma: standard deviation of the noise of each channel.
        loose: how many times the least slack was allowed between two pieces each.
        cost: sum of squares over sigma and slack.
        steps: how many were done.
        is_done: whether the last one was small.
    """

    x: Array
    states: list[State]
    kicks: list[Kick | None]
    sigma: Array
    loose: Array
    cost: float
    steps: int
    is_done: bool


def solve(
    problem: Problem,
    x: Array,
    states: list[State],
    sigma: Array,
    which: Sequence[int],
    progress: Callable[[int, float], None] | None = None,
    hold: bool = False,
) -> Solution:
    """Steps that are shorter the more damped they are, parameters and states alike; slack and noise settle on the way.

    Args:
        problem: at any parameters.
        x: where the parameters begin; those without freedom stay.
        states: where the pieces begin, all of the problem.
        sigma: noise of each channel, as guessed.
        which: pieces that are fitted; they follow one another.
        progress: called with the number of a step and the cost.
        hold: whether the parameters stay as they are, and states alone are fitted.
    """
    problem.sticks = problem.can_slip and not hold
    search = Search(problem, x, states, sigma, which, hold, progress)
    is_done = False
    for _ in begin_sticking(search) if problem.sticks else (None,):
        is_done = search.descend(is_last=True)
        if is_done:
            break
    return Solution(
        search.x, search.states, list(problem.kicks), search.sigma, search.loose, search.cost(), search.steps, is_done
    )
