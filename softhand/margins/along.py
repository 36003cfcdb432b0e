"""How fast small motions grow along a run, sample by sample."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from softhand.assembly.parts import read_start
from softhand.errors import ControllerError, ScenarioError, SimulationStopped
from softhand.margins.groups import Groups
from softhand.margins.loop import close_loop, is_stable
from softhand.margins.modes import find_modes
from softhand.margins.place import Place, find_places
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.plugins import plugin_name
from softhand.recording.recording import Recording
from softhand.scenario.scenario import Scenario, as_scenario

KEPT = 3
"""Modes of each sample."""


@dataclass(frozen=True, eq=False)
class StabilityAlong(Record):
    """The closed loop at samples of a run, each as if it stayed as it is there.

    Attributes:
        controller: name in the scenario.
        period: for which a torque is held [s].
        time: of the samples [s], shape (k,).
        growth: of the three fastest growing motions, NaN where the loop has no linear model [1/s], shape (k, 3).
        frequency: of the same [Hz], shape (k, 3).
        names: what moves most in the fastest growing, "" where there is no model.
        phases: of the run, name and begin [s].
        notes: why the run ended early, and where there is no model.
    """

    units: ClassVar = {"period": "s", "time": "s", "growth": "1/s", "frequency": "Hz"}

    controller: str
    period: float
    time: Array
    growth: Array
    frequency: Array
    names: tuple[str, ...]
    phases: tuple[tuple[str, float], ...]
    notes: tuple[str, ...]

    @property
    def grown(self) -> float:
        """Logarithm of the growth of a small motion that is the fastest at all times."""
        rate = np.nan_to_num(self.growth[:, 0])
        return float(np.sum(0.5 * (rate[1:] + rate[:-1]) * np.diff(self.time)))

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of each line of the table."""
        rows = [("samples", f"{len(self.time)} from t = {self.time[0]:g} to {self.time[-1]:g} s")]
        rate = self.growth[:, 0]
        if np.all(np.isnan(rate)):
            return [*rows, ("growth", "not known at any of them")]
        k = int(np.nanargmax(rate))
        rows.append(("largest growth", f"{rate[k]:+.3g} 1/s at t = {self.time[k]:g} s: {self.names[k]}"))
        j = int(np.nanargmin(rate))
        rows.append(("smallest", f"{rate[j]:+.3g} 1/s at t = {self.time[j]:g} s: {self.names[j]}"))
        grows = [not (math.isnan(one) or is_stable(one)) for one in rate]
        rows.append(("samples at which some motion grows", f"{sum(grows)} of {len(grows)}"))
        for name, begin, end in self._phases():
            inside = rate[(self.time >= begin) & (self.time <= end)]
            if len(inside) and not np.all(np.isnan(inside)):
                rows.append((f"largest in phase {name}", f"{np.nanmax(inside):+.3g} 1/s"))
        return rows

    def _phases(self) -> Iterator[tuple[str, float, float]]:
        ends = [*(begin for _, begin in self.phases[1:]), float(self.time[-1])][: len(self.phases)]
        for (name, begin), end in zip(self.phases, ends, strict=True):
            yield name, begin, end


def stability_along(
    source: Scenario | Recording | str | Path, count: int = 41, progress: Callable[[float], None] | None = None
) -> StabilityAlong:
    """How fast small motions grow at samples along a run, by the loop of one control period at each.

        along = softhand.stability_along("grasp-and-lift")

    Where hand and object move, the rate is that of a small motion beside the run if the loop stayed as it is there.

    Args:
        source: a scenario, its name or path, which is run; or a recording, complete or not, of which the controller
            begins anew at each sample.
        count: of samples, evenly from the first to the last, at least 2.
        progress: called with the share of the samples done.

    Raises:
        ScenarioError: the count is too small.
        RecordingError: the recording has no samples, or its scenario cannot be read.
        SofthandError: as `build`.
    """
    if isinstance(count, bool) or not isinstance(count, int) or count < 2:
        raise ScenarioError(f"count: got {count!r}; give a number of samples, at least 2.", key="count", value=count)
    source = source if isinstance(source, Recording) else as_scenario(source, None)
    found: list[tuple[float, Array, Array, str]] = []
    notes = _lost(source)
    first: Place | None = None
    places = find_places(source, count)
    while True:
        try:
            place = next(places, None)
        except SimulationStopped as stop:
            if not found:
                raise
            notes.append(str(stop))
            break
        if place is None:
            break
        first = first or place
        found.append(_at(place, notes))
        if progress is not None:
            progress(min(1.0, len(found) / count))
    assert first is not None
    times, growth, frequency, names = zip(*found, strict=True)
    setup = first.setup
    phases = setup.reference.start(read_start(setup.scenario)).phases
    return StabilityAlong(
        plugin_name("controllers", type(first.controller)), first.period, np.array(times), np.array(growth),
        np.array(frequency), names, tuple(one for one in phases if one[1] <= times[-1]), tuple(dict.fromkeys(notes)),
    )  # fmt: skip


def _lost(source: Scenario | Recording) -> list[str]:
    if isinstance(source, Recording) and not source.complete:
        return [f"the run ended early, at t = {source.stop_time:g} s: {source.reason}"]
    return []


def _at(place: Place, notes: list[str]) -> tuple[float, Array, Array, str]:
    """Time, growth and frequency of the fastest modes, and the name of the first."""
    growth, frequency, name = np.full(KEPT, np.nan), np.full(KEPT, np.nan), ""
    try:
        modes = find_modes(close_loop(place), Groups(place.plant, place.state.q))
    except ControllerError:
        raise
    except SimulationStopped as stop:
        notes.append(str(stop))
        return place.state.time, growth, frequency, name
    for k, mode in enumerate(modes[:KEPT]):
        growth[k], frequency[k] = mode.growth, mode.frequency
    return place.state.time, growth, frequency, modes[0].name
