"""How late a torque may come: the loop with its torques delayed, exactly, by any time."""

from __future__ import annotations

from functools import partial

import numpy as np

from softhand.margins.loop import Loop, growth_of, in_turn, plant_over
from softhand.margins.place import Place
from softhand.margins.search import first_edge
from softhand.numerics.arrays import Array

LONGEST = 40
"""Control periods of delay that are tried."""
_STEPS = 4  # tried in a period before bisection
_ROUNDING = 1e-9  # of a period


def reach_of(loop: Loop, place: Place, delay: float) -> tuple[int, list[Array]]:
    """Whole periods that torques come late, and what the youngest and older ones of a period do; the plant's alone."""
    whole, rest = divmod(delay, loop.period)
    if min(rest, loop.period - rest) < _ROUNDING * loop.period:
        return round(delay / loop.period), [loop.B]
    move, soon = plant_over(place, loop.period - rest)
    return int(whole), [soon, move @ plant_over(place, rest)[1]]


def delayed_step(loop: Loop, place: Place, delay: float, reach: tuple[int, list[Array]] | None = None) -> Array:
    """The loop whose torques come later: (x, m, torques under way) a cycle on.

        x' = Phi(T) x + Phi(T - r) Gamma(r) u_{k-d-1} + Gamma(T - r) u_{k-d},    delay = d T + r

    Args:
        loop: at the place.
        place: where.
        delay: between sample and torque, beyond what the loop has [s].
        reach: of `reach_of`, if it is known.
    """
    n, s, size = len(loop.inputs), len(loop.A), len(loop.step)
    d, acting = reach or reach_of(loop, place, delay)
    waiting = d + len(acting) - 1
    steps = []
    for turn in loop.turns:
        step = np.zeros((size + waiting * n,) * 2)
        step[:s, :s], step[s:size, :size] = loop.A, turn.N
        for age, B in enumerate(acting, d):  # of the torque that acts
            if age == 0:
                step[:s, :size] += B @ turn.K
            else:
                step[:s, size + (age - 1) * n : size + age * n] += B
        if waiting:
            step[size : size + n, :size] = turn.K
            step[size + n :, size:-n] = np.eye((waiting - 1) * n)
        steps.append(step)
    return in_turn(steps)


def delay_margin(loop: Loop, place: Place) -> float:
    """Delay between sample and torque at which some motion begins to grow [s].

    NaN if the loop is not stable without; infinite if it is with 40 control periods.
    """
    ways = loop.period * np.arange(_STEPS * LONGEST + 1) / _STEPS
    return first_edge(partial(_growth, loop, place), ways.tolist())


def _growth(loop: Loop, place: Place, delay: float) -> float:
    return growth_of(delayed_step(loop, place, delay), loop.cycle)
