"""Figures with their derivatives, of which the gradient of a run is known, and the search along them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize

from softhand.analysis.performance import WINDOW
from softhand.derivatives.costs import PeakCost, QuadraticCost
from softhand.derivatives.gradient import gradient
from softhand.errors import GraspError, SimulationStopped
from softhand.numerics.arrays import Array
from softhand.scenario.scenario import Scenario
from softhand.tuning.knobs import Knobs
from softhand.tuning.objective import Objective
from softhand.tuning.search import Best

WITH_SLOPES = ("effort", "tracking", "position_error", "force_error", "friction_use")
"""Figures that have a gradient."""

RUNS = 4
"""What a run and its gradient count as, of one figure."""

_LOST = 1e3


class Sloped(NamedTuple):
    """Figures in all worlds at one point.

    Attributes:
        figures: shape (worlds, figures); NaN of a lost run.
        lost: shape (worlds,), as of `Tried`.
        slopes: by the coordinates of the unit cube, shape (worlds, figures, n).
    """

    figures: Array
    lost: Array
    slopes: Array


def has_slopes(base: Scenario, names: Sequence[str]) -> bool:
    """Whether all figures of a scenario have a gradient."""
    plain = base.sensing is None and base.actuation is None and base.stepper.name == "midpoint"
    return plain and set(names) <= set(WITH_SLOPES)


class Slopes:
    """Figures and their derivatives at points of the unit cube.

    Args:
        base: the scenario.
        knobs: what is turned.
        worlds: values put over it.
        names: of the figures.
        tell: called with the number of further runs that are done.
    """

    def __init__(
        self, base: Scenario, knobs: Knobs, worlds: Sequence[Mapping[str, Any]], names: Sequence[str],
        tell: Callable[[int], None],
    ) -> None:  # fmt: skip
        self.base, self.knobs, self.worlds, self.names, self.tell = base, knobs, worlds, tuple(names), tell
        self._last: tuple[bytes, Sloped] | None = None

    def at(self, point: Array) -> Sloped:
        """All figures at a point; that of the last call is kept."""
        key = point.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = key, self._find(point)
        return self._last[1]

    def _find(self, point: Array) -> Sloped:
        shape = len(self.worlds), len(self.names)
        figures, lost = np.full(shape, np.nan), np.zeros(len(self.worlds))
        slopes = np.zeros((*shape, len(self.knobs)))
        values = self.knobs.values(self.knobs.numbers(point))
        for w, world in enumerate(self.worlds):
            scenario = self.base.with_values({**world, **values})
            try:
                for f, name in enumerate(self.names):
                    figures[w, f], slopes[w, f] = self._of(scenario, name, point)
            except SimulationStopped as stop:
                if stop.reason == "interrupted":
                    raise
                lost[w] = 2.0 - min(stop.time / self.base.duration, 1.0)
            except GraspError:
                lost[w] = 2.0
            figures[w, lost[w] > 0.0] = np.nan
            self.tell(RUNS * len(self.names))
        return Sloped(figures, lost, slopes)

    def _of(self, scenario: Scenario, name: str, point: Array) -> tuple[float, Array]:
        parts = [part for knob in self.knobs.knobs for part in knob.parts]
        found = gradient(scenario, _cost_of(name, scenario), [part.name for part in parts])
        by_name = dict(zip(found.parameters, found.slopes, strict=True))
        value, share = found.value, 1.0
        if name != "friction_use":  # a root mean square
            every = scenario.control_period
            samples = round(scenario.duration / every) + 1 if name in ("effort", "tracking") else round(WINDOW / every)
            value = math.sqrt(found.value / (every * samples))
            share = 1.0 / (2.0 * every * samples * value) if value else 0.0
        slopes = [
            share * knob.slope(float(u)) * sum(
                by_name[part.name] * (part.value if knob.is_factor else 1.0) for part in knob.parts
            )
            for knob, u in zip(self.knobs.knobs, point, strict=True)
        ]  # fmt: skip
        return value, np.array(slopes)


def _cost_of(name: str, scenario: Scenario) -> QuadraticCost | PeakCost:
    """The cost of a run that a figure is made of."""
    start = scenario.duration - WINDOW + scenario.control_period
    costs: dict[str, QuadraticCost | PeakCost] = {
        "effort": QuadraticCost("joint_torque"),
        "tracking": QuadraticCost("object_position", "object_position_desired", 1e6),
        "position_error": QuadraticCost("object_position", "object_position_desired", 1e6, start=start),
        "force_error": QuadraticCost("internal_force", "internal_force_desired", start=start),
        "friction_use": PeakCost("friction_use"),
    }
    return costs[name]


def search_gradient(slopes: Slopes, objective: Objective, best: Best, evaluations: int) -> None:
    """By sequential least squares (SLSQP) within the unit cube, the limits as constraints.

    Args:
        slopes: figures and their derivatives.
        objective: what they cost.
        best: the start, with its cost; brought up to date.
        evaluations: at most.

    Raises:
        SofthandError: as `gradient`.
    """
    limited = [k for k, bound in enumerate(objective.bounds) if math.isfinite(bound.limit)]
    seen: set[bytes] = set()

    def figures(point: Array) -> tuple[Array, Array] | None:
        """Figures over the worlds and their slopes, shapes (figures,) and (figures, n)."""
        point = np.clip(point, 0.0, 1.0)
        if point.tobytes() not in seen and len(seen) >= evaluations:
            raise _Enough
        found = slopes.at(point)
        if point.tobytes() not in seen:
            seen.add(point.tobytes())
            best.take([point], [objective(found.figures, found.lost)])
        if np.any(found.lost > 0.0):
            return None
        worst = np.argmax(found.figures, axis=0)
        over, along = [], []
        for k, bound in enumerate(objective.bounds):
            over.append(found.figures[worst[k], k] if bound.worst else np.mean(found.figures[:, k]))
            along.append(found.slopes[worst[k], k] if bound.worst else np.mean(found.slopes[:, k], axis=0))
        return np.array(over), np.array(along)

    def cost(point: Array) -> tuple[float, Array]:
        found = figures(point)
        if found is None:
            return _LOST, np.zeros(len(point))
        weights = np.array([bound.weight / bound.scale for bound in objective.bounds])
        return float(weights @ found[0]), weights @ found[1]

    def room(point: Array) -> Array:
        found = figures(point)
        return np.full(len(limited), -1.0) if found is None else objective.room(found[0])[limited]

    def room_slopes(point: Array) -> Array:
        found = figures(point)
        if found is None:
            return np.zeros((len(limited), len(point)))
        return -found[1][limited] / objective.within()[limited, None]

    constraints = [{"type": "ineq", "fun": room, "jac": room_slopes}] if limited else []
    with suppress(_Enough):
        minimize(cost, best.point, jac=True, method="SLSQP", bounds=[(0.0, 1.0)] * len(best.point),
                 constraints=constraints, options={"maxiter": evaluations, "ftol": 1e-6})  # fmt: skip


class _Enough(Exception):
    """The evaluations are used up."""
