"""Modes of a loop: how fast each grows, how it rings, and what moves in it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig

from softhand.margins.groups import Groups
from softhand.margins.loop import Loop, is_stable
from softhand.numerics.record import Record

_MEMORY = "memory of the controller"
_TIPS = "relaxation of the tips"
_CARRIED = "instruments and drives"


@dataclass(frozen=True, eq=False)
class Mode(Record):
    """A motion that keeps its shape: x grows by the multiplier each period, or cycle of periods.

    Attributes:
        growth: logarithm of the size of the multiplier over that time [1/s]; below zero the motion dies out.
        frequency: of the ringing [Hz], 0 for none; at most half of that of the multiplier.
        damping: damping ratio, 1 for a motion that dies out without ringing, below 0 for one that grows.
        multiplier: real and imaginary part of the eigenvalue, with the positive imaginary part of a pair.
        name: what moves most.
        shares: of what moves, adding up to 1: the kinetic energy that goes into a finger, into each shift and turn of
            the object along and about its own axes, see `Groups`; and the participation of what is remembered.
        shape: displacement of joints and object, real and imaginary part, shape (nv, 2).
    """

    units: ClassVar = {
        "growth": "1/s", "frequency": "Hz", "damping": "1", "multiplier": "1", "shares": "1", "shape": "SI, by joints"
    }  # fmt: skip

    growth: float
    frequency: float
    damping: float
    multiplier: tuple[float, float]
    name: str
    shares: dict[str, float]
    shape: NDArray[np.float64]

    @property
    def is_stable(self) -> bool:
        """Whether it does not grow."""
        return is_stable(self.growth)

    def __str__(self) -> str:
        ringing = f" at {self.frequency:.3g} Hz" if self.frequency else ""
        return f"{self.growth:+.3g} 1/s{ringing}: {self.name}"


def find_modes(loop: Loop, groups: Groups) -> tuple[Mode, ...]:
    """All modes, the fastest growing first; a pair that rings is one."""
    values, left, right = eig(loop.step, left=True)
    order = np.argsort(-np.abs(values), kind="stable")
    return tuple(
        _mode(loop, groups, values[k], left[:, k], right[:, k]) for k in order if values[k].imag > -1e-12
    )  # fmt: skip


def _mode(loop: Loop, groups: Groups, value: complex, left: NDArray[Any], right: NDArray[Any]) -> Mode:
    nv, s = loop.moving, len(loop.A)
    with np.errstate(divide="ignore"):
        rate = np.log(complex(value)) / loop.cycle if abs(value) > 0.0 else complex(-np.inf)
    part = np.abs(left.conj() * right)
    if not part.sum() > 0.0:  # one of those that are over when the last sample on its way has arrived
        part = np.abs(right)
    ends = [s - loop.remembered, s, len(part) - loop.carried, len(part)]
    remembered = np.array([part[begin:end].sum() for begin, end in pairwise(ends)]) / part.sum()
    move, rates = right[:nv], right[nv : 2 * nv]
    if np.max(np.abs(move)) <= 1e-9 * np.max(np.abs(rates)):
        move = rates
    shares = {name: float(share * (1.0 - remembered.sum())) for name, share in groups.shares(move).items()}
    shares |= {
        name: float(share) for name, share in zip((_TIPS, _MEMORY, _CARRIED), remembered, strict=True) if share > 0.0
    }
    size = abs(rate)
    damping = -rate.real / size if size > 0.0 and np.isfinite(size) else 1.0
    phase = np.exp(-1j * np.angle(np.sum(move**2)) / 2.0)
    shape = np.column_stack([(move * phase).real, (move * phase).imag])
    return Mode(
        growth=float(rate.real),
        frequency=float(abs(rate.imag) / (2.0 * np.pi)) if np.isfinite(size) else 0.0,
        damping=float(damping),
        multiplier=(float(value.real), float(value.imag)),
        name=groups.name(move, shares),
        shares=shares,
        shape=shape,
    )
