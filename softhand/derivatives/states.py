"""The entries of x and u: names, units, and the steps of their differences."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.closed_loop.linearize import OBJECT, memory_name
from softhand.contact.records import STORED
from softhand.numerics.arrays import Array
from softhand.plant.plant import Plant

_TURN, _SHIFT = 2e-5, 2e-6
"""Steps of an angle [rad] and of a length [m]: 0.2 % of the depth of a tip, far above rounding."""
_STORED = 2e-4
"""Step of an angle of a tip, of 10 mm radius [rad]."""
_FORCE, _MOMENT = 1e-3, 1e-5
"""Of what relaxation remembers [N, N m], in which all is linear."""
_ANGLES, _SHEARS = ("dtheta", "dphi", "dpsi"), ("s1", "s2", "psi")


class Entries(NamedTuple):
    """Some entries of x or u."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    steps: Array


def state_entries(plant: Plant, slides: NDArray[np.bool_], remembered: NDArray[np.int64], period: float) -> Entries:
    """Those of x: displacement of joints and object, their rates, what the contacts store.

    Args:
        plant: whose state it is.
        slides: which joints slide, shape (n,).
        remembered: row and column of the numbers of z that belong to x.
        period: for which a torque is held [s].
    """
    moving = (*plant.world.joint_names, *(f"object {way}" for way in OBJECT))
    is_length = [*slides.tolist(), True, True, True, False, False, False]
    shifts = ["m" if length else "rad" for length in is_length]
    steps = np.where(is_length, _SHIFT, _TURN)
    stored = [_stored(plant, int(row), int(column)) for row, column in remembered]
    names = (*moving, *(f"{name}, rate" for name in moving), *(name for name, _, _ in stored))
    units = (*shifts, *(f"{unit}/s" for unit in shifts), *(unit for _, unit, _ in stored))
    return Entries(names, units, np.concatenate([steps, steps / period, [step for _, _, step in stored]]))


def input_entries(plant: Plant, slides: NDArray[np.bool_], inertias: Array, period: float) -> Entries:
    """Those of u, then the wrench on the object; their steps move what they drive as far as those of x do.

    Args:
        plant: as above.
        slides: likewise.
        inertias: diagonal of the mass matrix, shape (nv,).
        period: [s].
    """
    n = plant.world.n_joints
    is_length = [*slides.tolist(), True, True, True, False, False, False]
    steps = np.where(is_length, _SHIFT, _TURN) * inertias / period**2
    units = tuple("N" if slide else "N m" for slide in slides)
    return Entries((*plant.world.joint_names,), units, steps[: n + 6])


def _stored(plant: Plant, row: int, column: int) -> tuple[str, str, float]:
    """Name, unit and step of one number of z."""
    contact, is_surface = plant.contact_names[row], bool(plant.pads["is_surface"][row])
    if column < 3:
        is_length = is_surface and column < 2
        name = (_SHEARS if is_surface else _ANGLES)[column]
        return f"{contact}, {name}", "m" if is_length else "rad", _SHIFT if is_length else _STORED
    which = (column - STORED) % int(plant.pads["remembered"][row])
    is_force = which == 0 or (is_surface and which < 3)
    name = f"{contact}, {memory_name(plant, column)}"
    return name, "N" if is_force else "N m", _FORCE if is_force else _MOMENT
