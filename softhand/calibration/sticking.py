"""Where a fit begins if tips may slip: by the pieces in which none does, and then by friction alone.

A tip that begins to slip a step sooner or later changes the matrix of that step, and the sum of squares jumps. So the
fit of all pieces has to begin near to its end. The pieces in which no tip slips tell all but friction, by a model in
which none can; and of friction alone the pieces that are left out have one clear minimum.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from softhand.calibration.bench import Linear, Run
from softhand.calibration.search import Search, defects_of
from softhand.calibration.settling import settled
from softhand.numerics.arrays import Array
from softhand.plant.state import State

_NEAR = 0.9  # share of the friction with which the fit begins, from which a tip may slip
_MOST_LEFT_OUT = 0.7  # share of the pieces
_OUTLYING = 3.0, 1.5  # times the usual sum of a piece, one after the other
_COARSE, _REACH = 0.012, 13  # step of log(friction), and how many to each side
_FINE = 0.004  # step around the best of these
_MOST = 4  # of them
_WIDE = 1e3  # times the least slack, of which settled pieces are apart by noise alone


def begin_sticking(search: Search) -> Iterator[None]:
    """Bring a search near to its end: once for each friction that fits well, the best first.

    Args:
        search: settled, at a problem in which no tip slips; all its pieces are in it again after that, and tips slip.
    """
    problem, every = search.problem, search.which
    friction = [j for j, one in enumerate(problem.parameters) if one.key.endswith(".friction")]
    free = search.free.copy()
    search.free[friction] = False
    needed = np.array([one.use for one in search.linear])
    least = max(_NEAR * problem.friction, float(np.quantile(needed, 1.0 - _MOST_LEFT_OUT)))
    search.restrict([k for k, use in zip(every, needed, strict=True) if use <= least])
    search.descend(is_last=False)
    for factor in _OUTLYING:
        outlying = _misfits(search, factor)
        if outlying and len(outlying) < len(search.which):
            search.restrict([k for k in search.which if k not in outlying])
            search.descend(is_last=False)
    left_out = [k for k in every if k not in search.which or (k > every[0] and k - 1 not in search.which)]
    states = settled(problem, search.states, search.sigma, every)
    problem.sticks = False
    begin, likely = search.x.copy(), [search.x.copy()]
    if friction and left_out:
        likely = _likely(search, friction, states, left_out)
    for x in likely:
        search.x = np.where(np.isin(np.arange(len(x)), friction), x, begin)
        problem.at(search.x)
        search.free, search.which = free, every
        search.settle(states)
        yield


def _misfits(search: Search, factor: float) -> list[int]:
    """Pieces of which the residuals are larger than usual by a factor."""
    sums = _sums(search, search.linear, search.which)
    return [k for k, one in zip(search.which, sums, strict=True) if one > factor * float(np.median(sums))]


def _sums(search: Search, runs: Sequence[Run | Linear], which: Sequence[int]) -> list[float]:
    """Mean square of the residuals of pieces, over the noise; large where one does not come to its end."""
    with np.errstate(over="ignore", invalid="ignore"):
        weighed = [one.r / search.sigma[search.problem.channel[k]] for one, k in zip(runs, which, strict=True)]
        sums = [float(np.mean(one**2)) for one in weighed]
    return [one if np.isfinite(one) else 1e30 for one in sums]


def _likely(search: Search, friction: list[int], states: Sequence[State], which: list[int]) -> list[Array]:
    """x of some frictions at which pieces that are settled there fit best, the best first."""
    lower, upper = search.bounds
    begin, found = search.x.copy(), {}

    def misfit(off: float) -> float:
        if off not in found:
            search.x = moved(off)
            found[off] = _misfit(search, states, which)
        return found[off]

    def moved(off: float) -> Array:
        x = begin.copy()
        x[friction] = np.clip(begin[friction] + off, lower[friction], upper[friction])
        return x

    offs = [round(_COARSE * k, 6) for k in range(-_REACH, _REACH + 1)]
    best = sorted(offs, key=misfit)[:_MOST]
    for k in (-2, -1, 1, 2):
        misfit(round(best[0] + _FINE * k, 6))
    return [moved(off) for off in sorted(found, key=lambda off: found[off])[:_MOST]]


def _misfit(search: Search, states: Sequence[State], which: list[int]) -> float:
    """How far pieces are off when they are settled: of the logarithms, so that none of them outweighs all others."""
    problem = search.problem
    problem.at(search.x)
    there = settled(problem, states, search.sigma, which)
    runs = problem.runs(there, which)
    apart = [float(np.mean((one / search.tight) ** 2)) for one in defects_of(problem, runs, which, there)]
    sums = _sums(search, runs, which)
    return float(np.sum(np.log(sums)) + 0.5 * np.sum(np.log1p(np.nan_to_num(apart, nan=1e30, posinf=1e30) / _WIDE**2)))
