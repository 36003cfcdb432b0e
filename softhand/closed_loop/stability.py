"""Whether a controller holds the start of a scenario, or the end of a run: how fast small motions grow there."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from softhand.closed_loop.gain_loop import close_gain_loop
from softhand.closed_loop.linearize import LinearModel
from softhand.closed_loop.loop import ROUNDING, close_loop
from softhand.closed_loop.scan import Scan, scan
from softhand.closed_loop.start import HeldStart, held_end, held_start
from softhand.controllers.regulation import Regulation
from softhand.errors import GraspError
from softhand.numerics.record import Record
from softhand.plugins import plugin_name
from softhand.recording.recording import Recording
from softhand.scenario.scenario import Scenario

STIFFNESS = np.geomspace(0.3, 30.0, 41)
GAIN = np.geomspace(0.1, 100.0, 61)
"""Factors of the scan on the coefficients of the tips and on K_O."""

_AT_REST = 1e-6  # [m/s^2 or rad/s^2]


@dataclass(frozen=True, eq=False)
class Stability(Record):
    """The closed loop about the start of a scenario, or the end of a run, which is asked to stay there.

    Attributes:
        controller: name in the scenario.
        period: for which a torque is held [s].
        growth: rate of the fastest growing small motion without sampling [1/s], below 0 if all die out; NaN for a
            controller whose torque depends on what it remembers of earlier samples.
        held_growth: the same with the torque held for the period [1/s].
        use: share of the contact stiffness that K_O takes, see `InvariantSet`; NaN but for `regulation`.
        model: the plant without its controller.
        scan: growth over the stiffness of the tips and K_O; None but for `regulation`, or if not asked for.
        time: of the sample of a run [s]; 0 for the start.
    """

    units: ClassVar = {"time": "s", "period": "s", "growth": "1/s", "held_growth": "1/s", "use": "1"}

    controller: str
    period: float
    growth: float
    held_growth: float
    use: float
    model: LinearModel
    scan: Scan | None
    time: float = 0.0

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of each line of the table."""
        rows = [("about", f"the sample at t = {self.time:g} s" if self.time else "the start")]
        if not math.isnan(self.use):
            rows.append(("share of the contact stiffness that K_O takes", f"{self.use:.3g}"))
            rows.append(("L of (60) singular at K_O times", f"{1.0 / self.use:.3g}" if self.use else "no share of it"))
        rows.append(("growth without sampling", _growth(self.growth)))
        rows.append((f"growth with torques held for {1e3 * self.period:g} ms", _growth(self.held_growth)))
        restless = np.abs(self.model.acceleration)
        if restless.max() > _AT_REST:
            where = self.model.states[int(np.argmax(restless))]
            unit = "m/s^2" if where in ("object x", "object y", "object z") else "rad/s^2"
            rows.append(("not at rest there", f"{where} starts with {restless.max():.3g} {unit}"))
        return rows


def stability(
    scenario: Scenario | Recording, with_scan: bool = True, progress: Callable[[float], None] | None = None
) -> Stability:
    """How fast small motions grow or die out under a controller, about the start of a scenario or the end of a run.

    The plant is linear about that state (`linearize_plant`), the controller is differenced through the observation that
    it is handed and its memory (`differentiate`). The contacts roll; effort limits and large motions are not seen.

    Args:
        scenario: whose start is held, with `regulation` not one with open fingers; or a recording, whose quietest
            sample is held since the reference stands still, the last one if it never does.
        with_scan: whether K_O of `regulation` is scanned against the stiffness of the tips; about a start only.
        progress: called with the share of the scan done.

    Raises:
        GraspError: there is no start at rest, or `regulation` has open fingers.
        LawError: the scan has no law whose coefficients scale its force.
        RecordingError: the recording is empty, or its scenario cannot be read.
    """
    if isinstance(scenario, Recording):
        return _about(held_end(scenario))
    start = held_start(scenario)
    if scenario.grasp.opening and isinstance(start.controller, Regulation):
        raise GraspError(
            "the fingers start open: there is no grasp to linearize; set grasp.opening = 0 and grasp.internal_force.",
            finger="", quantity="opening", value=scenario.grasp.opening,
        )  # fmt: skip
    found = _about(start)
    if not (with_scan and isinstance(start.controller, Regulation)):
        return found
    report = (lambda done: progress(done / len(STIFFNESS))) if progress else None
    return replace(found, scan=scan(scenario, STIFFNESS.tolist(), GAIN.tolist(), report))


def _about(start: HeldStart) -> Stability:
    name, period = plugin_name("controllers", type(start.controller)), start.period
    if not isinstance(start.controller, Regulation):
        loop = close_loop(start)
        growth, held = loop.growth(), loop.held_growth(period)
        return Stability(name, period, growth, held, math.nan, loop.model, None, start.time)
    gains = close_gain_loop(start)
    held = float(gains.held_growth([gains.K_O], period)[0])
    return Stability(name, period, gains.growth(gains.K_O), held, gains.use, gains.model, None, start.time)


def _growth(rate: float) -> str:
    if math.isnan(rate):
        return "not defined: the torque depends on earlier samples"
    if abs(rate) < ROUNDING:
        return "none  (some motion stays as it is)"
    return f"{rate:+.3g} 1/s" + ("  (all motions die out)" if rate < 0.0 else "  (unstable)")
