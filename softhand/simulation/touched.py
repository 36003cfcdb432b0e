"""The taxels of a run: what they read of what they feel, control period by control period."""

from __future__ import annotations

import numpy as np

from softhand.numerics.arrays import AnyArray
from softhand.numerics.prepared import prepared
from softhand.plant.plant import Plant
from softhand.sensing.fields import pick
from softhand.sensing.observation import Observation
from softhand.tactile.field import Felt
from softhand.tactile.reading import read_taxels


class Touched:
    """Turns what an observation has of taxels into what they read.

    Args:
        plant: with taxels.
        observation: that has what they feel, live; it is overwritten.
    """

    def __init__(self, plant: Plant, observation: Observation) -> None:
        assert plant.taxels is not None
        self._memory, self._errs, self._period = plant.reading.memory, plant.taxels.errs, np.zeros(1, np.int64)
        self._read = prepared(read_taxels, plant.reading, pick(Felt, observation._views), self._period)

    def read(self, period: int) -> None:
        """Read in a control period."""
        self._period[0] = period
        if self._errs:
            self._read()

    def forget(self) -> None:
        """Begin anew."""
        self._memory[...] = 0.0

    def carry(self) -> dict[str, AnyArray]:
        """What `resume` needs, as copies."""
        return {"taxels": self._memory.copy()}

    def resume(self, carried: AnyArray) -> None:
        """Be as when `carry` was called."""
        self._memory[...] = carried
