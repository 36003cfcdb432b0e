"""The taxels of a run: what they read of what they feel, control period by control period."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from softhand.numerics.arrays import AnyArray
from softhand.numerics.prepared import prepared
from softhand.plant.plant import Plant
from softhand.sensing.fields import pick
from softhand.sensing.observation import Observation
from softhand.tactile.field import Felt
from softhand.tactile.reading import read_taxels

CARRIED = {"taxels": "memory", "taxels begun": "begun", "taxel line": "line"}
"""What a state has of a `Reading`."""


class Touched:
    """Turns what an observation has of taxels into what they read.

    Args:
        plant: with taxels.
        observation: that has what they feel, live; it is overwritten.
    """

    def __init__(self, plant: Plant, observation: Observation) -> None:
        assert plant.taxels is not None
        self._reading, self._period = plant.reading, np.zeros(1, np.int64)
        self._acts = plant.taxels.errs or plant.taxels.is_timed
        self._read = prepared(read_taxels, plant.reading, pick(Felt, observation._views), self._period)

    def read(self, period: int) -> None:
        """Read in a control period."""
        self._period[0] = period
        if self._acts:
            self._read()

    def forget(self) -> None:
        """Begin anew."""
        self._reading.memory[...], self._reading.begun[...] = 0.0, 0

    def carry(self) -> dict[str, AnyArray]:
        """What `resume` needs, as copies."""
        return {name: getattr(self._reading, field).copy() for name, field in CARRIED.items()}

    def resume(self, carried: Mapping[str, AnyArray]) -> None:
        """Be as when `carry` was called."""
        for name, field in CARRIED.items():
            getattr(self._reading, field)[...] = carried[name]
