"""Whether anything collides at one configuration, for a run that is to end there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from softhand.collision.distances import TOUCH, distance
from softhand.collision.pairs import list_pairs
from softhand.collision.solids import Situation, Solid, read_cast
from softhand.numerics.arrays import Array


class Seen(NamedTuple):
    """Two names that are in each other."""

    one: str
    other: str
    depth: float
    """The shortest way that parts them [m]."""


class Lookout:
    """The pairs of solids of a situation, read once. Not for two threads at a time.

    Args:
        situation: whose collisions are looked for.
        depth: up to which two may be in each other [m].

    Raises:
        ModelError: as `read_cast`.
    """

    def __init__(self, situation: Situation, depth: float) -> None:
        self._cast, self._depth = read_cast(situation), max(depth, TOUCH)
        self._pairs, _ = list_pairs(self._cast)
        self._boxes = _Boxes(self._pairs)

    def deepest(self, angles: Array, position: Array, rotation: Array) -> Seen | None:
        """The two that are deepest in each other beyond the depth that is allowed; None if none are.

        Args:
            angles: of joints or motors [rad or m], shape (n,).
            position: of the object [m], shape (3,).
            rotation: its axes, shape (3, 3).
        """
        R, p = self._cast.kinematics.poses(angles[None], position[None], rotation[None])
        worst: Seen | None = None
        for k in np.flatnonzero(self._boxes.least(R[0], p[0]) < -self._depth).tolist():
            a, b = self._pairs[k]
            depth = -distance(a, b, R[0], p[0])
            if depth > (self._depth if worst is None else worst.depth):
                worst = Seen(a.name, b.name, depth)
        return worst


class _Boxes:
    """Boxes along the world's axes about pairs of solids, all at once for one configuration."""

    def __init__(self, pairs: Sequence[tuple[Solid, Solid]]) -> None:
        solids = list(dict.fromkeys(solid for pair in pairs for solid in pair if not solid.is_endless))
        place = {solid: k for k, solid in enumerate(solids)}
        bounds = [solid.bounds for solid in solids]
        self._body = np.array([solid.body for solid in solids], dtype=int)
        self._rotation = np.array([solid.rotation for solid in solids]).reshape(-1, 3, 3)
        middles = [solid.position + solid.rotation @ centre for solid, (centre, _) in zip(solids, bounds, strict=True)]
        self._middle = np.array(middles).reshape(-1, 3)
        self._half = np.array([half for _, half in bounds]).reshape(-1, 3)
        solid_pairs = [(k, a, b) for k, (a, b) in enumerate(pairs) if not (a.is_endless or b.is_endless)]
        self._of_two = np.array([(k, place[a], place[b]) for k, a, b in solid_pairs], dtype=int).reshape(-1, 3).T
        endless = [(k, a, b) if b.is_endless else (k, b, a) for k, (a, b) in enumerate(pairs)
                   if a.is_endless or b.is_endless]  # fmt: skip
        self._of_one = np.array([(k, place[a]) for k, a, _ in endless], dtype=int).reshape(-1, 2).T
        self._planes = np.array([[*b.shape.n, b.shape.d] for _, _, b in endless]).reshape(-1, 4)
        self._count = len(pairs)

    def least(self, R: Array, p: Array) -> Array:
        """What the distance of each pair is at least [m]; of two whose boxes meet, minus the overlap along an axis."""
        axes, origin = R[self._body], p[self._body]
        middle = origin + np.einsum("sij,sj->si", axes, self._middle)
        half = np.einsum("sij,sj->si", np.abs(axes @ self._rotation), self._half)
        least = np.empty(self._count)
        k, a, b = self._of_two
        least[k] = np.max(np.abs(middle[a] - middle[b]) - half[a] - half[b], axis=1, initial=-np.inf)
        k, a = self._of_one
        normal = self._planes[:, :3]
        least[k] = np.sum(middle[a] * normal - half[a] * np.abs(normal), axis=1) - self._planes[:, 3]
        return least
