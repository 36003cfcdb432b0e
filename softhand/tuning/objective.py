"""What a candidate costs: weighted figures over the worlds, what is beyond limits, and runs that are lost."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from softhand.numerics.arrays import Array
from softhand.tuning.figures import FIGURES
from softhand.tuning.settings import Method, Term

STEEP = 30.0
"""Cost of what is beyond a limit, as a share of the limit: more than any figure could win there."""

_NOTHING = 1e3
"""Cost of a candidate that loses all its runs, beside that of the lost ones."""


class Bound(NamedTuple):
    """A term with its numbers.

    Attributes:
        name: in `FIGURES`.
        weight: as set.
        scale: the cost is weight figure / scale.
        limit: largest figure, or infinity.
        worst: whether the worst world counts in place of the mean.
    """

    name: str
    weight: float
    scale: float
    limit: float
    worst: bool


class Objective:
    """What candidates cost.

        cost = sum_i w_i F_i / s_i + 30 sum_i max(0, F_i / ((1 - m) l_i) - 1) + c mean(lost)

    F_i is the mean of a figure, or its worst, over the worlds whose run came to its end; s_i the figure before, l_i
    the limit, m the margin, lost from 1 to 2 for a run that did not.

    Args:
        terms: weight and limit by figure.
        method: margin and cost of lost runs.
        before: figures of the scenario as it is, shape (worlds, figures), at least one run without NaN.
    """

    def __init__(self, terms: Mapping[str, Term], method: Method, before: Array) -> None:
        self.method = method
        over = over_worlds(terms, before)
        self.bounds = tuple(
            Bound(
                name, term.weight, max(abs(float(own)), FIGURES[name].least),
                float(own) if term.at_most == "before" else np.inf if term.at_most is None else float(term.at_most),
                term.over == "worst",
            )
            for (name, term), own in zip(terms.items(), over, strict=True)
        )  # fmt: skip
        self._terms = terms

    def __call__(self, figures: Array, lost: Array) -> float:
        """The cost of one candidate.

        Args:
            figures: shape (worlds, figures); NaN of lost runs.
            lost: shape (worlds,).
        """
        total = self.method.lost * float(np.mean(lost))
        if np.all(lost > 0.0):
            return total + _NOTHING
        for bound, own in zip(self.bounds, over_worlds(self._terms, figures), strict=True):
            total += bound.weight * float(own) / bound.scale + STEEP * self.excess(bound, float(own))
        return total

    def excess(self, bound: Bound, figure: float) -> float:
        """How far a figure is beyond its limit less the margin, as a share of that."""
        return max(0.0, figure / self._within(bound) - 1.0)

    def room(self, over: Array) -> Array:
        """How far figures are within their limits less the margin, as shares of these, shape (figures,)."""
        return 1.0 - over / self.within()

    def within(self) -> Array:
        """Limits less the margin, shape (figures,)."""
        return np.array([self._within(bound) for bound in self.bounds])

    def _within(self, bound: Bound) -> float:
        return max((1.0 - self.method.margin) * bound.limit, FIGURES[bound.name].least)


def over_worlds(terms: Mapping[str, Term], figures: Array) -> Array:
    """The mean of each figure over the worlds, or its worst, lost runs left out, shape (figures,).

    Args:
        terms: in the order of the figures.
        figures: shape (worlds, figures).
    """
    there = figures[~np.any(np.isnan(figures), axis=1)]
    return np.array(
        [np.max(there[:, k]) if term.over == "worst" else np.mean(there[:, k]) for k, term in enumerate(terms.values())]
    )
