"""Error-controlled integration with scipy: the reference for all other steppers."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import DOP853

from softhand.numerics.arrays import AnyArray, Array
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.settings.settings import Positive
from softhand.steppers.flow import Flow
from softhand.steppers.stepper import Integration, Stepper, check_friction

_MOST_SUBSTEPS = 1000  # a run that asks for more is lost: it would crawl for ever


class Adaptive(Stepper):
    """Explicit Runge-Kutta of order 8 (Dormand-Prince 853, scipy) with error control.

    Each `step` is integrated in as many sub-steps as the tolerances ask for. Slow and exact: use it to judge others.
    """

    rtol: Positive = 1e-9
    """Relative tolerance [1]."""
    atol: Positive = 1e-11
    """Absolute tolerance of each number of the state, in its SI unit."""

    def start(self, plant: Plant) -> Integration:
        """Ready to integrate this plant."""
        check_friction(self, plant.world.mechanics.friction)
        return _AdaptiveIntegration(plant, self)


class _AdaptiveIntegration(Integration):
    def __init__(self, plant: Plant, settings: Adaptive) -> None:
        super().__init__(plant)
        self._plant, self._flow, self._settings = plant, Flow(plant), settings
        self._y = np.zeros(self._flow.size)
        self._first_step: float | None = None

    def restart(self) -> None:
        self._first_step = None

    def carry(self) -> dict[str, AnyArray]:
        return {"first_step": np.array([self._first_step or 0.0])}

    def resume(self, carried: dict[str, AnyArray]) -> None:
        self._first_step = float(carried["first_step"][0]) or None

    def advance(self, state: State, torque: Array) -> None:
        flow, settings = self._flow, self._settings
        self._plant.settle(state)
        flow.gather(state, self._y)

        def rate(_time: float, y: Array) -> Array:
            return flow.rate(y, torque, np.empty(flow.size))

        options: dict[str, Any] = {"rtol": settings.rtol, "atol": settings.atol, "first_step": self._first_step}
        solver = DOP853(rate, 0.0, self._y.copy(), settings.step, **options)
        for _ in range(_MOST_SUBSTEPS):
            message = solver.step()
            if solver.status != "running":
                break
        if solver.status != "finished":
            raise FloatingPointError(message or f"more than {_MOST_SUBSTEPS} sub-steps in {settings.step:g} s")
        self._first_step = min(settings.step, float(solver.h_abs))
        flow.scatter(solver.y, state)
        self._plant.settle(state, settings.step)
