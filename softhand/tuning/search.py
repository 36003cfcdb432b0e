"""The search for the point of the unit cube that costs least."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from softhand.errors import SofthandError
from softhand.numerics.arrays import Array
from softhand.tuning.settings import Method

Cost = Callable[[Sequence[Array]], Sequence[float]]
"""Costs of points, each of shape (n,) within the unit cube."""

_STILL = {"tolx": 1e-4, "tolfun": 1e-6}  # of the unit cube, of the cost: what is finer is not worth a run


@dataclass
class Best:
    """The best point so far, and how it was found.

    Attributes:
        point: shape (n,).
        cost: of it.
        history: number of candidates, and the best cost then.
    """

    point: Array
    cost: float
    history: list[tuple[int, float]] = field(default_factory=list)

    def take(self, points: Sequence[Array], costs: Sequence[float]) -> None:
        """Candidates with their costs; the first one of the least cost stays."""
        k = int(np.argmin(costs))
        if costs[k] < self.cost:
            self.point, self.cost = np.array(points[k]), float(costs[k])
        self.history.append(((self.history[-1][0] if self.history else 0) + len(points), self.cost))


def search_cma(cost: Cost, best: Best, method: Method, candidates: int) -> None:
    """By evolution of a normal distribution with its covariance (CMA-ES), within the unit cube.

    Hansen, Ostermeier, "Completely derandomized self-adaptation in evolution strategies", 2001, as the authors'
    package has it.

    Args:
        cost: of points.
        best: the start, with its cost; brought up to date after each generation.
        method: step, population and seed.
        candidates: at most, whole generations and at least one.

    Raises:
        SofthandError: the package is not installed.
    """
    cma = _cma()
    n = len(best.point)
    rng = np.random.default_rng([method.seed, n])
    size = method.population or 4 + int(3 * math.log(max(n, 2)))
    padded = best.point if n > 1 else np.append(best.point, 0.5)  # it has no place for one number alone
    options: dict[str, Any] = {
        "bounds": [0.0, 1.0], "popsize": size, "verbose": -9, "seed": math.nan, "maxiter": max(candidates // size, 1),
        "randn": lambda *shape: rng.standard_normal(shape), **_STILL,
    }  # fmt: skip
    strategy = cma.CMAEvolutionStrategy(padded.tolist(), method.step, options)
    while not strategy.stop():
        asked = strategy.ask()
        points = [np.clip(np.asarray(one)[:n], 0.0, 1.0) for one in asked]
        costs = [float(one) for one in cost(points)]
        strategy.tell(asked, costs)
        best.take(points, costs)


def _cma() -> Any:
    try:
        import cma
    except ImportError as error:
        raise SofthandError(
            'the search by cma needs a package that is not installed: pip install "softhand[tune]".', value="cma"
        ) from error
    return cma
