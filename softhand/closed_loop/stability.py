"""Whether a controller holds the start of a scenario: how fast small motions grow there."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from softhand.closed_loop.gain_loop import close_gain_loop
from softhand.closed_loop.linearize import LinearModel
from softhand.closed_loop.loop import close_loop
from softhand.closed_loop.scan import Scan, scan
from softhand.closed_loop.start import HeldStart, held_start
from softhand.controllers.regulation import Regulation
from softhand.errors import GraspError
from softhand.numerics.record import Record
from softhand.scenario.scenario import Scenario

STIFFNESS = np.geomspace(0.3, 30.0, 41)
GAIN = np.geomspace(0.1, 100.0, 61)
"""Factors of the scan on the coefficients of the tips and on K_O."""

_ROUNDING = 1e-6  # [1/s] of a growth that is zero
_AT_REST = 1e-6  # [m/s^2 or rad/s^2]


@dataclass(frozen=True, eq=False)
class Stability(Record):
    """The closed loop about the start of a scenario, which is asked to stay there.

    Attributes:
        controller: name in the scenario.
        period: for which a torque is held [s].
        growth: rate of the fastest growing small motion without sampling [1/s], below 0 if all die out; NaN for a
            controller whose torque depends on what it remembers of earlier samples.
        held_growth: the same with the torque held for the period [1/s].
        use: share of the contact stiffness that K_O takes, see `InvariantSet`; NaN but for `regulation`.
        model: the plant without its controller.
        scan: growth over the stiffness of the tips and K_O; None but for `regulation`, or if not asked for.
    """

    units: ClassVar = {"period": "s", "growth": "1/s", "held_growth": "1/s", "use": "1"}

    controller: str
    period: float
    growth: float
    held_growth: float
    use: float
    model: LinearModel
    scan: Scan | None

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of each line of the table."""
        rows = []
        if not math.isnan(self.use):
            rows.append(("share of the contact stiffness that K_O takes", f"{self.use:.3g}"))
            rows.append(("L of (60) singular at K_O times", f"{1.0 / self.use:.3g}"))
        rows.append(("growth without sampling", _growth(self.growth)))
        rows.append((f"growth with torques held for {1e3 * self.period:g} ms", _growth(self.held_growth)))
        restless = np.abs(self.model.acceleration)
        if restless.max() > _AT_REST:
            where = self.model.states[int(np.argmax(restless))]
            unit = "m/s^2" if where in ("object x", "object y", "object z") else "rad/s^2"
            rows.append(("not at rest there", f"{where} starts with {restless.max():.3g} {unit}"))
        return rows


def stability(scenario: Scenario, with_scan: bool = True, progress: Callable[[float], None] | None = None) -> Stability:
    """How fast small motions about the start of a scenario grow or die out under its controller.

    The plant is linear about the start (`linearize`), the controller is differenced through the observation that it is
    handed and its memory (`differentiate`). The contacts roll; effort limits and large motions are not seen.

    Args:
        scenario: whose start is held; with `regulation` not one with open fingers.
        with_scan: whether K_O of `regulation` is scanned against the stiffness of the tips.
        progress: called with the share of the scan done.

    Raises:
        GraspError: there is no start at rest, or `regulation` has open fingers.
        LawError: the scan has no law whose coefficients scale its force.
    """
    start = held_start(scenario)
    if not isinstance(start.controller, Regulation):
        loop = close_loop(start)
        return _found(start, scenario, (loop.growth(), loop.held_growth(start.period), math.nan), loop.model, None)
    if scenario.grasp.opening:
        raise GraspError(
            "the fingers start open: there is no grasp to linearize; set grasp.opening = 0 and grasp.internal_force.",
            finger="", quantity="opening", value=scenario.grasp.opening,
        )  # fmt: skip
    gains = close_gain_loop(start)
    held = float(gains.held_growth([gains.K_O], start.period)[0])
    swept = None
    if with_scan:
        report = (lambda done: progress(done / len(STIFFNESS))) if progress else None
        swept = scan(scenario, STIFFNESS.tolist(), GAIN.tolist(), report)
    return _found(start, scenario, (gains.growth(gains.K_O), held, gains.use), gains.model, swept)


def _found(
    start: HeldStart, scenario: Scenario, figures: tuple[float, float, float], model: LinearModel, swept: Scan | None
) -> Stability:
    growth, held, use = figures
    return Stability(scenario.controller.name, start.period, growth, held, use, model, swept)


def _growth(rate: float) -> str:
    if math.isnan(rate):
        return "not defined: the torque depends on earlier samples"
    if abs(rate) < _ROUNDING:
        return "none  (some motion stays as it is)"
    return f"{rate:+.3g} 1/s" + ("  (all motions die out)" if rate < 0.0 else "  (unstable)")
