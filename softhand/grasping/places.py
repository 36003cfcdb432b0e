"""Where on an object a finger can touch: points of its surface that the finger reaches well."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from softhand.grasping.chains import finger_chain, tip_position
from softhand.grasping.inverse import approach
from softhand.grasping.palm import standing_joints
from softhand.grasping.situation import Situation, skeleton
from softhand.grasping.wrenches import tangents
from softhand.model.arm import REACHED, Arm
from softhand.model.world import slides_of
from softhand.numerics.arrays import Array

RESERVE = math.radians(5.0)
"""Least distance of a joint to its limits [rad]."""
TRAVEL = 0.05
"""Least distance of a slide to its limits, over its travel."""
PHI = math.radians(20.0), math.radians(75.0)
"""Least and greatest Phi: the tip touches well between rim and apex; laws in surface coordinates have no pole there."""
STRETCH = 0.95
"""A finger reaches a point with at most this share of its length."""
PRESSING = 1.0
"""Least normal force of a tip [N]."""

_STARTS = 5  # of the inverse kinematics, random ones after the guess
_NEARER = 8  # turns in which a finger that does not reach a point takes the nearest that it reaches
_SAMPLES = 6  # a link, for clearances


@dataclass(frozen=True, eq=False)
class Place:
    """A point that a finger reaches.

    Attributes:
        point: in the object frame [m], shape (3,).
        normal: outward, in the object frame, shape (3,).
        angles: of the finger's own joints [rad or m].
        line: points along the finger in the world [m], shape (points, 3).
    """

    point: Array
    normal: Array
    angles: Array
    line: Array


class PlaceFinder:
    """Finds the places of each finger of a situation.

    Attributes:
        start: joint angles of the guess, shape (n,).
        reserve: least distance of each joint to its limits [rad or m], shape (n,).
        radius: largest of the tips [m].
        surface: points of the object with room around them [m] and outward normals, in its frame.
    """

    def __init__(self, here: Situation, points: int) -> None:
        """Look at about so many points of the surface."""
        world = here.world
        self.here, self.start = here, standing_joints(world, here.scenario)
        self.depths = [material.depth(2.0 * PRESSING) for material in here.materials]
        self.radius = max(material.law.radius for material in here.materials)
        self._spread = max(  # of a pressed tip
            math.sqrt(depth * (2.0 * material.law.radius - depth))
            for material, depth in zip(here.materials, self.depths, strict=True)
        )
        self.surface = [
            (point, normal)
            for point, normal in zip(*here.shape.surface_points(points), strict=True)
            if self.has_room(point, normal)
        ]
        self._spacing = 2.0 * _nearest_gap(np.array([point for point, _ in self.surface]))
        self._arm, self._slides = Arm(world), slides_of(world)
        self._chains = [finger_chain(world, i, self.start) for i in range(world.n_tips)]
        self._limits = lower, upper = world.position_limits
        self.reserve = np.where(self._slides, TRAVEL * (upper - lower), RESERVE)

    def places(self, finger: int) -> list[Place]:
        """The points of the surface that a finger reaches well, once each."""
        return self.places_among(finger, self.surface)

    def places_among(self, finger: int, surface: Sequence[tuple[Array, Array]]) -> list[Place]:
        """Those of some points that a finger reaches well, once each.

        Args:
            finger: index of it.
            surface: points with room around them and outward normals, as in the attribute.
        """
        found: list[Place] = []
        for point, normal in surface:
            place = self._place(finger, point, normal, None)
            if place is not None and all(np.linalg.norm(place.point - other.point) > 1e-6 for other in found):
                found.append(place)
        return found

    def place(self, finger: int, point: Array, normal: Array, guess: Array) -> Place | None:
        """A finger at a point of the surface, or at the nearest that it reaches; None if it does not reach it well.

        Args:
            finger: index of it.
            point: in the object frame [m].
            normal: outward there.
            guess: angles of the finger's own joints from which it gets there [rad or m].
        """
        return self._place(finger, point, normal, guess) if self.has_room(point, normal) else None

    def way(self, finger: int) -> Array:
        """The shortest way by which the object would have to move for a finger to come to it [m], shape (3,)."""
        here, axes = self.here, np.empty((3, 3))
        links, columns = self._chains[finger]
        lower, upper = (limit[columns] for limit in self._limits)
        law, depth, shortest = here.materials[finger].law, self.depths[finger], np.full(3, np.inf)
        for point, normal in self.surface:
            angles = np.clip(self.start[columns], lower, upper)
            centre = here.to_world(point + (law.radius - depth) * normal)
            approach(links, centre, angles, lower, upper, axes)
            way = tip_position(links, angles) - centre
            if np.linalg.norm(way) < np.linalg.norm(shortest):
                shortest = way
        return shortest

    def _place(self, finger: int, point: Array, normal: Array, guess: Array | None) -> Place | None:
        """`place` where there is room around the point, from several starts if there is no guess."""
        columns = self._chains[finger][1]
        lower, upper = (limit[columns] for limit in self._limits)
        low, high = lower + self.reserve[columns], upper - self.reserve[columns]
        starts = [np.clip(self.start[columns] if guess is None else guess, low, high)]
        if guess is None:
            within = np.maximum(low, -math.pi), np.minimum(high, math.pi)
            starts += list(np.random.default_rng(finger).uniform(*within, (_STARTS, len(columns))))
        for start in starts:
            found = self._from(finger, point, normal, start.copy(), (low, high))
            if found is not None:
                return found
        return None

    def _from(
        self, finger: int, point: Array, normal: Array, angles: Array, limits: tuple[Array, Array]
    ) -> Place | None:
        """`_place` from one start; sets `angles`."""
        here, axes = self.here, np.empty((3, 3))
        links, columns = self._chains[finger]
        law, at, n = here.materials[finger].law, point, normal
        for _ in range(_NEARER):
            centre = here.to_world(at + (law.radius - self.depths[finger]) * n)
            gap = approach(links, centre, angles, *limits, axes)
            if gap < REACHED or gap > self._spacing:
                break
            moved, n = here.shape.nearest(here.to_object(tip_position(links, angles)))
            if np.linalg.norm(moved - at) < 1e-13:
                break
            at = moved
        if gap > REACHED or (at is not point and not self.has_room(at, n)):
            return None
        Phi = math.asin(min(max(float(-axes[:, 0] @ (here.rotation @ n)), -1.0), 1.0))
        lowest, highest = (math.radians(limit) for limit in law.Phi_range)
        if not max(PHI[0], lowest) <= Phi <= (min(PHI[1], highest) if law.coordinates == "polar" else highest):
            return None
        all_angles = self.start.copy()
        all_angles[columns] = angles
        self._arm.move(all_angles)
        joints = skeleton(here.world, self._arm, finger)[-len(columns) - 1 :]
        line = _along(joints)
        if self._is_overstretched(joints, columns) or not self._is_clear(line):
            return None
        return Place(at, n, angles, line)

    def is_new(self, points: Array, others: Sequence[Array]) -> bool:
        """Whether one of some contact points lies a radius of the tip away from that of each of the others."""
        return all(bool(np.any(np.linalg.norm(points - other, axis=1) >= self.radius)) for other in others)

    def has_room(self, point: Array, normal: Array) -> bool:
        """Whether the surface goes on around a point by as far as the pressed tip spreads."""
        spread = self._spread
        first, second = tangents(normal)
        for a in 0.25 * math.pi * np.arange(8):
            beside = point + spread * (math.cos(a) * first + math.sin(a) * second)
            there, n = self.here.shape.nearest(beside)
            if n @ normal < 0.8 or np.linalg.norm(there - beside) > 0.3 * spread:
                return False
        return True

    def _is_overstretched(self, joints: Array, columns: list[int]) -> bool:
        """Whether a finger that can fold is too long for its joints."""
        folds = np.count_nonzero(~self._slides[columns]) > 1
        length = float(np.sum(np.linalg.norm(np.diff(joints, axis=0), axis=1)))
        return bool(folds and np.linalg.norm(joints[-1] - joints[0]) > STRETCH * length)

    def _is_clear(self, line: Array) -> bool:
        """Whether a finger stays outside the object."""
        for place in self.here.to_object(line):
            surface, normal = self.here.shape.nearest(place)
            if (place - surface) @ normal < 0.5 * self.radius:
                return False
        return True


def _along(joints: Array) -> Array:
    """Points along a finger [m], shape (points, 3)."""
    shares = np.arange(1, _SAMPLES + 1) / _SAMPLES
    parts = [joints[:1], *(a + shares[:, None] * (b - a) for a, b in pairwise(joints))]
    return np.concatenate(parts)


def _nearest_gap(points: Array) -> float:
    """Largest distance of a point from its nearest neighbour [m]; 0 for fewer than two."""
    from scipy.spatial import cKDTree

    return float(np.max(cKDTree(points).query(points, k=2)[0][:, 1])) if len(points) > 1 else 0.0
