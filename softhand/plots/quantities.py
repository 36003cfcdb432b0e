"""What figures and reports show of a recording: quantities in their units, and joints by finger."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import takewhile
from typing import NamedTuple

import numpy as np

from softhand.errors import RecordingError
from softhand.numerics.arrays import Array
from softhand.plots.style import DEGREES
from softhand.recording.recorded import scenario_of
from softhand.recording.recording import Recording

FRICTION_TOP = 3.0  # friction use above this is cut off
BEYOND_LIMIT = 1.0 + 1e-9  # friction use above this: a tip that slips is on the limit

OBJECT_ARRAYS = tuple(
    f"{name}{kind}" for name in ("object_position", "object_rpy", "internal_force") for kind in ("", "_desired")
)

CONTACT_ARRAYS = ("contact_force", "deformation", "contact_angles", "friction_use", "joint_torque", "torque_limited")

_DOWN = 0.99  # cosine to gravity from which an axis points down

_SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")  # plain text: math text takes a quarter of the time of a figure


class ObjectQuantity(NamedTuple):
    """A column of panels: values and desired values, shape (samples, n), and a label for each."""

    title: str
    values: Array
    desired: Array
    labels: tuple[str, ...]
    unit: str
    least: float
    """Span of an axis at the least."""
    falling: tuple[bool, ...] = ()
    """Whether a column grows along gravity, by which its axis points down: what is lifted goes up in the picture."""

    def groups(self) -> list[list[int]]:
        """Columns of `values` that share a panel: one each, but no more than three panels."""
        count = len(self.labels)
        return [group.tolist() for group in np.array_split(np.arange(count), min(count, 3))]


class ContactQuantity(NamedTuple):
    """A panel about the contacts: values of shape (samples, nc)."""

    name: str
    unit: str
    values: Array
    least: float
    """Span of its axis at the least."""


def check(recording: Recording, *names: str) -> None:
    """Refuse a recording that lacks an array, by the name of the array."""
    missing = [name for name in names if name not in recording.variables]
    if missing:
        raise RecordingError(f"The recording cannot be drawn: it has no {', '.join(missing)}.")


def object_quantities(recording: Recording) -> tuple[ObjectQuantity, ...]:
    """Position, orientation and internal force."""
    pairs = tuple(f"f{pair.translate(_SUBSCRIPTS)}" for pair in recording.labels.get("pair", ()))
    falling = _along_gravity(recording)
    axes = tuple(f"{name} (down)" if down else name for name, down in zip("xyz", falling, strict=True))
    table = (
        ("Position", "object_position", 1e3, axes, "mm", 1.0, falling),
        ("Orientation", "object_rpy", DEGREES, ("roll", "pitch", "yaw"), "deg", 1.0, ()),
        ("Internal force", "internal_force", 1.0, pairs, "N", 0.5, ()),
    )
    return tuple(
        ObjectQuantity(title, scale * recording[name], scale * recording[f"{name}_desired"], labels, unit, least, down)
        for title, name, scale, labels, unit, least, down in table
    )


def _along_gravity(recording: Recording) -> tuple[bool, ...]:
    """Which of x, y and z points down, as z does where a hand hangs upside down; none where gravity is oblique."""
    gravity = scenario_of(recording).vector("gravity") or (0.0, 0.0, 0.0)
    size = math.hypot(*gravity)
    return tuple(size > 0.0 and along > _DOWN * size for along in gravity)


def contact_quantities(recording: Recording) -> tuple[ContactQuantity, ...]:
    """Forces, friction use and deformation at the contacts."""
    force, deformation = recording["contact_force"], recording["deformation"]
    latitude = recording["contact_angles"][:, :, 1]
    return (
        ContactQuantity("normal force", "N", force[:, :, 2], 0.5),
        ContactQuantity("tangential force", "N", np.hypot(force[:, :, 0], force[:, :, 1]), 0.5),
        ContactQuantity("torsion moment", "N mm", 1e3 * force[:, :, 3], 1.0),
        ContactQuantity("friction use", "-", recording["friction_use"], 0.5),
        ContactQuantity("deformation δr", "mm", 1e3 * deformation[:, :, 0], 0.5),
        ContactQuantity("latitude Φ", "deg", DEGREES * latitude, 1.0),
        ContactQuantity("deformation δθ", "deg", DEGREES * deformation[:, :, 1], 1.0),
        ContactQuantity("deformation δφ", "deg", DEGREES * deformation[:, :, 2], 1.0),
        ContactQuantity("deformation δψ", "deg", DEGREES * deformation[:, :, 3], 1.0),
    )


def joints_of_fingers(joints: Sequence[str], tips: Sequence[str]) -> list[list[int]]:
    """Joints of each finger: those named more like its tip than like any other, else equal shares in their order."""
    hand: list[list[int]] = [[] for _ in tips]
    for k, joint in enumerate(joints):
        alike = [_shared_start(joint, tip) for tip in tips]
        if alike.count(max(alike)) > 1:
            return [share.tolist() for share in np.array_split(np.arange(len(joints)), len(tips))]
        hand[alike.index(max(alike))].append(k)
    return hand


def torque_and_unit(recording: Recording, joints: Sequence[int]) -> tuple[str, str]:
    """What is drawn of the effort of some joints, and its unit: torque of those that turn, force of slides."""
    units = recording.units("joint_torque")
    found = sorted({units[joint % len(units)] for joint in joints}, reverse=True)
    words = {"N m": "torque", "N": "force"}
    return ", ".join(words[unit] for unit in found), ", ".join(found)


def finger_name(tip: str) -> str:
    """What the finger of a tip is called in legends."""
    return tip.removesuffix("_tip").replace("_", " ")


def _shared_start(one: str, other: str) -> int:
    """How many letters two names have in common from their start."""
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(one, other, strict=False)))
