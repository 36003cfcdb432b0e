"""Whether a loop holds where it is: how fast small motions grow, what moves in them, how far it is from loss."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from softhand.assembly.instruments import not_linear
from softhand.assembly.probe import Probe
from softhand.closed_loop.gain_loop import close_gain_loop
from softhand.closed_loop.scan import Scan, scan
from softhand.closed_loop.start import HeldStart
from softhand.controllers.regulation import Regulation
from softhand.errors import GraspError, ScenarioError
from softhand.margins.groups import Groups
from softhand.margins.loop import Loop, acceleration_at, close_loop, is_stable, without_sampling
from softhand.margins.margins import Margins, find_margins
from softhand.margins.modes import Mode, find_modes
from softhand.margins.place import At, Place, find_place
from softhand.margins.scatter import Scatter, find_scatter
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.plant.plant import Plant
from softhand.plugins import plugin_name
from softhand.recording.recording import Recording
from softhand.references.reference import resting
from softhand.scenario.scenario import Scenario, as_scenario

STIFFNESS = np.geomspace(0.3, 30.0, 41)
GAIN = np.geomspace(0.1, 100.0, 61)
"""Factors of the scan on the coefficients of the tips and on K_O."""

_AT_REST = 1e-6  # [m/s^2 or rad/s^2, m/s or rad/s]
_TOLD = 4  # modes in the table


@dataclass(frozen=True, eq=False)
class Stability(Record):
    """The closed loop about a state of a run.

    Attributes:
        controller: name in the scenario.
        period: for which a torque is held [s].
        growth: rate of the fastest growing small motion without sampling [1/s], below 0 if all die out; NaN for a
            controller whose torque depends on what it remembers of earlier samples, and where a tip slips.
        held_growth: the same with the torque held for the period [1/s].
        use: share of the contact stiffness that K_O takes, see `InvariantSet`; NaN but for `regulation` at rest.
        modes: the motions that keep their shape, the fastest growing first.
        acceleration: of joints and object at the state under the torques there, zero at rest, shape (nv,).
        velocity: of the same, shape (nv,).
        loop: plant and controller as matrices.
        scatter: what the noise of instruments and drives leaves in pose and force; None where the scenario has none.
        margins: how far the loop is from where it is lost; None if not asked for.
        scan: growth over the stiffness of the tips and K_O; None if not asked for.
        time: of the state [s].
        where: that in words.
        place: the state itself.
    """

    units: ClassVar = {
        "time": "s", "period": "s", "growth": "1/s", "held_growth": "1/s", "use": "1",
        "acceleration": "rad/s^2, m/s^2", "velocity": "rad/s, m/s",
    }  # fmt: skip
    unreported: ClassVar = frozenset({"place"})

    controller: str
    period: float
    growth: float
    held_growth: float
    use: float
    modes: tuple[Mode, ...]
    acceleration: Array
    velocity: Array
    loop: Loop
    scatter: Scatter | None
    margins: Margins | None
    scan: Scan | None
    time: float
    where: str
    place: Place

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of each line of the table."""
        rows = [("about", self.where)]
        if not math.isnan(self.use):
            rows.append(("share of the contact stiffness that K_O takes", f"{self.use:.3g}"))
            rows.append(("L of (60) singular at K_O times", f"{1.0 / self.use:.3g}" if self.use else "none: it is 0"))
        rows.append(("growth without sampling", self._unsampled()))
        rows.append((f"growth with torques held for {1e3 * self.period:g} ms", _growth(self.held_growth)))
        for k, mode in enumerate(self.modes[:_TOLD]):
            ringing = f" at {mode.frequency:.3g} Hz, damping ratio {mode.damping:.2g}" if mode.frequency else ""
            rows.append((f"mode {k + 1}", f"{mode.growth:+.3g} 1/s{ringing}: {mode.name}"))
        rows += self._unrest()
        rows += [("at a switch", f"{one.where}: {one.what}, {one.side}") for one in self.loop.switches]
        if missing := not_linear(self.place.setup.scenario):
            rows.append(("left out of the loop", ", ".join(missing)))
        for more in (self.scatter, self.margins):
            rows += more.rows() if more else []
        return rows

    def _unsampled(self) -> str:
        if math.isnan(self.growth) and self.loop.is_smooth:
            return "not defined: a contact slips"
        return _growth(self.growth)

    def _unrest(self) -> list[tuple[str, str]]:
        rows = []
        for values, word, per in ((self.velocity, "moves at", "s"), (self.acceleration, "accelerates with", "s^2")):
            k = int(np.argmax(np.abs(values)))
            if abs(values[k]) > _AT_REST:
                unit = f"{self.loop.state_units[k]}/{per}"
                rows.append(("not at rest there", f"{self.loop.states[k]} {word} {abs(values[k]):.3g} {unit}"))
        if rows:
            rows.append(("the rates are those", "of small motions beside the motion that goes on, as of now"))
        return rows

    def to_control(self) -> Any:
        """The loop as a `control.StateSpace` of python-control, sampled at the control period, with all names.

        Inputs are torques beyond those of the controller, outputs displacements of joints, object and internal forces.

        Raises:
            SofthandError: python-control is not installed.
        """
        from softhand.margins.state_space import to_control

        return to_control(self.loop)

    def mode_recording(self, number: int = 1) -> Recording:
        """One mode to look at, see `record_mode`.

        Args:
            number: of the mode, from 1.

        Raises:
            ScenarioError: there is no such mode.
        """
        from softhand.margins.mode_recording import record_mode

        if isinstance(number, bool) or not isinstance(number, int) or not 1 <= number <= len(self.modes):
            raise ScenarioError(
                f"mode: got {number!r}; this loop has modes 1, the fastest growing, to {len(self.modes)}.",
                key="mode", value=number,
            )  # fmt: skip
        return record_mode(self.place, self.modes[number - 1])


def stability(
    source: Scenario | Recording | str | Path,
    with_scan: bool = False,
    progress: Callable[[float], None] | None = None,
    *,
    at: At | None = None,
    with_margins: bool = False,
) -> Stability:
    """How fast small motions grow or die out under a controller, about any state of a run.

        found = softhand.stability("hold", with_margins=True)
        print(found.modes[0], found.margins.delay)

    It is the loop of one control period as `linearize` has it: the plant that runs, any law, hand and support, and the
    controller, differenced through what it is handed and remembers. The plant goes in steps of a tenth of the period or
    less, so that the rates are those of the plant and not of its steps. Where contacts stick, what they store goes with
    the motion by rolling. Delays, holds, filters and lags of instruments and drives are part of the loop, and their
    noise is told as what it leaves in pose and forces. Large motions are not seen, nor rounding and rate limits.

    Args:
        source: a scenario, its name or path, or a recording, of which the controller begins anew at the state and
            relaxing dampings count as relaxed.
        with_scan: whether K_O of `regulation` is scanned against the stiffness of the tips; about a start only.
        progress: called with the share of scan and margins done.
        at: `start`, `end`, a time of the run [s], or a state such as that of an `Equilibrium`; by default the start of
            a scenario and the end of a recording, see `find_place`.
        with_margins: whether delay, control period, gains and torques are found at which the loop is lost.

    Raises:
        GraspError: there is no start at rest, or `regulation` has open fingers.
        LawError: the scan has no law whose coefficients scale its force.
        RecordingError: the recording is empty, or its scenario cannot be read.
        ScenarioError: `at` is no time of the run, or the scan is asked for where there is none.
        SimulationStopped: the run of a scenario is lost before, or its control period has no derivative there.
        ControllerError: the controller raised.
    """
    if not isinstance(source, Recording):
        source = as_scenario(source, None)
    place = find_place(source, at)
    is_regulation = isinstance(place.controller, Regulation)
    if with_scan:
        _check_scan(source, at, place)
    if place.goal and place.goal.opening and is_regulation:
        raise GraspError(
            f"the fingers {'are' if place.state.time else 'start'} open: there is no grasp to linearize; set "
            "grasp.opening = 0 and grasp.internal_force.",
            finger="", quantity="opening", value=place.goal.opening,
        )  # fmt: skip
    loop = close_loop(place, with_outputs=True)
    share, scanned = 0.5 if with_scan and with_margins else 1.0, None
    tell = progress or (lambda done: None)
    margins = find_margins(loop, place, lambda done: tell(done * share)) if with_margins else None
    if with_scan:
        assert isinstance(source, Scenario)
        begin = 1.0 - share if with_margins else 0.0
        scanned = scan(source, STIFFNESS.tolist(), GAIN.tolist(), lambda k: tell(begin + share * k / len(STIFFNESS)))
    return Stability(
        controller=plugin_name("controllers", type(place.controller)),
        period=place.period,
        growth=without_sampling(loop, place),
        held_growth=loop.growth,
        use=_use(place) if is_regulation else math.nan,
        modes=find_modes(loop, Groups(place.plant, place.state.q)),
        acceleration=acceleration_at(place),
        velocity=place.state.v.copy(),
        loop=loop,
        scatter=find_scatter(loop, place),
        margins=margins,
        scan=scanned,
        time=place.state.time,
        where=place.words,
        place=place,
    )


def _check_scan(source: Scenario | Recording, at: At | None, place: Place) -> None:
    if isinstance(source, Recording) or at not in (None, "start") or not isinstance(place.controller, Regulation):
        raise ScenarioError(
            "with_scan: K_O is scanned about the start of a scenario with the controller regulation; leave it out.",
            key="with_scan", value=True,
        )  # fmt: skip


def _use(place: Place) -> float:
    """Share of the contact stiffness that K_O takes."""
    if place.goal is None:
        return math.nan
    setup = place.setup
    probe = Probe(Plant(setup.world, setup.fingertips, setup.supports, taxels=setup.taxels), resting(place.goal))
    return close_gain_loop(HeldStart(probe, place.state, place.controller, place.period)).use


def _growth(rate: float) -> str:
    if math.isnan(rate):
        return "not defined: the torque depends on earlier samples"
    if is_stable(rate) and is_stable(-rate):
        return "none  (some motion stays as it is)"
    return f"{rate:+.3g} 1/s" + ("  (all motions die out)" if rate < 0.0 else "  (unstable)")
