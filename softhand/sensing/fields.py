"""The numbers of an observation, one behind the other in one block of memory, and by name as views of it.

A block can be copied, delayed, disturbed or kept as a whole. `FIELDS` is
the one list of what is in it and in which order.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Iterable
from functools import cache
from hashlib import sha256
from math import prod
from typing import Any, NamedTuple

import numpy as np

from softhand.numerics.arrays import Array


class Sizes(NamedTuple):
    """How many there are of each."""

    n: int
    """joints"""
    nq: int
    """numbers of a configuration"""
    nc: int
    """contacts of the fingertips"""
    ns: int
    """supports"""
    pairs: int
    """of contacts that an internal force acts between"""
    taxels: int = 0
    """taxels of each tip"""
    shares: int = 0
    """contacts of the fingertips, if some have elements that slip by themselves"""
    elements: int = 0
    """most of a contact, likewise"""
    leaning: int = 0
    """contacts of the fingertips if some law of theirs has a moment, or none"""
    leaning_supports: int = 0
    """supports, likewise"""


RECORDED = {
    "joint_position": "n",
    "joint_velocity": "n",
    "object_position": "3",
    "object_rpy": "3",
    "object_twist": "6",
    "internal_force": "pairs",
    "tip_position": "nc 3",
    "deformation": "nc 4",
    "contact_force": "nc 4",
    "contact_moment": "leaning 3",
    "contact_angles": "nc 2",
    "contact_point": "nc 3",
    "contact_rotation": "nc 3 3",
    "contact_coordinates": "nc 5",
    "contact_coordinates_rate": "nc 5",
    "friction_use": "nc",
    "contact_feature": "nc",
    "limit_surface_use": "nc",
    "is_slipping": "nc",
    "slip_travel": "nc",
    "slip_twist": "nc",
    "slip_loss": "nc",
    "slipped_share": "shares",
    "element_deformation": "nc elements 3",
    "element_force": "nc elements 4",
    "support_force": "ns 4",
    "support_moment": "leaning_supports 3",
    "support_deformation": "ns 4",
    "support_point": "ns 3",
    "support_rotation": "ns 3 3",
    "support_is_slipping": "ns",
    "support_slip_loss": "ns",
    "object_position_desired": "3",
    "object_rpy_desired": "3",
    "internal_force_desired": "pairs",
    "tactile_normal_force": "nc taxels",
    "tactile_shear_force": "nc taxels 2",
    "tactile_slip": "nc taxels",
    "penetration_depth": "nc taxels",
}
"""Shape of each field that a recording keeps, in the letters of `Sizes`. They come first: a sample is one copy."""

FIELDS = RECORDED | {
    "clock": "1",
    "object_coordinates_rate_desired": "6",
    "object_coordinates_acceleration_desired": "6",
    "object_twist_desired": "6",
    "object_twist_rate_desired": "6",
    "opening_desired": "1",
    "carried_desired": "1",
    "standoff_desired": "3",
    "standoff_rate_desired": "3",
    "standoff_acceleration_desired": "3",
    "configuration": "nq",
    "object_rotation": "3 3",
    "coordinate_map": "6 6",
    "deformation_rate": "nc 4",
    "tip_rotation": "nc 3 3",
    "tip_jacobian": "nc 3 n",
    "tip_angular_jacobian": "nc 3 n",
    "hand_force_jacobian": "3*nc n",
    "hand_torsion_jacobian": "nc n",
    "object_force_jacobian": "3*nc 6",
    "object_torsion_jacobian": "nc 6",
    "J_O_f": "3*nc 6",
    "J_O_tau": "nc 6",
    "internal_force_basis": "3*nc pairs",
    "gravity_torque": "n",
    "object_gravity": "6",
    "N_O": "6",
}
"""Shape of every field; what it is, `Observation` says."""

SPANS = {
    "object_coordinates": ("object_position", 6),
    "object_coordinates_desired": ("object_position_desired", 6),
}
"""Second names: where they begin, and how many numbers they take."""

ALIASES = {
    "q_F": "joint_position",
    "q_O": "object_coordinates",
    "q_O_rate": "object_coordinates_rate",
    "T_O": "coordinate_map",
    "eta": "contact_coordinates",
    "eta_rate": "contact_coordinates_rate",
    "f_N": "internal_force",
    "K": "internal_force_basis",
    "N_F": "gravity_torque",
    "J_CF": "hand_jacobian",
    "J_CF_f": "hand_force_jacobian",
    "J_CF_tau": "hand_torsion_jacobian",
    "M_F": "hand_mass_matrix",
    "velocity_terms_F": "hand_velocity_terms",
}
"""The letters of the paper, and what they stand for."""

Fields: Any = namedtuple("Fields", [*FIELDS, *SPANS])  # type: ignore[misc]
"""A view for each field."""


@cache
def shapes(sizes: Sizes) -> dict[str, tuple[int, ...]]:
    """The shape of each field."""
    counts = sizes._asdict()
    return {
        name: tuple(prod(counts[factor] if factor in counts else int(factor) for factor in part.split("*"))
                    for part in text.split())
        for name, text in FIELDS.items()
    }  # fmt: skip


def room(sizes: Sizes, of: dict[str, str] = FIELDS) -> int:
    """How many numbers all fields take, or those of `RECORDED`."""
    return sum(prod(shape) for name, shape in shapes(sizes).items() if name in of)


def fields(block: Array, sizes: Sizes) -> Any:
    """The fields of a block of at least `room(sizes)` numbers, as views."""
    views, end = {}, 0
    for name, shape in shapes(sizes).items():
        start, end = end, end + prod(shape)
        views[name] = block[start:end].reshape(shape)
        for span, (first, size) in SPANS.items():
            if name == first:
                views[span] = block[start : start + size]
    return Fields(**views)


def pick(record: type[Any], views: Any, **renamed: str) -> Any:
    """Some of the fields, as a record for a kernel: one argument each is cheap, all of them are not.

    Args:
        record: NamedTuple with their names.
        views: all fields.
        renamed: names of the record that stand for fields of other names.
    """
    return record(*(getattr(views, renamed.get(name, name)) for name in record._fields))


_NAMES = [*FIELDS, *SPANS, *(name for name, field in ALIASES.items() if field in FIELDS or field in SPANS)]
_PREFIX = f"Observed_{sha256(' '.join(_NAMES).encode()).hexdigest()[:8]}_"


def observed_by(names: Iterable[str]) -> Any:
    """A NamedTuple with these names of fields, for `pick`; the same names give the same class, in every process.

    Machine code on disk belongs to such a class, so it must be found again by its name, which therefore tells what is
    in it, and with which list of fields.
    """
    return __getattr__(f"{_PREFIX}{sum(1 << _NAMES.index(name) for name in set(names)):x}")


def __getattr__(name: str) -> Any:
    if not name.startswith(_PREFIX):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name not in globals():
        mask = int(name.removeprefix(_PREFIX), 16)
        names = [field for k, field in enumerate(_NAMES) if mask >> k & 1]
        globals()[name] = namedtuple(name, names, module=__name__)
    return globals()[name]


@cache
def beginnings(sizes: Sizes) -> dict[str, int]:
    """Where each field begins in the block."""
    ends = np.cumsum([prod(shape) for shape in shapes(sizes).values()])
    return dict(zip(FIELDS, [0, *ends[:-1].tolist()], strict=True))


def split(rows: Array, sizes: Sizes, names: Iterable[str]) -> dict[str, Array]:
    """Some fields of many blocks, those that are not empty.

    Args:
        rows: shape (samples, numbers), each the begin of a block.
        sizes: of the block.
        names: of the fields.

    Returns:
        Views, shape (samples, ...) each.
    """
    begins, every, found = beginnings(sizes), shapes(sizes), {}
    for name in names:
        shape = every[name]
        if prod(shape):
            found[name] = rows[:, begins[name] : begins[name] + prod(shape)].reshape(len(rows), *shape)
    return found
