"""How the held object of a recording gives way, at some of its samples: what the picture shows as ellipsoids."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from softhand.closed_loop.grasp_stiffness import grasp_stiffness
from softhand.errors import GraspError
from softhand.numerics.arrays import Array
from softhand.recording.recording import Recording

_SAMPLES = 13


class Ellipsoids(NamedTuple):
    """From one time on."""

    time: float
    """[s]"""
    shift: Array | None
    """Principal compliances of translation times their directions, as columns [m/N]; None where one is negative."""
    turn: Array | None
    """The same of rotation [rad/(N m)]."""


def ellipsoids_of(
    recording: Recording, joints: str | float | Sequence[float] = "locked", samples: int = _SAMPLES
) -> tuple[Ellipsoids, ...]:
    """Of some samples, evenly over the recording; none at those where no tip touches.

    Args:
        recording: of a run.
        joints: as in `grasp_stiffness`.
        samples: at most.

    Raises:
        SofthandError: as `grasp_stiffness`, but for a sample at which nothing is held.
    """
    found = []
    for k in np.unique(np.linspace(0, len(recording) - 1, samples).astype(int)):
        time = float(recording.time[k])
        try:
            held = grasp_stiffness(recording, time, joints)
        except GraspError as error:
            if error.quantity != "force":
                raise
            found.append(Ellipsoids(time, None, None))
            continue
        shift = _columns(held.translation, held.translation_directions)
        found.append(Ellipsoids(time, shift, _columns(held.rotation, held.rotation_directions)))
    return tuple(found)


def _columns(stiffness: Array, directions: Array) -> Array | None:
    return (directions / stiffness[:, None]).T if np.all(stiffness > 0.0) else None
