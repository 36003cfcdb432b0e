"""States of the pieces fitted one after the other, parameters held: where a fit of all of them begins.

Each piece begins where the one before it ends, but for so much as wrong parameters let it drift within one, and is
drawn from there to what was measured in it. Steps of a single piece are short where its tips slip, and long elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from softhand.calibration.bench import Linear
from softhand.calibration.problem import Problem
from softhand.calibration.weights import slack_of
from softhand.numerics.arrays import Array
from softhand.plant.state import State

_APART = 3e3  # times the slack
_MOST_TRIES = 12
_GOOD = 0.03  # share of the sum by which a step must lower it to go on


def settled(problem: Problem, states: Sequence[State], sigma: Array, which: Sequence[int]) -> list[State]:
    """The states, settled; the kicks of the problem are those that belong to them.

    Args:
        problem: at the parameters.
        states: from which the pieces begin to be drawn, where the one before tells no better.
        sigma: noise of each channel.
        which: pieces that follow one another.
    """
    after, apart = list(states), _APART * slack_of(problem)
    problem.kicks = [None] * len(after)
    end, last = None, -2
    for k in which:
        end, last = end if k == last + 1 else None, k
        around = after[k]
        if end is not None:
            if _is_nearer(problem, k, end, around, sigma):
                after[k] = end
            around = end
        after[k] = _drawn(problem, k, after[k], around, sigma, apart)
        (run,) = problem.runs(after, [k])
        end = None
        if np.all(np.isfinite(run.r)) and run.kick.is_finite:
            end = run.end
            if k + 1 < len(after):
                problem.kicks[k + 1] = run.kick
    return after


def _is_nearer(problem: Problem, k: int, one: State, other: State, sigma: Array) -> bool:
    return _misfit(problem, k, one, sigma) < _misfit(problem, k, other, sigma)


def _misfit(problem: Problem, k: int, state: State, sigma: Array) -> float:
    states = [state] * (k + 1)
    (run,) = problem.runs(states, [k])
    with np.errstate(over="ignore", invalid="ignore"):
        total = float(np.sum((run.r / sigma[problem.channel[k]]) ** 2))
    return total if np.isfinite(total) else np.inf


def _drawn(problem: Problem, k: int, state: State, around: State, sigma: Array, apart: Array) -> State:
    """By Levenberg and Marquardt: nearer to what was measured in a piece, but around where it should begin."""
    damping, tries, w = 1e-3, 0, 1.0 / sigma[problem.channel[k]]
    cost = _misfit(problem, k, state, sigma) + float(np.sum((problem.defect(state, around) / apart) ** 2))
    while tries < _MOST_TRIES and np.isfinite(cost):
        (linear,) = problem.linear([state] * (k + 1), [k])
        A, b = _rows(linear, problem.defect(state, around), w, apart)
        if not np.all(np.isfinite(A)):
            break
        scale = np.linalg.norm(A, axis=0)
        is_better = False
        while not is_better and tries < _MOST_TRIES:
            tries += 1
            rows = np.vstack([A / scale, np.sqrt(damping) * np.eye(len(scale))])
            step = np.linalg.lstsq(rows, np.concatenate([b, np.zeros(len(scale))]), rcond=None)[0] / scale
            trial = problem.moved(state, step)
            now = _misfit(problem, k, trial, sigma) + float(np.sum((problem.defect(trial, around) / apart) ** 2))
            is_better = now < cost
            damping *= 0.1 if is_better else 10.0
        if not is_better:
            break
        is_good, state, cost = now < (1.0 - _GOOD) * cost, trial, now
        if not is_good:
            break
    return state


def _rows(linear: Linear, defect: Array, w: Array, apart: Array) -> tuple[Array, Array]:
    """A and b of |A ds - b|^2."""
    A = np.vstack([linear.by_start * w[:, None], np.diag(1.0 / apart)])
    return A, np.concatenate([linear.r * w, -defect / apart])
