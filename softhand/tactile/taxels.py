"""The taxels of all tips: where they sit, and how they err."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from softhand.laws.law import Law
from softhand.model.shapes.shape import RESULTS
from softhand.numerics.arrays import Array
from softhand.tactile.field import Skin
from softhand.tactile.growth import pressure_exponent
from softhand.tactile.pattern import spacing
from softhand.tactile.reading import Reading

_SPREAD = 1.6
"""Spacings that the force of a place spreads over: enough that no taxel pops in, and that some always share a load."""


@dataclass(frozen=True, eq=False)
class Taxels:
    """The taxels of all tips of a hand.

    Attributes:
        places: unit vectors in the finger frame F, the same on each tip, shape (taxels, 3).
        dead: which are dead, shape (nc, taxels).
        hysteresis: see `reading.read_taxels`.
        noise: standard deviation of normal and shear forces [N].
        seed: of the noise.
    """

    places: Array
    dead: NDArray[np.bool_]
    hysteresis: float = 0.0
    noise: tuple[float, float] = (0.0, 0.0)
    seed: int = field(default=0)

    def __len__(self) -> int:
        return len(self.places)

    @property
    def errs(self) -> bool:
        """Whether what is read may differ from what is felt."""
        return self.hysteresis > 0.0 or any(self.noise) or bool(self.dead.any())

    def skin(self, laws: Sequence[Law]) -> Skin:
        """For kernels, on tips of these laws, with scratch of its own."""
        count = len(self)
        return Skin(
            np.ascontiguousarray(self.places),
            np.array([_SPREAD * spacing(count) * law.radius for law in laws]),
            np.array([pressure_exponent(law) for law in laws]),
            np.array([float(law.torsion_share is not None) for law in laws]),
            np.zeros((3, 3)),
            np.zeros((3, 3)),
            np.zeros((count, 3)),
            np.zeros((3, count)),
            np.zeros(count, np.int64),
            np.zeros(RESULTS + 3),
        )

    def reading(self) -> Reading:
        """For kernels, with a memory of its own."""
        return Reading(
            np.array([int(self.errs)]),
            np.array([self.hysteresis]),
            np.array(self.noise),
            np.array([self.seed]),
            self.dead.astype(np.int8),
            np.zeros(self.dead.shape),
        )


def taxel_area(radius: float, count: int) -> float:
    """Area of a taxel of a tip [m^2], all alike."""
    return 2.0 * np.pi * radius**2 / count
