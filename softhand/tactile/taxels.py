"""The taxels of all tips: where they sit, and how they err."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softhand.laws.law import Law
from softhand.model.shapes.shape import Shape
from softhand.numerics.arrays import AnyArray, Array
from softhand.tactile.field import Skin
from softhand.tactile.growth import pressure_exponent
from softhand.tactile.pattern import spacing
from softhand.tactile.reading import Reading
from softhand.tactile.solid import solid_of

_SPREAD = 1.6
"""Spacings that the force of a place spreads over: enough that no taxel pops in, and that some always share a load."""

NUMBERS = 5
"""That a taxel tells: normal force, two shear forces, slip, depth."""


@dataclass(frozen=True, eq=False)
class Taxels:
    """The taxels of all tips of a hand.

    Attributes:
        places: unit vectors in the finger frame F, the same on each tip, shape (taxels, 3).
        dead: which are dead, shape (nc, taxels).
        hysteresis: see `reading.read_taxels`.
        noise: standard deviation of normal and shear forces [N].
        seed: of the noise.
        stride: control periods between two samples.
        delay: control periods until a sample arrives.
    """

    places: Array
    dead: NDArray[np.bool_]
    hysteresis: float = 0.0
    noise: tuple[float, float] = (0.0, 0.0)
    seed: int = 0
    stride: int = 1
    delay: int = 0

    def __len__(self) -> int:
        return len(self.places)

    @property
    def errs(self) -> bool:
        """Whether what is read may differ from what is felt."""
        return self.hysteresis > 0.0 or any(self.noise) or bool(self.dead.any())

    @property
    def is_timed(self) -> bool:
        """Whether what is read may be of another control period than that in which it is read."""
        return self.stride > 1 or self.delay > 0

    @property
    def on_their_way(self) -> int:
        """Samples that must be kept, 0 where each is read at once."""
        return 1 - (-self.delay // self.stride) if self.is_timed else 0

    def skin(self, laws: Sequence[Law], shape: Shape | None = None) -> Skin:
        """For kernels, with scratch of its own.

        Args:
            laws: of the tips.
            shape: of the object; None where nothing but plane faces is touched.
        """
        count = len(self)
        return Skin(
            np.ascontiguousarray(self.places.T),
            np.array([_SPREAD * spacing(count) * law.radius for law in laws]),
            np.array([pressure_exponent(law) for law in laws]),
            np.array([float(law.torsion_share is not None) for law in laws]),
            np.zeros((3, 3)),
            np.zeros((3, 3)),
            np.zeros((3, count)),
            np.zeros((3, count)),
            np.zeros(count, np.int64),
            solid_of(shape),
        )

    def reading(self) -> Reading:
        """For kernels, with a memory of its own."""
        return Reading(
            np.array([self.errs, self.dead.any()], np.int64),
            np.array([self.hysteresis]),
            np.array(self.noise),
            np.array([self.seed]),
            self.dead.astype(np.int8),
            np.zeros(self.dead.shape),
            np.zeros((4, len(self)), np.uint32),
            np.array([self.stride, self.delay]),
            np.zeros(1, np.int64),
            np.zeros((self.on_their_way, NUMBERS * self.dead.size)),
        )


def taxel_area(radius: float, count: int) -> float:
    """Area of a taxel of a tip [m^2], all alike."""
    return 2.0 * np.pi * radius**2 / count


def become(mine: Any, other: Any) -> bool:
    """Be another `Skin` or `Reading` in the same memory; False where that takes more or less of it."""
    pairs = list(zip(_arrays(mine), _arrays(other), strict=True))
    if any(own.shape != new.shape for own, new in pairs):
        return False
    for own, new in pairs:
        own[...] = new
    return True


def _arrays(record: Any) -> Iterator[AnyArray]:
    for item in record:
        if isinstance(item, tuple):
            yield from _arrays(item)
        else:
            yield item
