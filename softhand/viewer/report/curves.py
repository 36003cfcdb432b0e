"""The curves of a report: the panels of the figures, as plain data for a page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import zip_longest
from typing import Any

import numpy as np

from softhand.plots.run import contact_quantities, joints_of_fingers
from softhand.plots.style import CONTACT_ARRAYS, FINGERS, FRICTION_TOP, OBJECT, OBJECT_ARRAYS, check, quantities
from softhand.recording.recorded import is_coulomb
from softhand.recording.recording import Recording
from softhand.viewer.report.packing import AnyArray, Data, Store

_MOST_SAMPLES = 2500  # more than a panel has pixels
_DESIRED = "#000000"
_ROUNDED = 1e-9  # a tip that slips is on the limit
_BLOCKS = {
    "Contact forces": ("normal force", "tangential force", "torsion moment", "friction use"),
    "Deformation": ("deformation δr", "latitude Φ", "deformation δθ", "deformation δφ", "deformation δψ"),
}


def samples_of(recording: Recording) -> AnyArray:
    """Samples that the curves show: each n-th, and the last."""
    last = len(recording) - 1
    return np.unique(np.append(np.arange(0, last + 1, -(-len(recording) // _MOST_SAMPLES)), last))


def finger_names(recording: Recording) -> list[str]:
    """Names of the fingers, for legends."""
    return [tip.removesuffix("_tip").replace("_", " ") for tip in recording.labels["contact"]]


def blocks_of(store: Store, recordings: Sequence[Recording]) -> list[Data]:
    """Blocks of panels, the runs against each other in each panel.

    Raises:
        RecordingError: an array that they show is not in a recording.
    """
    merged: dict[str, dict[str, Data]] = {}
    for run, recording in enumerate(recordings):
        check(recording, *OBJECT_ARRAYS, *CONTACT_ARRAYS)
        for block, panel, curves in _panels(store, recording, run):
            shown = merged.setdefault(block, {}).setdefault(panel["title"], {**panel, "curves": []})
            shown["curves"] += curves
            shown["note"] = shown.get("note") or panel.get("note", "")
    return [{"title": title, "panels": list(panels.values())} for title, panels in merged.items()]


def _panels(store: Store, recording: Recording, run: int) -> Iterator[tuple[str, Data, list[Data]]]:
    """Block, panel and curves, panel by panel."""
    samples, names = samples_of(recording), finger_names(recording)

    def curve(values: AnyArray, color: str, label: str, desired: bool = False) -> Data:
        return {
            "run": run,
            "values": store.add(values[samples], "f4"),
            "color": color,
            "label": label,
            "desired": desired,
        }

    def fingers(values: AnyArray) -> list[Data]:
        return [curve(column, _color(k), names[k]) for k, column in enumerate(values.T)]

    for quantity in quantities(recording):
        groups = np.array_split(np.arange(len(quantity.labels)), min(len(quantity.labels), 3))
        for group in groups:
            title = ", ".join(quantity.labels[k] for k in group)
            curves = []
            for n, k in enumerate(group):
                color = OBJECT if len(group) == 1 else _color(n)
                curves.append(curve(quantity.values[:, k], color, quantity.labels[k]))
                curves.append(curve(quantity.desired[:, k], _DESIRED, f"{quantity.labels[k]} desired", desired=True))
            yield quantity.title, {"title": title, "unit": quantity.unit, "least": quantity.least}, curves
    of_contacts = {name: (unit, values, least) for name, unit, values, least in contact_quantities(recording)}
    for block, members in _BLOCKS.items():
        for name in members:
            unit, values, least = of_contacts[name]
            panel = {"title": name.removeprefix("deformation ").removesuffix(" moment"), "unit": unit, "least": least}
            if name == "friction use":
                panel |= _use_panel(values)
            yield block, panel, fingers(values)
    if is_coulomb(recording):
        use = recording["limit_surface_use"]
        slips = np.maximum.reduceat(recording["is_slipping"] != 0, np.append(0, samples[:-1] + 1))  # none is left out
        panel = {"title": "limit-surface use", "unit": "-", "least": 0.5, **_use_panel(use)}
        panel["note"] = panel["note"] or ("slip" if slips.any() else "")
        barred = zip(fingers(use), slips.T, strict=True)
        yield "Contact forces", panel, [{**one, "bars": np.flatnonzero(slip).tolist()} for one, slip in barred]
    yield from _torques(recording, samples, curve)


def _use_panel(values: AnyArray) -> Data:
    """What a panel of friction use has beyond others."""
    note = "above 1" if np.any(values > 1.0 + _ROUNDED) else ""
    return {"floor": 0.0, "top": FRICTION_TOP, "limit": 1.0, "note": note}


def _torques(recording: Recording, samples: AnyArray, curve: Any) -> Iterator[tuple[str, Data, list[Data]]]:
    """First joints of all fingers, second joints, and so on, with marks where an effort limit cut."""
    hand = joints_of_fingers(recording.labels["joint"], recording.labels["contact"])
    for rank, joints in enumerate(zip_longest(*hand)):
        curves = []
        for finger, joint in enumerate(joints):
            if joint is not None:
                cut = np.flatnonzero(recording.torque_limited[samples, joint])
                torque = curve(recording.joint_torque[:, joint], _color(finger), recording.labels["joint"][joint])
                curves.append({**torque, "marks": cut.tolist()})
        note = "■ limit" if any(torque["marks"] for torque in curves) else ""
        yield "Joint torques", {"title": f"joint {rank + 1}", "unit": "N m", "least": 0.1, "note": note}, curves


def _color(finger: int) -> str:
    return FINGERS[finger % len(FINGERS)]
