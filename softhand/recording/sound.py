"""Whether the numbers of a recording can be drawn and computed with: what makes them useless, in words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from softhand.errors import RecordingError
from softhand.recording.recording import Recording

ROUNDING = 1e-9
LARGEST = 1e15
"""Beyond it a square or a product soon is no number any more; no quantity of a hand comes near it in SI units."""

_POLE = 1e-6  # cosine of Phi at the apex
_UNBOUND = ("friction_use", "limit_surface_use")
"""Infinite by right where a tip does not press."""


def unsound(recording: Recording) -> Iterator[str]:
    """What makes the numbers of a recording useless, a sentence each; nothing if they can be used."""
    if not len(recording):
        yield "it has no samples."
    yield from _not_numbers(recording)
    yield from _time(recording)


def require_sound(recording: Recording, name: object) -> Recording:
    """The recording.

    Args:
        recording: to be drawn or computed with.
        name: of it, for the message.

    Raises:
        RecordingError: its numbers cannot be used. Carries `.file`.
    """
    faults = list(unsound(recording))
    if faults:
        raise RecordingError(f"{name}: {' '.join(faults)} Compute the run anew.", file=name)
    return recording


def _not_numbers(recording: Recording) -> Iterator[str]:
    """NaN, infinities and numbers beyond reason, by array and first time.

    By right a use of friction is infinite where a tip does not press, and eta' is no number where it touches with its
    apex, the pole of theta.
    """
    for name, array in recording.variables.items():
        bad = ~(np.abs(array) <= LARGEST)
        if name in _UNBOUND and "contact_force" in recording.variables:
            bad &= ~(np.isposinf(array) & ~(recording.contact_force[..., 2] > 0.0))
        if name == "contact_coordinates_rate" and "contact_angles" in recording.variables:
            bad &= ~(np.cos(recording.contact_angles[..., 1]) < _POLE)[..., None]
        if bad.any():
            found, where = array[bad], np.flatnonzero(bad.reshape(len(array), -1).any(axis=1))
            kind = "NaN" if np.isnan(found).any() else "infinity" if np.isinf(found).any() else f"{found[0]:.3g}"
            yield f"{name} is {kind} in {count_of(where.size)}, first {when(recording, where[0])}."


def _time(recording: Recording) -> Iterator[str]:
    time = recording.time
    if len(time) < 2 or not np.all(np.abs(time) <= LARGEST):
        return
    steps = np.diff(time)
    if not np.all(steps > 0.0):
        yield f"time does not rise at sample {int(np.argmin(steps > 0.0)) + 1}."
        return
    step = (time[-1] - time[0]) / (len(time) - 1)
    off = np.abs(steps - step)
    if np.max(off) > ROUNDING + 1e-6 * step:
        k = int(np.argmax(off > ROUNDING + 1e-6 * step))
        yield f"time is not even: {steps[k]:g} s to the sample at {time[k + 1]:g} s, {step:g} s on average."


def count_of(count: int) -> str:
    """So many samples."""
    return f"{count} sample{'' if count == 1 else 's'}"


def when(recording: Recording, sample: int | np.signedinteger) -> str:
    """The time of a sample; its number where that is none."""
    time = recording.time[sample]
    return f"at {time:.4g} s" if np.isfinite(time) else f"at sample {sample}"
