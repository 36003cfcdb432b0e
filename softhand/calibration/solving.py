"""Gauss-Newton over the parameters and the states where all pieces begin, which follow from one another.

    min over x, s_0, s_1, ...  of  sum_i |(y_i - h_i(s_i, x)) / sigma|^2 + sum_i |(s_(i+1) - f_i(s_i, x)) / slack|^2

This is multiple shooting [Bock, 1981] with a little slack between the pieces. States are eliminated one after the other
by orthogonal transformations, as in a square-root information filter [Bierman, Factorization Methods, 1977, chapter V],
so that nothing is squared.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from softhand.calibration.problem import Linear, Problem, Run
from softhand.calibration.triangle import triangle
from softhand.errors import MeasurementError, SofthandError
from softhand.model.world import slides_of
from softhand.numerics.arrays import Array
from softhand.plant.state import State

_MOST_STEPS, _STILL = 40, 1e-3
_LONGEST = 0.5  # of x in a step
_TIGHTER = 0.1  # of the slack, after a step
_STEP = 2e-3  # [s] at which a fresh start is off by
_TURN, _SHIFT, _SPIN, _SPEED, _STORED = 5e-7, 1e-8, 1e-4, 2e-6, 5e-6  # [rad], [m], [rad/s], [m/s], [rad]
_LEAST_NOISE = {
    "joint_position": 1e-6, "joint_velocity": 1e-4, "object_position": 1e-7, "object_orientation": 1e-6,
    "contact_force": 1e-4, "contact_torsion": 1e-6,
}  # fmt: skip
"""Below which no noise is taken for real."""


class Eliminated(NamedTuple):
    """All pieces with their states eliminated.

    s_i = c_i - S_i x of each piece, and |R x - r|^2 is what is left for the parameters.
    """

    R: Array
    r: Array
    c: list[Array]
    S: list[Array]


class Solution(NamedTuple):
    """Where Gauss-Newton came to rest.

    Attributes:
        x: of the parameters.
        states: where each of the pieces begins.
        sigma: standard deviation of the noise of each channel.
        cost: sum of squares over sigma and slack.
        steps: how many were done.
        is_done: whether the last one was small.
    """

    x: Array
    states: list[State]
    sigma: Array
    cost: float
    steps: int
    is_done: bool


def noise_of(problem: Problem) -> Array:
    """A first guess of the noise of each channel: from second differences of what was measured."""
    found = []
    for name, k in problem.channels:
        values = problem.log.measured[name]
        values = values[np.isfinite(values).all(axis=1)]
        scale = 2.0 if name == "object_orientation" else 1.0  # a quaternion has half the angle
        values = values[:, :3] if name == "object_orientation" else values[:, k : k + 1]
        second = np.diff(values, n=2, axis=0)
        found.append(max(scale * float(np.sqrt(np.mean(second**2) / 6.0)), _LEAST_NOISE[name]))
    return np.array(found)


def slack_of(problem: Problem) -> Array:
    """Of each state: what a piece may begin beside the end of the one before it.

    A piece starts afresh from q, v and z, where a run goes on with the kick of the step before: that is off by a little
    of second order in the step, which grows with nothing and is no property of the hand.
    """
    world, nz = problem.world, len(problem.remembered)
    turns = np.concatenate([~slides_of(world), [False] * 3, [True] * 3])
    share = (problem.step / _STEP) ** 2
    displacement, rate = np.where(turns, _TURN, _SHIFT), np.where(turns, _SPIN, _SPEED)
    return share * np.concatenate([displacement, rate, np.full(nz, _STORED)])


def eliminate(
    problem: Problem,
    linear: Sequence[Linear],
    which: Sequence[int],
    defects: Sequence[Array],
    sigma: Array,
    slack: Array,
) -> Eliminated:
    """Eliminate the states.

    Args:
        problem: whose pieces these are.
        linear: pieces that follow one another.
        which: their numbers.
        defects: by how much each state, from the second one on, is beyond the end of the piece before.
        sigma: noise of each channel.
        slack: of each state.
    """
    s, p = problem.n_states, linear[0].by_parameters.shape[1]
    before = np.zeros((0, s + p + 1))
    kept: list[tuple[Array, bool]] = []
    for i, (one, k) in enumerate(zip(linear, which, strict=True)):
        w = 1.0 / sigma[problem.channel[k]]
        rows = np.hstack([one.by_start * w[:, None], one.by_parameters * w[:, None], (one.r * w)[:, None]])
        rows = triangle(np.vstack([rows, before]))
        if i + 1 == len(linear):
            top, rest = rows[:s], rows[s:, s:]
            kept.append((top, False))
            break
        stacked = np.zeros((len(rows) + s, 2 * s + p + 1))  # s_i, s_(i+1), x, 1
        stacked[: len(rows), :s], stacked[: len(rows), 2 * s :] = rows[:, :s], rows[:, s:]
        # d' = d + ds_(i+1) - E ds_i - G dx
        stacked[len(rows) :, :s] = one.end_by_start / slack[:, None]
        stacked[len(rows) :, s : 2 * s] = -np.diag(1.0 / slack)
        stacked[len(rows) :, 2 * s : 2 * s + p] = one.end_by_parameters / slack[:, None]
        stacked[len(rows) :, -1] = defects[i] / slack
        stacked = triangle(stacked)
        kept.append((stacked[:s], True))
        before = stacked[s : 2 * s + p + 1, s:]
    return _back(kept, rest, s, p)


def _back(kept: list[tuple[Array, bool]], rest: Array, s: int, p: int) -> Eliminated:
    """From the last state to the first: s_i = c_i - S_i x."""
    c: list[Array] = []
    S: list[Array] = []
    for top, has_next in reversed(kept):
        R, right, by_x = top[:, :s], top[:, -1], top[:, -1 - p : -1]
        if has_next:
            right, by_x = right - top[:, s : 2 * s] @ c[-1], by_x - top[:, s : 2 * s] @ S[-1]
        both = _solved(R, np.hstack([right[:, None], by_x]))
        c.append(both[:, 0])
        S.append(both[:, 1:])
    return Eliminated(rest[:, :p], rest[:, p], c[::-1], S[::-1])


def _solved(R: Array, right: Array) -> Array:
    """R^-1 right of an upper triangle; what it does not tell stays 0."""
    scale = np.linalg.norm(R, axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    return np.asarray(np.linalg.lstsq(R / scale, right, rcond=1e-13)[0] / scale[:, None])


def step_of(found: Eliminated, damping: float, x: Array, lower: Array, upper: Array) -> Array:
    """A damped step of the parameters within their bounds."""
    R, r = found.R, found.r
    d = np.maximum(np.linalg.norm(R, axis=0), 1e-300)
    free, dx = np.ones(len(x), bool), np.zeros(len(x))
    for _ in range(len(x)):
        if not free.any():
            break
        rows = np.vstack([(R / d)[:, free], np.sqrt(damping) * np.eye(int(free.sum()))])
        right = np.concatenate([r - R[:, ~free] @ dx[~free], np.zeros(int(free.sum()))])
        dx[free] = np.linalg.lstsq(rows, right, rcond=1e-14)[0] / d[free]
        longest = float(np.max(np.abs(dx[free])))
        dx[free] *= min(1.0, _LONGEST / longest) if longest > 0.0 else 1.0
        out = free & ((x + dx < lower) | (x + dx > upper))
        if not out.any():
            break
        dx[out] = np.clip(x + dx, lower, upper)[out] - x[out]
        free &= ~out
    return dx


def cost_of(
    problem: Problem,
    runs: Sequence[Run | Linear],
    which: Sequence[int],
    defects: Sequence[Array],
    sigma: Array,
    slack: Array,
) -> float:
    """The sum of squares; infinite where a run does not come to its end."""
    total = sum(float(np.sum((one.r / sigma[problem.channel[k]]) ** 2)) for one, k in zip(runs, which, strict=True))
    total += sum(float(np.sum((defect / slack) ** 2)) for defect in defects)
    return total if np.isfinite(total) else np.inf


def defects_of(
    problem: Problem, runs: Sequence[Run | Linear], which: Sequence[int], states: Sequence[State]
) -> list[Array]:
    """By how much the states are beyond the ends of the pieces before them."""
    return [problem.defect(states[k], one.end) for one, k in zip(runs[:-1], which[1:], strict=True)]


def noise_left(problem: Problem, runs: Sequence[Run | Linear], which: Sequence[int]) -> Array:
    """Standard deviation of the residuals of each channel."""
    squares, count = np.zeros(len(problem.channels)), np.zeros(len(problem.channels))
    for one, k in zip(runs, which, strict=True):
        squares += np.bincount(problem.channel[k], one.r**2, len(squares))
        count += np.bincount(problem.channel[k], minlength=len(squares))
    floors = np.array([_LEAST_NOISE[name] for name, _ in problem.channels])
    return np.maximum(np.sqrt(squares / np.maximum(count, 1)), floors)


def _must_be_numbers(problem: Problem, linear: Sequence[Linear], which: Sequence[int]) -> None:
    for one, k in zip(linear, which, strict=True):
        parts = (one.r, one.by_start, one.by_parameters, one.end_by_start, one.end_by_parameters)
        if not all(bool(np.all(np.isfinite(part))) for part in parts):
            raise MeasurementError(
                f"{problem.log.source}: the run computed anew breaks down behind t = {problem.time(k):.4g} s: a tip "
                "leaves the range of its law, or the grasp is lost. Begin from values nearer to the truth, take "
                "shorter pieces (--piece), or cut the log there.", column="", value=problem.time(k),
            )  # fmt: skip


def _tried(
    problem: Problem, x: Array, states: Sequence[State], which: Sequence[int], sigma: Array, slack: Array
) -> float:
    """The sum of squares there; infinite where the scenario does not take such parameters."""
    try:
        problem.at(x)
    except SofthandError:
        return np.inf
    runs = problem.runs(states, which)
    return cost_of(problem, runs, which, defects_of(problem, runs, which, states), sigma, slack)


def _looseness(
    problem: Problem, runs: Sequence[Run | Linear], which: Sequence[int], states: Sequence[State], tight: Array
) -> float:
    """How many times the slack the pieces are apart, at least 1."""
    apart = [defect / tight for defect in defects_of(problem, runs, which, states)]
    return max(1.0, float(np.sqrt(np.mean(np.square(apart))))) if apart else 1.0


def bounds_of(problem: Problem) -> tuple[Array, Array]:
    """Lowest and highest x."""
    return (
        np.array([one.to_x(one.lower) if np.isfinite(one.lower) else -np.inf for one in problem.parameters]),
        np.array([one.to_x(one.upper) if np.isfinite(one.upper) else np.inf for one in problem.parameters]),
    )


def solve(
    problem: Problem,
    x: Array,
    states: list[State],
    sigma: Array,
    which: Sequence[int],
    progress: Callable[[int, float], None] | None = None,
    hold: bool = False,
) -> Solution:
    """Gauss-Newton with the damping of Levenberg and Marquardt; slack and noise settle on the way.

    Args:
        problem: at any parameters.
        x: where the parameters begin; those without freedom stay.
        states: where the pieces begin, all of the problem.
        sigma: noise of each channel, as guessed.
        which: pieces that are fitted; they follow one another.
        progress: called with the number of a step and the cost.
        hold: whether the parameters stay as they are, and states alone are fitted.
    """
    lower, upper = bounds_of(problem)
    x, states, damping = x.copy(), list(states), 1e-2
    tight = slack_of(problem)
    problem.at(x)
    problem.kicks = [None] * len(states)
    problem.hand_on(problem.runs(states, which), which)
    linear = problem.linear(states, which)
    loose = _looseness(problem, linear, which, states, tight)
    is_done, count, weighings = False, 0, 0
    while count < _MOST_STEPS and not is_done:
        count += 1
        slack = loose * tight
        defects = defects_of(problem, linear, which, states)
        cost = cost_of(problem, linear, which, defects, sigma, slack)
        _must_be_numbers(problem, linear, which)
        found = eliminate(problem, linear, which, defects, sigma, slack)
        dx = np.zeros(len(x)) if hold else step_of(found, damping, x, lower, upper)
        share, is_better = 1.0, False
        while share > 0.05 and not is_better:
            trial, after = x + share * dx, list(states)
            for c, S, k in zip(found.c, found.S, which, strict=True):
                after[k] = problem.moved(states[k], share * (c - S @ dx))
            now = _tried(problem, trial, after, which, sigma, slack)
            is_better = now < cost
            share *= 1.0 if is_better else 0.3
        if progress is not None:
            progress(count, now)
        if not is_better:
            problem.at(x)
            if loose == 1.0 and cost - now > -1e-6 * cost:
                is_done = True
            damping = 30.0 * max(damping, 1e-4)
            if damping > 1e6:
                break
            continue
        is_small = share == 1.0 and float(np.sum((found.R @ dx) ** 2)) < _STILL * max(len(x), 1) and (
            cost - now < 1e-4 * cost)  # fmt: skip
        x, states, damping = trial, after, max(0.1 * damping, 1e-12) if share == 1.0 else damping
        problem.hand_on(problem.runs(states, which), which)
        linear = problem.linear(states, which)
        if loose > 1.0:
            loose = max(min(_TIGHTER * loose, _looseness(problem, linear, which, states, tight)), 1.0)
        elif is_small:
            new = noise_left(problem, linear, which)
            is_done = weighings > 3 or float(np.max(np.abs(new / sigma - 1.0))) < 0.05
            sigma, weighings = new, weighings + 1
    defects = defects_of(problem, linear, which, states)
    return Solution(x, states, sigma, cost_of(problem, linear, which, defects, sigma, loose * tight), count, is_done)
