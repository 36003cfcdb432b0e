"""Postures in which fingertips face each other, from which oppositions are looked for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from softhand.assistant.fingers import Fingers, TipOnBody
from softhand.numerics.arrays import Array

_SAMPLES = 1500  # postures of the whole hand
_CROSSED = 400  # of each of two fingers that move by themselves
_SEEDS = 8  # of a pair


class Seed(NamedTuple):
    """Two tips that face each other, about."""

    pair: tuple[int, int]
    motors: Array
    normal: Array
    """From the second to the first."""
    badness: float
    """0 where they face each other straight, at the width that is preferred."""
    lean: float
    """Least cosine between the way out of a tip and the way to the other."""
    width: float
    """Between the balls [m]."""


class Postures:
    """Random postures of a hand."""

    def __init__(self, fingers: Fingers, tips: Sequence[TipOnBody], frozen: np.ndarray, rest: Array) -> None:
        """With all tips, and motors that stay where they rest."""
        self.fingers, self.tips, self.frozen = fingers, tips, frozen
        free = np.flatnonzero(~frozen)
        rng = np.random.default_rng(0)
        count = _SAMPLES if len(free) > 1 else 200
        self.motors = np.tile(rest, (count, 1))
        if len(free) == 1:
            self.motors[:, free[0]] = np.linspace(fingers.low[free[0]], fingers.high[free[0]], count)
        else:
            self.motors[:, free] = rng.uniform(fingers.low[free], fingers.high[free], (count, len(free)))
        found = [fingers.at(motors, tips, with_slopes=False) for motors in self.motors]
        self.centres = np.array([one.centres for one in found])
        self.out = np.array([one.out for one in found])
        self.moved = np.array([fingers.movers(tip.joint) & ~frozen for tip in tips])

    def are_apart(self, i: int, j: int) -> bool:
        """Whether no motor moves both tips."""
        return not np.any(self.moved[i] & self.moved[j])

    def seeds(self, widths: tuple[float, float], preferred: float) -> list[Seed]:
        """The best postures of each pair of fingers, best first."""
        found = [seed for i, j in combinations(range(len(self.tips)), 2) for seed in self._of(i, j, widths, preferred)]
        return sorted(found, key=lambda seed: seed.badness)

    def _of(self, i: int, j: int, widths: tuple[float, float], preferred: float) -> Iterator[Seed]:
        radii = self.tips[i].radius + self.tips[j].radius
        if self.are_apart(i, j):
            some = slice(0, min(_CROSSED, len(self.motors)))
            first, second = (grid.ravel() for grid in np.indices((some.stop, some.stop)))
        else:
            first = second = np.arange(len(self.motors))
        way = self.centres[first, i] - self.centres[second, j]
        length = np.maximum(np.linalg.norm(way, axis=1), 1e-9)
        u = way / length[:, None]
        lean = np.minimum(-np.einsum("kj,kj->k", self.out[first, i], u), np.einsum("kj,kj->k", self.out[second, j], u))
        gap = length - radii
        off = np.maximum(widths[0] - gap, 0.0) + np.maximum(gap - widths[1], 0.0)
        badness = np.maximum(0.9 - lean, 0.0) + np.abs(gap - preferred) / (4.0 * preferred) + off / 0.02
        order = np.argsort(badness, kind="stable")[:4000]
        kept: list[int] = []
        for k in order:
            if all(np.linalg.norm(self.centres[first[k], i] - self.centres[first[o], i]) > 0.015 for o in kept):
                kept.append(int(k))
                motors = self.motors[first[k]].copy()
                motors[self.moved[j]] = self.motors[second[k]][self.moved[j]]
                yield Seed((i, j), motors, u[k], float(badness[k]), float(lean[k]), float(gap[k]))
            if len(kept) == _SEEDS:
                return

    def joining(self, seed: Seed, finger: int, sign: float, plane: float, middle: Array) -> tuple[float, Array]:
        """How badly a further tip fits a side at best, and the motors there.

        Args:
            seed: of the two others.
            finger: index of the tip.
            sign: +1 for the side of the first of the pair.
            plane: height along the normal at which its ball touches [m].
            middle: of the tips that are there [m], shape (3,).
        """
        u, radius = seed.normal, self.tips[finger].radius
        off = np.abs(self.centres[:, finger] @ u - plane)
        lean = -sign * (self.out[:, finger] @ u)
        beside = self.centres[:, finger] - middle
        beside = np.linalg.norm(beside - np.outer(beside @ u, u), axis=1)
        badness = off / 0.01 + 2.0 * np.maximum(0.6 - lean, 0.0)
        badness = badness + np.maximum(beside - 0.05, 0.0) / 0.02 + np.maximum(2.5 * radius - beside, 0.0) / radius
        k = int(np.argmin(badness))
        motors = seed.motors.copy()
        others = np.any([self.moved[i] for i in seed.pair], axis=0)
        own = self.moved[finger] & ~others
        motors[own] = self.motors[k][own]
        return float(badness[k]), motors
