"""The offset of dr: touch is hard to see, so that compression may begin a little before or after dr = 0."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from softhand.identification.fitting.coefficients import OFFSET
from softhand.identification.fitting.model import Model
from softhand.identification.fitting.solving import ENOUGH, QUICK, Solution, scaled, solve, span, stay
from softhand.identification.fitting.told import find_limits
from softhand.identification.record import Measurements
from softhand.numerics.arrays import Array

_SEEN = 1e-6  # share of its effect on the forces that no coefficient can take up


@dataclass(frozen=True, eq=False)
class Offset:
    """A fit in which dr may have an offset as well.

    Attributes:
        kind: `known` if it was fixed, `unseen` if the data cannot tell it, `beyond` if the best value lies beyond a
            tenth of the radius or drives a coefficient to a limit, and `fitted`.
        solution: with the offset as the last coefficient, 0 if `beyond`; the fit without it if `known` or `unseen`.
    """

    kind: str
    solution: Solution

    @property
    def is_free(self) -> bool:
        """Whether `solution` has the offset as a coefficient."""
        return self.kind in ("fitted", "beyond")


def free_offset(base: Solution, measurements: Measurements, spread: Array) -> Offset:
    """Fit once more, with the offset of dr free.

    Args:
        base: the fit without it.
        measurements: what was fitted.
        spread: standard deviation of each number beside others of its component, shape (m,).
    """
    model = base.model
    if OFFSET in model.fixed:
        return Offset("known", base)
    wide = Model(measurements, model.law_class, model.radius, model.fixed, with_offset=True)
    start, linear = np.append(base.values, 0.0), np.append(base.linear, False)
    near = stay(wide, linear, start, base.weight)
    columns = scaled(near.weighted_slope)[0]
    taken = span(columns[:, :-1])
    alone = np.linalg.norm(columns[:, -1] - taken @ (taken.T @ columns[:, -1]))
    spent = (near.freedom < ENOUGH) & (base.freedom >= ENOUGH)
    if alone <= _SEEN or spent.any():
        return Offset("unseen", base)
    solution = solve(wide, linear, spread, start, QUICK)
    return Offset("beyond", near) if find_limits(solution) else Offset("fitted", solution)
