"""How near slip is along a recording: the margin of each tip, how long it will last, and where it warns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from softhand.errors import RecordingError, ScenarioError
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.numerics.table import html_table
from softhand.recording.events import Event
from softhand.recording.recording import Recording

WARNING = "slip warning"
_STILL = 1e-6  # [1/s] slower than which a margin does not fall
_GAP = 0.02  # [s] that does not part two warnings
_TOLD = 5
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class SlipMargin(Record):
    """How near slip the tips of a run are.

    Attributes:
        time: [s], shape (samples,).
        margin: share of the limit surface that is left free at each tip, 1 - sqrt(H) / (mu f_z); 0 in slip, below
            where a tip that cannot slip would, NaN off the object, shape (samples, nc).
        least: of all tips that touch, NaN if none does, shape (samples,).
        hold_time: until the first margin is used up if all go on as they have over `window`; infinite while none falls,
            0 in slip, NaN where it is not known [s], shape (samples,).
        warning: margin below which a tip warns.
        window: [s].
        events: where a tip begins to be below `warning`.
        contacts: names.
    """

    units: ClassVar = {
        "time": "s", "margin": "1", "least": "1", "hold_time": "s", "warning": "1", "window": "s", "factor": "1",
    }  # fmt: skip
    unreported: ClassVar = frozenset({"events"})

    time: Array
    margin: Array
    least: Array
    hold_time: Array
    warning: float
    window: float
    events: tuple[Event, ...]
    contacts: tuple[str, ...]

    @property
    def factor(self) -> Array:
        """By which friction and torsion of the nearest tip could grow at the same normal force, shape (samples,)."""
        return np.asarray(1.0 / np.maximum(1.0 - self.least, 1e-12))

    def __repr__(self) -> str:
        return f"<SlipMargin: {'; '.join(': '.join(row) for row in self.rows())}>"

    def _repr_html_(self) -> str:
        """The table of the command, for a notebook."""
        return html_table("Margin to slip", ("", ""), self.rows())

    def rows(self) -> list[tuple[str, str]]:
        """Label and value."""
        if np.all(np.isnan(self.least)):
            return [("least margin", "no tip touches")]
        k = int(np.nanargmin(self.least))
        tip = self.contacts[int(np.nanargmin(self.margin[k]))]
        rows = [("least margin", f"{100.0 * self.least[k]:.3g} % at {tip}, t = {self.time[k]:.3f} s")]
        gone = np.flatnonzero(self.least <= 0.0)
        rows.append(("first slip", f"t = {self.time[gone[0]]:.3f} s" if len(gone) else "none"))
        if self.events:
            j = int(np.searchsorted(self.time, self.events[0].time))
            hold = self.hold_time[j]
            told = (
                "not known yet" if np.isnan(hold) else "endless, no margin falls" if np.isinf(hold) else f"{hold:.3g} s"
            )
            rows.append(("hold time foreseen at the first warning", told))
        rows += [(WARNING, f"{event.text}, t = {event.time:.3f} s") for event in self.events[:_TOLD]]
        if len(self.events) > _TOLD:
            rows.append((WARNING, f"{len(self.events) - _TOLD} more"))
        return rows if self.events else [*rows, (WARNING, f"none below {100.0 * self.warning:.3g} %")]


def slip_margin(recording: Recording, warning: float = 0.2, window: float = 0.2) -> SlipMargin:
    """The margin to slip of each tip along a run, by the same limit surface that the tips slip at.

    The hold time extrapolates the margin of each tip by the slope of its least-squares line over the last `window`.

    Args:
        recording: with `limit_surface_use` and `contact_force`.
        warning: margin below which a tip warns, from 0 to 1.
        window: over which a trend is taken [s].

    Raises:
        RecordingError: one of the two was not recorded, or there are no samples.
        ScenarioError: `warning` or `window` cannot be used.
    """
    if not 0.0 <= warning <= 1.0:
        raise ScenarioError(f"warning: got {warning!r}; give a share from 0 to 1.", key="warning", value=warning)
    if not window > 0.0:
        raise ScenarioError(f"window: got {window!r}; give a time above 0 s.", key="window", value=window)
    missing = [name for name in ("limit_surface_use", "contact_force") if name not in recording.variables]
    if missing or not len(recording):
        what = f"lacks {' and '.join(missing)}; record it" if missing else "has no samples"
        raise RecordingError(f"the margin to slip cannot be told: the recording {what}.", file=None)
    touching = recording.contact_force[:, :, 2] > 0.0
    margin = np.where(touching, 1.0 - recording.limit_surface_use, np.nan)
    if "is_slipping" in recording.variables:
        margin = np.where(recording.is_slipping > 0, np.minimum(margin, 0.0), margin)
    margin[np.abs(margin) < _ROUNDING] = 0.0
    held = np.any(touching, axis=1)
    least = np.full(len(margin), np.nan)
    least[held] = np.nanmin(margin[held], axis=1)
    return SlipMargin(
        time=recording.time,
        margin=margin,
        least=least,
        hold_time=_hold_time(recording.time, margin, window),
        warning=warning,
        window=window,
        events=_warnings(recording, margin, warning),
        contacts=tuple(recording.labels["contact"]),
    )


def _hold_time(time: Array, margin: Array, window: float) -> Array:
    """The least over the tips of margin / -slope."""
    hold = np.full(len(time), np.nan)
    for k in range(1, len(time)):
        first = int(np.searchsorted(time, time[k] - window - 1e-9))
        past = margin[first : k + 1]
        known = ~np.isnan(margin[k])
        if np.any(known & (margin[k] <= 0.0)):
            hold[k] = 0.0
            continue
        known &= ~np.any(np.isnan(past), axis=0)
        if len(past) < 3 or not np.any(known):
            continue
        t = time[first : k + 1] - np.mean(time[first : k + 1])
        slope = t @ past[:, known] / (t @ t)
        left = np.where(slope < -_STILL, margin[k, known] / np.maximum(-slope, _STILL), np.inf)
        hold[k] = np.min(left)
    return hold


def _warnings(recording: Recording, margin: Array, warning: float) -> tuple[Event, ...]:
    """A tip that goes below the margin; shorter times above it do not part two warnings."""
    events, time = [], recording.time
    for i, name in enumerate(recording.labels["contact"]):
        last = -np.inf
        for k in np.flatnonzero(margin[:, i] < warning):
            if time[k] - last > _GAP:
                text = (
                    f"{name} has {100.0 * margin[k, i]:.3g} % of its limit surface left, below {100.0 * warning:.3g} %"
                )
                events.append(Event(float(time[k]), WARNING, name, text))
            last = time[k]
    return tuple(sorted(events, key=lambda event: event.time))
