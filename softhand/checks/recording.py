"""A recording doubted: is it whole, are its numbers numbers, did tips slip or lift, can its run be repeated?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softhand.analysis.energy import energy_ledger
from softhand.assembly.collisions import collisions
from softhand.assembly.probe import recorded_scenario
from softhand.collision.record import Collisions
from softhand.collision.told import told
from softhand.errors import RecordingError, SofthandError
from softhand.numerics.record import Record
from softhand.recording.recording import Recording
from softhand.recording.sound import ROUNDING, count_of, unsound, when
from softhand.recording.variables import COMMANDED, FOUND_AFTERWARDS, LABELLED_DIMS, MEASURED_PREFIX, MOMENTS, VARIABLES
from softhand.scenario.scenario import Scenario
from softhand.version import __version__


@dataclass(frozen=True)
class RecordingCheckup(Record):
    """What a recording has and what is doubtful about it.

    Attributes:
        rows: name and text of what is in it.
        errors: what makes its numbers useless, a sentence each.
        warnings: what a reader of the numbers must know, a sentence each.
        collisions: of links; None where no shapes tell them.
    """

    rows: list[tuple[str, str]]
    errors: list[str]
    warnings: list[str]
    collisions: Collisions | None

    def tables(self, name: str) -> list[tuple[str, list[tuple[str, ...]]]]:
        """Title and rows of each table, for a recording of that name."""
        return [(name, list(self.rows))]

    def raise_errors(self, name: str) -> None:
        """One RecordingError of all errors, if there are any. Carries `.file`."""
        if self.errors:
            raise RecordingError(f"{name}: {' '.join(self.errors)} Compute the run anew.", file=name)


def check_recording(recording: Recording) -> RecordingCheckup:
    """Look at the arrays of a recording, at its scenario and at its energy ledger."""
    errors = [*unsound(recording), *_rotations(recording)]
    rows, warnings = _rows(recording), list(_end(recording))
    missing = [name for name in _expected(recording) if name not in recording.variables]
    if missing:
        warnings.append(f"it has no {', '.join(missing)}: what is drawn or computed from them is not to be had.")
    after, is_coulomb, colliding = [], False, None
    try:
        scenario = recorded_scenario(recording)
        is_coulomb = scenario.fingertip.contact == "coulomb"
        warnings += _length(recording, scenario)
        if not errors and not missing:
            after.append(("energy", _energy(recording)))
        if not errors:
            colliding = told(lambda: collisions(recording))
            after += colliding.rows
            warnings += colliding.warnings
        after.append(("scenario", f"can be read: {scenario.description or 'without a description'}"))
    except SofthandError as error:
        after.append(("scenario", "cannot be used with this version"))
        warnings.append(f"its scenario cannot be used: {error}")
    if len(recording):
        for name, count, text in _counts(recording):
            rows.append((name, text))
            if count and not is_coulomb and name in ("friction use above 1", "lift-off"):
                warnings.append(f"{name}: {text}.")
    rows += after
    return RecordingCheckup(rows, errors, warnings, colliding.found if colliding else None)


def _expected(recording: Recording) -> list[str]:
    """All arrays that a run with such contacts, pushes and instruments records."""
    labelled = set(LABELLED_DIMS) - set(recording.labels)  # what this run had none of
    is_measured = any(name.startswith(MEASURED_PREFIX) for name in recording.variables)
    return [
        name
        for name, variable in VARIABLES.items()
        if labelled.isdisjoint(variable.dims)
        and (is_measured or not name.startswith(MEASURED_PREFIX))
        and (name not in (*COMMANDED.values(), *FOUND_AFTERWARDS, *MOMENTS) or name in recording.variables)
    ]


def _rows(recording: Recording) -> list[tuple[str, str]]:
    time = recording.time
    labels = [f"{len(names)} {dim}s" for dim, names in recording.labels.items()]
    rows = [
        ("ended", "complete" if recording.complete else f"early, at {recording.stop_time:g} s"),
        ("version", recording.version + ("" if recording.version == __version__ else f", this is {__version__}")),
        ("samples", f"{len(recording)}" + (f", {time[0]:g} to {time[-1]:g} s" if len(time) else "")),
        ("of", ", ".join(labels)),
        ("variables", f"{len(recording.variables)} of {len(_expected(recording))}"),
    ]
    if recording.hand_urdf and recording.object_urdf:
        rows.append(("URDFs", "of hand and object are in it"))
    return rows


def _end(recording: Recording) -> Iterator[str]:
    if not recording.complete:
        yield f"incomplete, it goes to {recording.stop_time:g} s: {recording.reason.removesuffix('.')}."
    if not (recording.hand_urdf and recording.object_urdf):
        yield "it lacks the URDF of hand or object, so it is shown with the files that the scenario names now."


def _rotations(recording: Recording) -> Iterator[str]:
    """R^T R = 1 and det R = 1."""
    if "contact_rotation" not in recording.variables:
        return
    R = recording.contact_rotation
    off = np.max(np.abs(np.einsum("...ki,...kj->...ij", R, R) - np.eye(3)), axis=(2, 3))
    with np.errstate(invalid="ignore"):
        bad = np.flatnonzero(((off > ROUNDING) | (np.linalg.det(R) < 0.0)).any(axis=1))
    if bad.size:
        yield f"contact_rotation is no rotation in {count_of(bad.size)}, first {when(recording, bad[0])}."


def _counts(recording: Recording) -> Iterator[tuple[str, int, str]]:
    """How often something happened and when first: label, samples, text."""
    have = recording.variables
    seen: list[tuple[str, NDArray[np.bool_], tuple[str, ...]]] = []
    tips, joints = recording.labels.get("contact", ()), recording.labels.get("joint", ())
    if "friction_use" in have:
        pressing = have["contact_force"][..., 2] > 0.0 if "contact_force" in have else True
        seen.append(("friction use above 1", (have["friction_use"] > 1.0 + ROUNDING) & pressing, tips))
    if "contact_force" in have:
        presses = have["contact_force"][..., 2] > 0.0
        seen.append(("lift-off", ~presses & np.logical_or.accumulate(presses), tips))
    if "is_slipping" in have:
        seen.append(("slip", have["is_slipping"] != 0, tips))
    if "torque_limited" in have:
        seen.append(("torque at its limit", have["torque_limited"] != 0, joints))
    for name, holds, who in seen:
        samples = np.flatnonzero(holds.any(axis=1))
        text = "never"
        if samples.size:
            first = who[int(np.argmax(holds[samples[0]]))]
            text = f"{count_of(samples.size)}, first {when(recording, samples[0])} ({first})"
        yield name, int(samples.size), text


def _length(recording: Recording, scenario: Scenario) -> Iterator[str]:
    """Whether the samples are those that the scenario asks for."""
    expected = round(scenario.duration / scenario.control_period) + 1
    if recording.complete and len(recording) != expected:
        yield f"it has {len(recording)} samples, but its scenario asks for {expected}."


def _energy(recording: Recording) -> str:
    """The residual of the energy ledger over what was exchanged."""
    ledger = energy_ledger(recording)
    share = abs(float(ledger.residual[-1])) / max(ledger.exchanged, 1e-300)
    return f"{ledger.residual_name}: {1e3 * ledger.residual[-1]:.3g} mJ, {100.0 * share:.2g} % of the largest account"
