"""What a log can tell, before anything is fitted to it: the singular values of its sensitivity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from softhand.calibration.parameters import Parameter
from softhand.numerics.arrays import Array

_WIDE = 1.96  # standard deviations to each side
_TAKES_PART = 0.3  # of the length of a direction
_NOTHING = 1e-9  # of the strongest column


class Direction(NamedTuple):
    """A combination of parameters that the motion does not tell.

    Attributes:
        parameters: names of those that take part.
        shares: of each, in x.
        half_width: of the interval that there would be, in x.
    """

    parameters: tuple[str, ...]
    shares: tuple[float, ...]
    half_width: float

    @property
    def text(self) -> str:
        """In words."""
        if len(self.parameters) == 1:
            return f"{self.parameters[0]}: nothing that was measured depends on it" + (
                "" if not np.isfinite(self.half_width) else " enough")  # fmt: skip
        return f"{', '.join(self.parameters[:-1])} and {self.parameters[-1]}: only a combination of them shows"


def untold(R: Array, parameters: Sequence[Parameter]) -> list[Direction]:
    """The directions of x in which an interval of 95 % would be wider than one may be content with, to 1 either side.

    Args:
        R: |R dx|^2 is what a change does to the weighted residuals, all states following.
        parameters: of the columns.
    """
    names = [one.name for one in parameters]
    lengths = np.linalg.norm(R, axis=0)
    dead = lengths <= _NOTHING * max(float(lengths.max(initial=0.0)), 1e-300)
    found = [Direction((name,), (1.0,), np.inf) for name, is_dead in zip(names, dead, strict=True) if is_dead]
    alive = np.flatnonzero(~dead)
    _, s, V = np.linalg.svd(R[:, alive], full_matrices=True)
    s = np.concatenate([s, np.zeros(len(V) - len(s))])
    for strength, way in zip(s, V, strict=True):
        half = _WIDE / strength if strength > 0.0 else np.inf
        if half > 1.0:
            part = np.flatnonzero(np.abs(way) > _TAKES_PART * np.max(np.abs(way)))
            order = part[np.argsort(-np.abs(way[part]))]
            found.append(
                Direction(tuple(names[alive[k]] for k in order), tuple(float(way[k]) for k in order), float(half))
            )
    return found


def half_widths_of(R: Array) -> Array:
    """Half of the 95 % intervals of x that a log of this sensitivity gives; infinite where it tells nothing."""
    inverse = np.linalg.pinv(R, rcond=1e-12)
    half = _WIDE * np.sqrt(np.sum(inverse**2, axis=1))
    lengths = np.linalg.norm(R, axis=0)
    return np.where(lengths <= _NOTHING * max(float(lengths.max(initial=0.0)), 1e-300), np.inf, half)
