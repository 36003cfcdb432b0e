"""The curves of a report: the panels of the figures, as plain data for a page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import zip_longest
from typing import NamedTuple

import numpy as np

from softhand.numerics.arrays import AnyArray
from softhand.plots.quantities import (
    BEYOND_LIMIT,
    CONTACT_ARRAYS,
    FRICTION_TOP,
    OBJECT_ARRAYS,
    ContactQuantity,
    check,
    contact_quantities,
    finger_name,
    joints_of_fingers,
    object_quantities,
    torque_and_unit,
)
from softhand.plots.style import OBJECT, finger_color
from softhand.recording.recorded import is_coulomb
from softhand.recording.recording import Recording
from softhand.viewer.report.store import Data, Store

_MOST_SAMPLES = 2500  # more than a panel has pixels
_DESIRED = "#000000"
_BLOCKS = {
    "Contact forces": ("normal force", "tangential force", "torsion moment", "friction use"),
    "Deformation": ("deformation δr", "latitude Φ", "deformation δθ", "deformation δφ", "deformation δψ"),
}


class _Panel(NamedTuple):
    """One panel of one run."""

    block: str
    looks: Data
    """Title, unit, and what else the page needs to draw it."""
    curves: list[Data]


def samples_of(recording: Recording) -> AnyArray:
    """Samples that the curves show: each n-th, and the last."""
    last = len(recording) - 1
    return np.unique(np.append(np.arange(0, last + 1, -(-len(recording) // _MOST_SAMPLES)), last))


def finger_names(recording: Recording) -> list[str]:
    """Names of the fingers, for legends."""
    return [finger_name(tip) for tip in recording.labels["contact"]]


def blocks_of(store: Store, recordings: Sequence[Recording]) -> list[Data]:
    """Blocks of panels, the runs against each other in each panel.

    Raises:
        RecordingError: an array that they show is not in a recording.
    """
    merged: dict[str, dict[str, Data]] = {}
    for run, recording in enumerate(recordings):
        check(recording, *OBJECT_ARRAYS, *CONTACT_ARRAYS)
        for block, looks, curves in _Curves(store, recording, run).panels():
            shown = merged.setdefault(block, {}).setdefault(looks["title"], {**looks, "curves": []})
            shown["curves"] += curves
            shown["note"] = shown.get("note") or looks.get("note", "")
    return [{"title": title, "panels": list(panels.values())} for title, panels in merged.items()]


class _Curves:
    """Puts the curves of one run into a store, panel by panel."""

    def __init__(self, store: Store, recording: Recording, run: int) -> None:
        self._store, self._recording, self._run = store, recording, run
        self._samples, self._names = samples_of(recording), finger_names(recording)

    def panels(self) -> Iterator[_Panel]:
        """All panels, in the order of the page."""
        yield from self._object()
        of_contacts = {quantity.name: quantity for quantity in contact_quantities(self._recording)}
        for block, members in _BLOCKS.items():
            for name in members:
                yield _Panel(block, _looks_of(of_contacts[name]), self._fingers(of_contacts[name].values))
        if is_coulomb(self._recording):
            yield self._limit_surface()
        yield from self._torques()

    def _curve(self, values: AnyArray, color: str, label: str, desired: bool = False, of_run: bool = False) -> Data:
        """A curve; one `of_run` is that of no finger: among several runs it has the colour of its run."""
        return {
            "run": self._run,
            "values": self._store.add(values[self._samples], "f4"),
            "color": color,
            "label": label,
            "desired": desired,
            "of_run": of_run,
        }

    def _fingers(self, values: AnyArray) -> list[Data]:
        """A curve for each column, in the colour of its finger."""
        return [self._curve(column, finger_color(k), self._names[k]) for k, column in enumerate(values.T)]

    def _object(self) -> Iterator[_Panel]:
        """Pose and internal force against what is desired."""
        for quantity in object_quantities(self._recording):
            for group in quantity.groups():
                curves = []
                for n, k in enumerate(group):
                    label, color = quantity.labels[k], OBJECT if len(group) == 1 else finger_color(n)
                    curves.append(self._curve(quantity.values[:, k], color, label, of_run=len(group) == 1))
                    curves.append(self._curve(quantity.desired[:, k], _DESIRED, f"{label} desired", desired=True))
                title = ", ".join(quantity.labels[k] for k in group)
                down = bool(quantity.falling) and quantity.falling[group[0]]
                looks = {"title": title, "unit": quantity.unit, "least": quantity.least, "down": down}
                yield _Panel(quantity.title, looks, curves)

    def _limit_surface(self) -> _Panel:
        """The use of the coupled limit, with bars where a tip slips."""
        use, samples = self._recording["limit_surface_use"], self._samples
        slipping = self._recording["is_slipping"] != 0
        slips = np.maximum.reduceat(slipping, np.append(0, samples[:-1] + 1))  # none is left out
        looks = {"title": "limit-surface use", "unit": "-", "least": 0.5, **_limits(use)}
        looks["note"] = looks["note"] or ("slip" if slips.any() else "")
        barred = zip(self._fingers(use), slips.T, strict=True)
        return _Panel("Contact forces", looks, [{**one, "bars": np.flatnonzero(slip).tolist()} for one, slip in barred])

    def _torques(self) -> Iterator[_Panel]:
        """First joints of all fingers, second joints, and so on, with marks where an effort limit cut."""
        block = "Joint torques" if "N m" in self._recording.units("joint_torque") else "Joint forces"
        recording, names = self._recording, self._recording.labels["joint"]
        hand = joints_of_fingers(names, recording.labels["contact"])
        for rank, joints in enumerate(zip_longest(*hand)):
            curves = []
            for finger, joint in enumerate(joints):
                if joint is not None:
                    cut = np.flatnonzero(recording.torque_limited[self._samples, joint])
                    torque = self._curve(recording.joint_torque[:, joint], finger_color(finger), names[joint])
                    curves.append({**torque, "marks": cut.tolist()})
            note = "■ limit" if any(torque["marks"] for torque in curves) else ""
            what, unit = torque_and_unit(recording, [joint for joint in joints if joint is not None])
            title = f"joint {rank + 1}" if what == "torque" else f"joint {rank + 1}, {what}"
            yield _Panel(block, {"title": title, "unit": unit, "least": 0.1, "note": note}, curves)


def _looks_of(quantity: ContactQuantity) -> Data:
    """Of a panel about the contacts; the page has less room for words than a figure."""
    title = quantity.name.removeprefix("deformation ").removesuffix(" moment")
    looks = {"title": title, "unit": quantity.unit, "least": quantity.least}
    return {**looks, **_limits(quantity.values)} if quantity.name == "friction use" else looks


def _limits(use: AnyArray) -> Data:
    """What a panel of a friction use has beyond others."""
    note = "above 1" if np.any(use > BEYOND_LIMIT) else ""
    return {"floor": 0.0, "top": FRICTION_TOP, "limit": 1.0, "note": note}
