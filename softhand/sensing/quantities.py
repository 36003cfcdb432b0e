"""What is measured of a grasp, and by what instruments. All else that a controller sees follows from these."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.arrays import Array

PLAIN, TURNING, ROTATION, NORMAL = range(4)
"""Kinds of what is measured: a number, the angle of a joint that turns without end, a rotation, a unit vector."""


@dataclass(frozen=True)
class Quantity:
    """What is measured of one kind.

    Attributes:
        kind: as above; of a joint without end `TURNING`.
        each: what there is one of for each: "joint", "axis" of the world, "tip", or "tip axis" for axes of each tip.
        numbers: that one of them is kept as, with its noise of 1 or 3 components.
    """

    kind: int
    each: str
    numbers: int = 1


QUANTITIES = {
    "joint_position": Quantity(PLAIN, "joint"),
    "joint_velocity": Quantity(PLAIN, "joint"),
    "object_position": Quantity(PLAIN, "axis"),
    "object_orientation": Quantity(ROTATION, "axis", 9),
    "object_velocity": Quantity(PLAIN, "axis"),
    "object_angular_velocity": Quantity(PLAIN, "axis"),
    "contact_force": Quantity(PLAIN, "tip axis"),
    "contact_torsion": Quantity(PLAIN, "tip"),
    "contact_normal": Quantity(NORMAL, "tip axis", 3),
    "contact_compression": Quantity(PLAIN, "tip"),
}
"""The order is that of the random streams, so new ones go to the end."""

ITEM = np.dtype(
    [
        ("kind", np.int64),
        ("place", np.int64),  # of its first number among all that is measured
        ("size", np.int64),  # how many numbers
        ("stream", np.int64),  # of the random numbers: which quantity
        ("part", np.int64),  # first component in it
        ("noise", np.float64, 3),  # standard deviation of a sample
        ("bias", np.float64, 3),
        ("quantum", np.float64),  # 0 for none
        ("delay", np.int64),  # control periods
        ("stride", np.int64),  # control periods between two samples
        ("share", np.float64),  # of a new value in the low-pass filter; 1 for none
        ("memory", np.int64),  # where its numbers lie: the sample that is held, the filter, the delay line
    ]
)
"""One number, rotation or unit vector that an instrument measures."""


@dataclass(frozen=True, eq=False)
class Channel:
    """The instrument of one quantity.

    Attributes:
        noise: standard deviation of a sample, by component, in the unit of the quantity.
        bias: what is added to all, by component, likewise.
        quantum: to whole multiples of which a sample is rounded; 0 for none.
        delay: control periods until a sample arrives.
        stride: control periods between two samples.
        share: 1 - exp(-2 pi f T) of a low-pass filter with the cut-off f and the control period T; 1 for none.
    """

    noise: Array
    bias: Array
    quantum: float = 0.0
    delay: int = 0
    stride: int = 1
    share: float = 1.0


@dataclass(frozen=True, eq=False)
class Sensing:
    """The instruments of a run: channels by quantity, and the seed of their noise. What has no channel is exact."""

    channels: Mapping[str, Channel]
    seed: int = 0

    def still(self) -> Sensing:
        """The same without time and chance: the bias alone."""
        return Sensing({name: Channel(0.0 * one.noise, one.bias) for name, one in self.channels.items()}, self.seed)

    def with_seed(self, seed: int) -> Sensing:
        """With other noise of the same kind."""
        return replace(self, seed=seed)


def counts(n: int, nc: int) -> dict[str, int]:
    """How many numbers there are of each quantity.

    Args:
        n: joints.
        nc: fingertips.
    """
    return {name: _items(one, n, nc) * one.numbers for name, one in QUANTITIES.items()}


def components(n: int, nc: int) -> dict[str, int]:
    """How many components the error of each quantity has; args as `counts`."""
    return {name: {"joint": n, "axis": 3, "tip": nc, "tip axis": 3 * nc}[one.each] for name, one in QUANTITIES.items()}


def _items(one: Quantity, n: int, nc: int) -> int:
    if one.kind == ROTATION:
        return 1
    if one.kind == NORMAL:
        return nc
    return {"joint": n, "axis": 3, "tip": nc, "tip axis": 3 * nc}[one.each]


def items_of(sensing: Sensing, is_continuous: NDArray[np.bool_], nc: int) -> tuple[NDArray[np.void], int]:
    """Table `ITEM` of the instruments that there are, and how many numbers their memory takes.

    Args:
        sensing: the instruments.
        is_continuous: which joints turn without end, shape (n,).
        nc: fingertips.
    """
    n = len(is_continuous)
    ends = accumulate(counts(n, nc).values(), initial=0)
    rows, memory = [], 1  # the first number tells whether there is a memory
    for stream, ((name, quantity), begin) in enumerate(zip(QUANTITIES.items(), ends, strict=False)):
        channel = sensing.channels.get(name)
        if channel is None:
            continue
        parts = 1 if quantity.kind == PLAIN else 3
        for k in range(_items(quantity, n, nc)):
            row = np.zeros((), ITEM)
            row["kind"] = TURNING if name == "joint_position" and is_continuous[k] else quantity.kind
            row["place"], row["size"] = begin + quantity.numbers * k, quantity.numbers
            row["stream"], row["part"] = stream, parts * k
            row["noise"][:parts] = channel.noise[parts * k : parts * (k + 1)]
            row["bias"][:parts] = channel.bias[parts * k : parts * (k + 1)]
            row["quantum"], row["delay"], row["stride"] = channel.quantum, channel.delay, channel.stride
            row["share"], row["memory"] = channel.share, memory
            memory += quantity.numbers * (2 + channel.delay)
            rows.append(row)
    return np.array(rows, dtype=ITEM).reshape(-1), memory
