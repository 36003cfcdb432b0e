"""How late a torque may come: the loop with its torques delayed, exactly, by any time."""

from __future__ import annotations

from functools import partial

import numpy as np

from softhand.margins.loop import Loop, growth_of, plant_over
from softhand.margins.place import Place
from softhand.margins.search import first_edge
from softhand.numerics.arrays import Array

LONGEST = 40
"""Control periods of delay that are tried."""
_STEPS = 4  # tried in a period before bisection
_ROUNDING = 1e-9  # of a period


def delayed_step(loop: Loop, place: Place, delay: float) -> Array:
    """The loop whose torques come later: (x, m, torques under way) a period on.

        x' = Phi(T) x + Phi(T - r) Gamma(r) u_{k-d-1} + Gamma(T - r) u_{k-d},    delay = d T + r

    Args:
        loop: at the place.
        place: where.
        delay: between sample and torque, beyond what the loop has [s].
    """
    n, s, size = len(loop.inputs), len(loop.A), len(loop.step)
    whole, rest = divmod(delay, loop.period)
    if loop.period - rest < _ROUNDING * loop.period:
        whole, rest = whole + 1.0, 0.0
    d = int(whole)
    if rest < _ROUNDING * loop.period:
        late, soon = np.zeros_like(loop.B), loop.B
        d_all = d
    else:
        move, soon = plant_over(place, loop.period - rest)
        late = move @ plant_over(place, rest)[1]
        d_all = d + 1
    if d_all == 0:
        return loop.step
    step = np.zeros((size + d_all * n,) * 2)
    step[:s, :s], step[s:size, :size] = loop.A, loop.N
    ways = [loop.K, *(None for _ in range(d_all))]
    for age, matrix in ((d, soon), (d + 1, late)):
        if age > d_all:
            continue
        if age == 0:
            step[:s, :size] += matrix @ ways[0]
        else:
            first = size + (age - 1) * n
            step[:s, first : first + n] += matrix
    step[size : size + n, :size] = loop.K
    for k in range(1, d_all):
        step[size + k * n : size + (k + 1) * n, size + (k - 1) * n : size + k * n] = np.eye(n)
    return step


def delay_margin(loop: Loop, place: Place) -> float:
    """Delay between sample and torque at which some motion begins to grow [s].

    NaN if the loop is not stable without; infinite if it is with 40 control periods.
    """
    ways = loop.period * np.arange(_STEPS * LONGEST + 1) / _STEPS
    return first_edge(partial(_growth, loop, place), ways.tolist())


def _growth(loop: Loop, place: Place, delay: float) -> float:
    return growth_of(delayed_step(loop, place, delay), loop.period)
