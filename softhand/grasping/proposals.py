"""Grasps proposed: contact points that the fingers of a hand reach and from which they hold the object.

The surface is sampled, each finger keeps the points that it reaches, and of the combinations those are tried first
whose force-closure margin could be the largest: a bound of it, the least support of the corners of `primitive_wrenches`
over many directions, costs a thousandth of the margin. A proposal has been solved as a grasp at rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.parts import read_face_friction
from softhand.assembly.plant import read_world
from softhand.errors import GraspError
from softhand.grasping.chains import approach, finger_chain
from softhand.grasping.parts import (
    friction_on,
    pressed_depth,
    read_materials,
    size_of,
    skeleton,
    squeeze,
    torsion_length,
)
from softhand.grasping.quality import GraspQuality, quality_in
from softhand.grasping.wrenches import Contacts, closure_margin, primitive_wrenches, tangents
from softhand.model.arm import REACHED, Arm
from softhand.model.world import World, own_columns, slides_of
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.scenario.scenario import Scenario
from softhand.start.reach import initial_joints

USE = 0.7
"""Share of the friction that a proposal uses at its start."""
TORQUE_USE = 0.8
"""Largest share of an effort limit."""
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
_COMBINATIONS = 30000
_DIRECTIONS = 400
_BATCH = 200  # combinations whose margin is found before the best of them are solved
_BATCHES = 5
_SAMPLES = 6  # a link, for clearances
_DIGITS = 9  # of a contact point [m]: on its face, and two points in balance, to rounding


@dataclass(frozen=True, eq=False)
class Proposal:
    """A grasp at rest that was found.

    Attributes:
        scenario: the one asked for, with this grasp.
        quality: its figures.
    """

    scenario: Scenario
    quality: GraspQuality

    @property
    def margin(self) -> float:
        """Force-closure margin, by which proposals are ranked, [N] for one newton of normal force in all."""
        return self.quality.margin

    def section(self) -> str:
        """The section [grasp] of a scenario file."""
        grasp = self.scenario.grasp
        points = "".join(f"    [{', '.join(_short(value) for value in point)}],\n" for point in grasp.contact_points)
        forces = ", ".join(_short(value) for value in grasp.internal_force)
        guess = ", ".join(_short(value) for value in grasp.joint_guess or ())
        return (
            f"[grasp]\ncontact_points = [  # [m], object frame, one a fingertip\n{points}]\n"
            f"internal_force = [{forces}]  # [N], at the start\njoint_guess = [{guess}]  # [rad or m]\n"
        )


@dataclass(frozen=True, eq=False)
class _Place:
    """A point that a finger reaches."""

    point: Array  # object frame [m]
    normal: Array  # outward, object frame
    angles: Array  # of the finger's own joints
    line: Array  # points along the finger in the world [m]


def propose_grasps(
    scenario: Scenario,
    count: int = 5,
    seed: int = 0,
    points: int = 300,
    progress: Callable[[float], None] | None = None,
) -> list[Proposal]:
    """Grasps of the object of a scenario where it lies, best first.

    The quality is the force-closure margin of `closure_margin`, among grasps at rest that

    - reach each point within the joint limits, `RESERVE` or `TRAVEL` from them, stretched to `STRETCH` at most,
    - touch with `PHI`, up to the apex with a law in surface coordinates, with room around the point on the surface,
    - keep links clear of object and other fingers,
    - use at most `USE` of the friction under the smallest internal forces with which each tip presses with `PRESSING`,
    - use at most `TORQUE_USE` of each effort limit.

    The internal forces of a proposal are those smallest ones. Two proposals differ by more than a radius of the tip at
    one contact at least. The same arguments give the same proposals.

    Args:
        scenario: hand, object and its pose; of its grasp only the number of contacts and the guess are used.
        count: most proposals returned.
        seed: of the random choices.
        points: about how many points of the surface are tried.
        progress: called with the share done, 0 to 1.

    Returns:
        One or more proposals.

    Raises:
        GraspError: nothing was found; says which finger reaches nothing, or that no combination holds.
    """
    search = _Search(read_world(scenario), scenario, np.random.default_rng(seed), points)
    report = progress or (lambda share: None)
    places = []
    for i in range(search.world.n_tips):
        places.append(search.places(i))
        report(0.5 * (i + 1) / search.world.n_tips)
    for tip, found in zip(search.world.tips, places, strict=True):
        if not found:
            raise GraspError(
                f"{tip.name} reaches none of {search.tried} points of the object well; move the object closer, or give "
                "another grasp.joint_guess.",
                finger=tip.name, quantity="reach", value=0,
            )  # fmt: skip
    proposals: list[Proposal] = []
    for done, choice in search.choices(places):
        report(0.5 + 0.5 * done)
        if any(search.is_near(choice, other) for other in proposals):
            continue
        proposal = search.solve(choice)
        if proposal is not None and not any(search.is_near(proposal, other) for other in proposals):
            proposals.append(proposal)
        if len(proposals) == count:
            break
    report(1.0)
    if not proposals:
        raise GraspError(
            f"no grasp at rest found: {', '.join(str(len(found)) for found in places)} points are in reach of the "
            "fingers, but no combination tried holds the object; raise fingertip.friction, move the object, or try "
            "more points.",
            finger="", quantity="margin", value=0.0,
        )  # fmt: skip
    return sorted(proposals, key=lambda proposal: -proposal.margin)


class _Search:
    """What stays the same over all points and combinations."""

    def __init__(self, world: World, scenario: Scenario, rng: np.random.Generator, points: int) -> None:
        self.world, self.scenario, self.rng = world, scenario, rng
        self.materials = read_materials(scenario)
        self.shape, self.faces = world.shape, read_face_friction(scenario, world.shape)
        self.position, self.rotation = np.array(scenario.object.position), rotation_of(scenario.object.rpy)
        self.centre = np.array(world.model.inertias[world.object_joint].lever)
        self.start = initial_joints(world, scenario.grasp.joint_guess)
        self.depths = [pressed_depth(tip.law, 2.0 * PRESSING) for tip in self.materials]
        self.lengths = [torsion_length(tip, depth) for tip, depth in zip(self.materials, self.depths, strict=True)]
        self.radius = max(tip.law.radius for tip in self.materials)
        self.spread = max(  # of a pressed tip
            math.sqrt(depth * (2.0 * tip.law.radius - depth))
            for tip, depth in zip(self.materials, self.depths, strict=True)
        )
        self.surface = [
            (point, normal) for point, normal in zip(*self.shape.surface_points(points), strict=True)
            if self._has_room(point, normal)
        ]  # fmt: skip
        self.tried = len(self.surface)
        self.spacing = 2.0 * _nearest_gap(np.array([point for point, _ in self.surface])) if self.tried > 1 else 0.0
        self.arm, self.slides = Arm(world), slides_of(world)
        lower, upper = world.position_limits
        self.reserve = np.where(self.slides, TRAVEL * (upper - lower), RESERVE)

    def places(self, index: int) -> list[_Place]:
        """The points that a finger reaches well, once each."""
        found: list[_Place] = []
        for point, normal in self.surface:
            place = self._place(index, point, normal)
            if place is not None and all(np.linalg.norm(place.point - other.point) > 1e-6 for other in found):
                found.append(place)
        return found

    def _place(self, index: int, point: Array, normal: Array, guess: Array | None = None) -> _Place | None:
        links, columns = finger_chain(self.world, index, self.start)
        law = self.materials[index].law
        lower, upper = (limit[columns] for limit in self.world.position_limits)
        reserve = self.reserve[columns]
        low, high = lower + reserve, upper - reserve
        axes = np.empty((3, 3))
        within = np.maximum(low, -math.pi), np.minimum(high, math.pi)
        rng = np.random.default_rng(index)
        starts = [np.clip(self.start[columns] if guess is None else guess, low, high)]
        if guess is None:
            starts += list(rng.uniform(*within, (_STARTS, len(columns))))
        for start in starts:
            angles, at, n = start.copy(), point, normal
            for _ in range(_NEARER):
                centre = self._to_world(at + (law.radius - self.depths[index]) * n)
                gap = approach(links, centre, angles, low, high, axes)
                if gap < REACHED or gap > self.spacing:
                    break
                moved, n = self.shape.nearest(self._to_object(self._tip(index, columns, angles)))
                if np.linalg.norm(moved - at) < 1e-13:
                    break
                at = moved
            if gap > REACHED or (at is not point and not self._has_room(at, n)):
                continue
            Phi = math.asin(min(max(float(-axes[:, 0] @ (self.rotation @ n)), -1.0), 1.0))
            lowest, highest = (math.radians(limit) for limit in law.Phi_range)
            if law.coordinates == "polar":
                highest = min(PHI[1], highest)
            if not max(PHI[0], lowest) <= Phi <= highest:
                continue
            self._tip(index, columns, angles)
            joints = skeleton(self.world, self.arm, index)[-len(columns) - 1 :]
            if not self._is_clear(joints, folds=bool(np.count_nonzero(~self.slides[columns]) > 1)):
                continue
            return _Place(at, n, angles, _along(joints))
        return None

    def _tip(self, index: int, columns: list[int], angles: Array) -> Array:
        """Centre of a tip in the world, the other fingers at their start."""
        all_angles = self.start.copy()
        all_angles[columns] = angles
        self.arm.move(all_angles)
        return self.arm.tip(index)[0]

    def _to_world(self, point: Array) -> Array:
        return self.position + self.rotation @ point

    def _to_object(self, point: Array) -> Array:
        return self.rotation.T @ (point - self.position)

    def _has_room(self, point: Array, normal: Array) -> bool:
        """Whether the surface goes on around a point by as far as the pressed tip spreads."""
        spread = self.spread
        first, second = tangents(normal)
        for a in 0.25 * math.pi * np.arange(8):
            beside = point + spread * (math.cos(a) * first + math.sin(a) * second)
            there, n = self.shape.nearest(beside)
            if n @ normal < 0.8 or np.linalg.norm(there - beside) > 0.3 * spread:
                return False
        return True

    def _is_clear(self, joints: Array, folds: bool) -> bool:
        """Whether a finger stays outside the object and, if it can fold, within the limits of its length."""
        length = float(np.sum(np.linalg.norm(np.diff(joints, axis=0), axis=1)))
        if folds and np.linalg.norm(joints[-1] - joints[0]) > STRETCH * length:
            return False
        for point in _along(joints):
            place = self._to_object(point)
            surface, normal = self.shape.nearest(place)
            if (place - surface) @ normal < 0.5 * self.radius:
                return False
        return True

    def choices(self, places: list[list[_Place]]) -> Iterator[tuple[float, tuple[_Place, ...]]]:
        """Share done and a combination of places, in batches of falling bounds, within each by falling margin."""
        sizes = [len(found) for found in places]
        total = math.prod(sizes)
        flat = np.arange(total) if total <= _COMBINATIONS else np.unique(self.rng.integers(0, total, _COMBINATIONS))
        chosen = np.array(np.unravel_index(flat, sizes)).T
        chosen = chosen[self._are_apart(places, chosen)]
        bounds = self._bounds(places, chosen)
        order = np.argsort(-bounds, kind="stable")
        order = order[bounds[order] > 1e-6][: _BATCH * _BATCHES]
        for begin in range(0, len(order), _BATCH):
            batch: list[tuple[float, int, tuple[_Place, ...]]] = []
            for row in order[begin : begin + _BATCH]:
                choice = tuple(found[k] for found, k in zip(places, chosen[row], strict=True))
                margin = closure_margin(self._contacts(choice, range(len(choice))))
                if margin > 1e-6:
                    batch.append((margin, len(batch), choice))
            batch.sort(key=lambda entry: (-entry[0], entry[1]))
            for k, (_, _, choice) in enumerate(batch):
                yield (begin + _BATCH * k / len(batch)) / len(order), choice

    def _are_apart(self, places: list[list[_Place]], chosen: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Which combinations keep each two fingers apart by two radii of a tip."""
        apart = np.ones(len(chosen), dtype=bool)
        for i in range(len(places)):
            for j in range(i + 1, len(places)):
                others = np.array([place.line for place in places[j]])
                base = float(np.linalg.norm(places[i][0].line[0] - others[0, 0]))
                least = min(2.0 * self.radius, 0.99 * base)
                clear = np.array(
                    [
                        np.linalg.norm(place.line[None, :, None] - others[:, None], axis=3).min(axis=(1, 2)) >= least
                        for place in places[i]
                    ]
                )
                apart &= clear[chosen[:, i], chosen[:, j]]
        return apart

    def _bounds(self, places: list[list[_Place]], chosen: NDArray[np.int64]) -> Array:
        """Upper bounds of the margins: the least support over some directions of the space of wrenches."""
        directions = np.random.default_rng(0).normal(size=(_DIRECTIONS, 6))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        supports = []
        for i, found in enumerate(places):
            corners = primitive_wrenches(self._contacts(tuple(found), [i] * len(found)))
            supports.append(np.max(corners @ directions.T, axis=1))
        bounds = np.empty(len(chosen))
        for begin in range(0, len(chosen), 4096):
            rows = chosen[begin : begin + 4096]
            best = supports[0][rows[:, 0]]
            for i in range(1, len(places)):
                best = np.maximum(best, supports[i][rows[:, i]])
            bounds[begin : begin + 4096] = best.min(axis=1)
        return bounds

    def _friction(self, index: int, normal: Array) -> float:
        """mu of a finger where the outward normal of the object is so."""
        return friction_on(self.shape, self.faces, normal, self.materials[index])

    def _contacts(self, choice: tuple[_Place, ...], fingers: Sequence[int]) -> Contacts:
        """Contacts of these fingers in axes of the object, about its centre of mass."""
        return Contacts(
            np.array([place.point - self.centre for place in choice]),
            -np.array([place.normal for place in choice]),
            np.array([self._friction(i, place.normal) for i, place in zip(fingers, choice, strict=True)]),
            np.array([self.lengths[i] for i in fingers]),
            size_of(self.world),
        )

    def solve(self, choice: tuple[_Place, ...]) -> Proposal | None:
        """The grasp at rest of a combination, None if there is none."""
        balanced = self._balanced(choice) if len(choice) == 2 else choice
        if balanced is None:
            return None
        points = np.round([place.point for place in balanced], _DIGITS)
        normals = -np.array([place.normal for place in balanced]) @ self.rotation.T
        friction = np.array([self._friction(i, place.normal) for i, place in enumerate(balanced)])
        forces = squeeze(
            self.world, self.position + points @ self.rotation.T, normals, friction, self.position, self.rotation,
            USE, PRESSING,
        )  # fmt: skip
        if forces is None:
            return None
        guess = self.start.copy()
        for i, place in enumerate(balanced):
            guess[own_columns(self.world, i)] = place.angles
        grasp = {
            "contact_points": points.tolist(),
            "internal_force": (np.sign(forces) * np.ceil(1000.0 * np.abs(forces) - 1e-6) / 1000.0).tolist(),
            "joint_guess": np.round(guess, 4).tolist(),
        }
        scenario = self.scenario.with_values({f"grasp.{key}": value for key, value in grasp.items()})
        quality = quality_in(self.world, scenario)
        if quality.refusal is not None or not quality.margin > 0.0:
            return None
        for tip, finger in zip(self.world.tips, quality.fingers, strict=True):
            if np.any(finger.reserve < 0.9 * self.reserve[list(tip.columns)]) or finger.torque_use.max() > TORQUE_USE:
                return None
        return Proposal(scenario, quality)

    def _balanced(self, choice: tuple[_Place, ...]) -> tuple[_Place, ...] | None:
        """Two points moved so that the centre of mass lies above or below their line: it carries no moment about it."""
        gravity = self.rotation.T @ self.world.gravity
        if np.linalg.norm(gravity) == 0.0:
            return choice
        points, normals = [place.point for place in choice], [place.normal for place in choice]
        for _ in range(50):
            across = np.cross(points[1] - points[0], gravity)
            if np.linalg.norm(across) < 1e-6 * np.linalg.norm(gravity):
                return None  # one above the other
            across /= np.linalg.norm(across)
            off = float(across @ (self.centre - points[0]))
            if abs(off) < 1e-13:
                break
            nearest = [self.shape.nearest(point + off * across) for point in points]
            points, normals = [point for point, _ in nearest], [normal for _, normal in nearest]
        moved = [
            self._place(i, point, normal, place.angles)
            for i, (point, normal, place) in enumerate(zip(points, normals, choice, strict=True))
        ]
        one, other = moved
        return None if one is None or other is None else (one, other)

    def is_near(self, choice: tuple[_Place, ...] | Proposal, other: Proposal) -> bool:
        """Whether all contacts are within a radius of the tip of those of a proposal."""
        mine = choice.scenario.grasp.contact_points if isinstance(choice, Proposal) else [p.point for p in choice]
        away = np.linalg.norm(np.array(mine) - np.array(other.scenario.grasp.contact_points), axis=1)
        return bool(np.all(away < self.radius))


def _along(joints: Array) -> Array:
    """Points along a finger [m], shape (points, 3)."""
    shares = np.arange(1, _SAMPLES + 1) / _SAMPLES
    parts = [joints[:1], *(a + shares[:, None] * (b - a) for a, b in pairwise(joints))]
    return np.concatenate(parts)


def _nearest_gap(points: Array) -> float:
    """Largest distance of a point from its nearest neighbour [m]."""
    from scipy.spatial import cKDTree

    return float(np.max(cKDTree(points).query(points, k=2)[0][:, 1]))


def _short(value: float) -> str:
    return repr(round(float(value), _DIGITS) + 0.0)
