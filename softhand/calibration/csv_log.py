"""Logs as CSV: a header of names with units in brackets, a row a sample."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from softhand.calibration.log import Log
from softhand.calibration.recorded_log import quaternions_of
from softhand.identification.files.header import split_label
from softhand.identification.files.table import Table, read_table
from softhand.identification.files.units import scale_of
from softhand.numerics.arrays import Array
from softhand.settings.wording import nearest, show

MOST_ROWS = 200_000
_AXES, _ANGLES, _QUATERNION = "xyz", ("roll", "pitch", "yaw"), ("qx", "qy", "qz", "qw")


class Hand(NamedTuple):
    """What names of columns are made of."""

    joints: Sequence[str]
    slides: Sequence[bool]
    tips: Sequence[str]


def read_csv_log(file: Path, hand: Hand) -> Log:
    """Read a log.

    Columns: `time`, `q.JOINT` and `tau.JOINT` of each joint; where there are, `dq.JOINT`, `object.x` to `object.z`,
    `object.roll` to `object.yaw` or `object.qx` to `object.qw`, `force.TIP.x` to `force.TIP.z` in axes of the tip, and
    `torsion.TIP`; each with its unit in brackets, `q.finger_1_joint_1 [deg]`. An empty cell was not measured.

    Raises:
        MeasurementError: a column is missing, unknown, there twice, or without unit or in a wrong one; a cell is no
            number; or as `Log`.
    """
    table = read_table(file, MOST_ROWS)
    known = _known(hand)
    pairs = [split_label(label) for label in table.labels]
    for label, (name, unit) in zip(table.labels, pairs, strict=True):
        if name not in known:
            hint = _hint(name, known, hand)
            raise table.refused(f"column {show(label)} is not known. {hint}", column=name, value=label)
        if [other for other, _ in pairs].count(name) > 1:
            raise table.refused(f"column {show(name)} is there twice.", column=name, value=label)
        if known[name] and not unit:
            raise table.refused(
                f"column {show(label)} has no unit; write it in brackets, such as {name} [{_EXAMPLE[known[name]]}].",
                column=name, value=label,
            )  # fmt: skip
    columns = {}
    for k, (name, unit) in enumerate(pairs):
        scale = scale_of(unit, known[name], f"{file}: column {show(table.labels[k])}") if known[name] else 1.0
        columns[name] = scale * _numbers(table, k)
    for name in ("time", *(f"q.{joint}" for joint in hand.joints), *(f"tau.{joint}" for joint in hand.joints)):
        if name not in columns:
            raise table.refused(
                f"column {show(name)} is missing; a log needs time, position q.JOINT and torque tau.JOINT of each of "
                f"the {len(hand.joints)} joints of the hand.", column=name, value=None,
            )  # fmt: skip
    return Log(
        columns["time"], _stacked(columns, [f"tau.{joint}" for joint in hand.joints]), _measured(table, columns, hand),
        tuple(hand.joints), str(file), table.lines,
    )  # fmt: skip


_EXAMPLE = {
    "time": "s", "angle": "rad", "length": "m", "angular velocity": "rad/s", "velocity": "m/s", "force": "N",
    "moment": "N m",
}  # fmt: skip


def _known(hand: Hand) -> dict[str, str]:
    """Kinds of the units of all columns; "" of one without."""
    found = {"time": "time"}
    for joint, slides in zip(hand.joints, hand.slides, strict=True):
        found[f"q.{joint}"] = "length" if slides else "angle"
        found[f"dq.{joint}"] = "velocity" if slides else "angular velocity"
        found[f"tau.{joint}"] = "force" if slides else "moment"
    found |= {f"object.{axis}": "length" for axis in _AXES} | {f"object.{angle}": "angle" for angle in _ANGLES}
    found |= {f"object.{part}": "" for part in _QUATERNION}
    for tip in hand.tips:
        found |= {f"force.{tip}.{axis}": "force" for axis in _AXES}
        found[f"torsion.{tip}"] = "moment"
    return found


def _hint(name: str, known: dict[str, str], hand: Hand) -> str:
    what, _, rest = name.partition(".")
    if what in ("q", "dq", "tau") and rest and rest not in hand.joints:
        return f"The hand of the scenario has no joint {show(rest)}; it has {', '.join(hand.joints)}."
    near = nearest(name, known)
    ways = "time, q.JOINT, dq.JOINT, tau.JOINT, object.x, object.roll, object.qx, force.TIP.x, torsion.TIP"
    hint = f"Did you mean {show(near)}? " if near else ""
    return f"{hint}Known: {ways}, of the joints {hand.joints[0]} to {hand.joints[-1]}."


def _numbers(table: Table, column: int) -> Array:
    """Numbers of a column; an empty cell is NaN, and so is one that says so."""
    found = np.empty(len(table.rows))
    for k, row in enumerate(table.rows):
        text = row[column].strip()
        found[k] = table.number(text)
        if np.isnan(found[k]) and text.lower() not in ("", "nan"):
            raise table.refused(f"{show(text)} is no number.", k, table.labels[column], text)
    return found


def _stacked(columns: dict[str, Array], names: Sequence[str]) -> Array:
    return np.stack([columns[name] for name in names], axis=1)


def _measured(table: Table, columns: dict[str, Array], hand: Hand) -> dict[str, Array]:
    groups = {
        "joint_position": [f"q.{joint}" for joint in hand.joints],
        "joint_velocity": [f"dq.{joint}" for joint in hand.joints],
        "object_position": [f"object.{axis}" for axis in _AXES],
        "rpy": [f"object.{angle}" for angle in _ANGLES],
        "object_orientation": [f"object.{part}" for part in _QUATERNION],
        "contact_force": [f"force.{tip}.{axis}" for tip in hand.tips for axis in _AXES],
        "contact_torsion": [f"torsion.{tip}" for tip in hand.tips],
    }
    found: dict[str, Array] = {}
    for group, names in groups.items():
        there = [name in columns for name in names]
        if not any(there):
            continue
        if not all(there):
            lost = names[there.index(False)]
            raise table.refused(f"column {show(lost)} is missing beside {show(names[there.index(True)])}.", column=lost)
        found[group] = _stacked(columns, names)
    if "rpy" in found:
        if "object_orientation" in found:
            raise table.refused("has the orientation twice, as roll, pitch, yaw and as a quaternion; keep one.")
        found["object_orientation"] = quaternions_of(found.pop("rpy"))
    elif "object_orientation" in found:
        length = np.linalg.norm(found["object_orientation"], axis=1)
        if np.any(np.abs(length - 1.0) > 0.02):
            k = int(np.nanargmax(np.abs(length - 1.0)))
            raise table.refused(
                f"the quaternion has the length {length[k]:.4g}; it must be 1.", k, "object.qw", length[k]
            )
        found["object_orientation"] /= length[:, None]
    return found
