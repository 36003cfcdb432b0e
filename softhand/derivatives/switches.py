"""The switches that a run crosses: what each contact does from one step to the next, and which torques are cut."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.model.shapes.union import PART, TWO_PARTS

_FEATURES = {0: "none", 1: "face", 2: "edge", 3: "vertex"}


def surface_name(feature: int) -> str:
    """What is touched, in words: a face, an edge or a vertex, and of which part of the object."""
    word, part = _FEATURES.get(feature % PART, str(feature)), feature % TWO_PARTS // PART
    return f"{word} of part {part}" if part else word


class Crossing(NamedTuple):
    """A switch that a run has crossed; derivatives are those of runs that cross it at the same step."""

    time: float
    """Of the end of the step, or of the sample [s]."""
    where: str
    """Name of the contact, or of the joint."""
    what: str
    """`touch`, `slip`, `surface` (another face, edge or vertex) or `effort limit`."""
    to: str
    """What holds from then on, such as `slips`."""


def crossings(
    sides: NDArray[np.int64], step: float, contacts: Sequence[str], limits: NDArray[np.int64], period: float,
    joints: Sequence[str],
) -> tuple[Crossing, ...]:  # fmt: skip
    """All of a run, in the order of time.

    Args:
        sides: as `tape.Play.sides`, shape (1 + steps, nc).
        step: [s].
        contacts: their names.
        limits: as `tape.Play.limits`, shape (periods + 1, n).
        period: control period [s].
        joints: their names.
    """
    found: list[Crossing] = []
    for k, i in zip(*np.nonzero(np.diff(sides, axis=0)), strict=True):
        before, after, time = int(sides[k, i]), int(sides[k + 1, i]), round(float((k + 1) * step), 12)
        if (before ^ after) & 1:
            found.append(Crossing(time, contacts[i], "touch", "touches" if after & 1 else "lifts off"))
            if not after & 2:
                continue
        if (before ^ after) & 2 and (before & after & 1 or after & 2):
            found.append(Crossing(time, contacts[i], "slip", "slips" if after & 2 else "sticks"))
        if before & after & 1 and before // 4 != after // 4:
            found.append(Crossing(time, contacts[i], "surface", surface_name(after // 4)))
    for k, i in zip(*np.nonzero(np.diff(limits, axis=0)), strict=True):
        to = {-1: "at its lower limit", 0: "within", 1: "at its upper limit"}[int(limits[k + 1, i])]
        found.append(Crossing(round(float((k + 1) * period), 12), joints[i], "effort limit", to))
    return tuple(sorted(found, key=lambda one: one.time))
