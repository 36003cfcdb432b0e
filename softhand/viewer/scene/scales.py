"""The largest magnitudes that a picture has room for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from softhand.numerics.arrays import Array
from softhand.recording.recording import Recording
from softhand.viewer.scene.samples import FELT, check_viewable, recorded_moment

_LIVE_LOAD = 2.0  # least room for the force of a tip, over the object's weight: fingers may be open at the start


class Scales(NamedTuple):
    """Largest magnitudes that the picture has room for."""

    force: float
    """[N]"""
    torsion: float
    """[N m]"""
    internal_force: float
    """[N]"""
    support_force: float
    """[N]"""
    taxel: float = 0.0
    """Of one taxel [N]; 0 where there are none."""


def shared_scales(recordings: Sequence[Recording]) -> Scales:
    """The largest of each over all recordings, so that equal forces look equal.

    Raises:
        RecordingError: a recording lacks what a picture needs.
    """
    each = []
    for recording in recordings:
        check_viewable(recording)
        supports = recording.variables.get("support_force", np.zeros(3))[..., :3]
        found = fit_scales(recording.contact_force, recording.internal_force, supports, radii_of(recording))
        felt = recording.variables.get(FELT)
        each.append(found if felt is None else found._replace(taxel=_largest(felt, 1e-6)))
    return Scales(*map(max, zip(*each, strict=True)))


def radii_of(recording: Recording) -> tuple[float, ...]:
    """Of the undeformed tips [m]: r = R + dr."""
    first = recorded_moment(recording, 0)
    return tuple(map(float, first.distance + first.deformation[:, 0]))


def fit_scales(
    contact_force: Array, internal_force: Array, support_force: Array, radii: Sequence[float], weight: float = 0.0
) -> Scales:
    """The largest of each, with room for a weight [N]; a torsion far below what tips bear makes no long arc."""
    least = max(_LIVE_LOAD * weight, 1e-3)
    force = _largest(np.linalg.norm(contact_force[..., :3], axis=-1), least)
    support = _largest(np.linalg.norm(support_force, axis=-1), max(weight, 1e-3))
    torsion = _largest(contact_force[..., 3], 0.1 * force * max(radii))
    return Scales(force, torsion, _largest(internal_force, least), support)


def _largest(values: Array, least: float) -> float:
    return float(np.abs(values[np.isfinite(values)]).max(initial=least))
