"""Where the object rests by itself: on a table, on palms, on both."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from softhand.contact.pads import Support
from softhand.errors import GraspError
from softhand.model.shapes.face import Face
from softhand.numerics.arrays import Array
from softhand.numerics.roots import find_root, newton
from softhand.numerics.spatial import cross_matrix
from softhand.plant.plant import Plant

_MOVED = 1e-3  # [m] by which the object may be off the place where it rests
_TILTED = 0.02  # [rad] likewise
_SUNK = 1e-5  # [m] how deep the search begins
_BALANCED = 1e-12  # of the weight
_STUCK = 1.0 - 1e-6  # use of the limit surface
_LEVEL = 1e-9  # sine of the angle between gravity and the normal of the table
_MOST_STEPS, _SMALL = 300, 2e-3  # of the settling; how long one is at most, in the same measure as the next
_NEAR, _LEAST_DRAG = 1e-2, 1e-6
_LET_GO = 4.0  # from one load to the next
_CORRECTIONS = 3  # at each
_STEP = 1e-6  # of derivatives, over the size of the object and in [rad]


class Rest(NamedTuple):
    """An object at rest by itself."""

    position: Array
    """Of the object frame [m], shape (3,)."""
    rotation: Array
    """Its axes, shape (3, 3)."""
    stored: Array
    """Shear and torsion of each support: s1, s2 [m], psi [rad], shape (ns, 3)."""


def resting_pose(plant: Plant, q: Array) -> Rest:
    """Where the object is in equilibrium on what carries it.

    It is moved in the shortest way to where the forces f_k of its supports at x_k, on the object of mass m and with the
    centre of mass c, are

        sum f_k + m g = 0,   sum (x_k - c) x f_k + torsions = 0

    On a table nothing is stored in shear. On palms, whose normals turn with the object, the object is let down where it
    is, and sticks from there on.

    Without gravity it stays.

    Args:
        plant: left anywhere; its fingertips have no part in this.
        q: the hand as it is at the start, and the object about where it rests, shape (nq,).

    Raises:
        GraspError: nothing is below the object, the table is not level, or the object does not rest there.
    """
    place, names = _Place(plant, q), _carriers(plant)
    if place.weight == 0.0:
        return place.rest(np.zeros(6))
    if not names:
        raise GraspError(
            "with grasp.opening no finger holds the object at the start, and it would fall; add a [table] below it, or "
            "a [[palm]].",
            finger="", quantity="support", value=0,
        )  # fmt: skip
    if names == ["table"]:
        _check_level(plant.supports, plant.world.gravity)
    gap = place.let_down()
    step, left = _balance(place)
    if left > 0.0 and names != ["table"]:
        place.sticks = True
        step, left = _balance(place)
    far = place.is_far(step)
    if left > 0.0 or far or place.slides(step):
        told = f"it is {1e3 * abs(gap):.3g} mm {'above' if gap > 0.0 else 'deep in'} it where it is lowest"
        remedy = (
            f"put it there within {1e3 * _MOVED:g} mm, and within {math.degrees(_TILTED):.2g} deg of where it rests "
            "and friction holds it"
        )
        if left == 0.0 and far:
            x, y, z = place.moved(step)[0]
            turn = round(math.degrees(float(np.linalg.norm(step[3:]))), 3)
            told += f", and rests {1e3 * place.size * np.linalg.norm(step[:3]):.3g} mm and {turn:.2g} deg from there"
            remedy += f"; its object.position is about [{x:.5g}, {y:.5g}, {z:.5g}]"
        raise GraspError(
            f"the object does not stand on the {' and the '.join(names)} at object.position: {told}; {remedy}.",
            finger="", quantity="height", value=gap,
        )  # fmt: skip
    return place.rest(step)


def _balance(place: _Place) -> tuple[Array, float]:
    """The step to where nothing is left of the load, and 0; or what is left of it at best."""
    bound = np.array([_MOVED / place.size] * 3 + [_TILTED] * 3) + np.abs(place.first[:3]).max()
    balanced = _BALANCED + 10.0 * np.finfo(float).eps * float(np.linalg.norm(place.slope(place.first)))
    for way in (lambda bound: place.first, place.unloaded):
        step = newton(place.excess, place.slope, way(bound))
        if not place.is_far(step) and np.linalg.norm(place.excess(step)) <= balanced:
            return step, 0.0
    step, left = find_root(place.excess, place.slope, [place.first], -bound, bound, balanced)
    if left > balanced:
        step, left = find_root(place.excess, place.slope, [place.settled(bound)], -bound, bound, balanced)
    return step, left if left > balanced else 0.0


class _Place:
    """The load of the object at poses beside one, in multiples of its weight and its size.

    Attributes:
        weight: [N].
        size: radius of gyration, about [m].
        first: the step at which it touches first.
        sticks: whether friction holds it where it touched first.
        load: what it weighs, in multiples of its weight.
    """

    def __init__(self, plant: Plant, q: Array) -> None:
        world, self._plant = plant.world, plant
        inertia, gravity = world.model.inertias[world.object_joint], world.gravity
        g = float(np.linalg.norm(gravity))
        self.weight, self._down = float(inertia.mass) * g, gravity / g if g > 0.0 else gravity
        self.size = math.sqrt(float(np.trace(inertia.inertia)) / float(inertia.mass))
        self.first, self.sticks, self.load = np.zeros(6), False, 1.0
        self._step = _STEP
        self._position, self._rotation = world.object_position(q).copy(), world.object_rotation(q)
        self._q, self._lever = q.copy(), inertia.lever
        self._v, self._z = np.zeros(world.nv), np.zeros((len(plant.contacts), plant.n_memory))
        self._signs = np.array([_sign(support, world.object_joint) for support in plant.supports])

    def let_down(self) -> float:
        """Set `first`: straight down until it touches; returns how far that is [m]."""
        self._touch(self.first)
        carrying = self._signs != 0.0
        pads, contacts = self._plant.pads[-len(carrying) :], self._plant.support_contacts
        gap = float(np.min((contacts["distance"] - pads["radius"])[carrying]))
        self.first[:3] = (gap + _SUNK) / self.size * self._down
        return gap

    def moved(self, step: Array) -> tuple[Array, Array]:
        """The pose after a way [of the size] and a turn [rad] about the centre of mass, shape (6,)."""
        turn = pin.exp3(step[3:])
        lever = self._rotation @ self._lever
        return self._position + self.size * step[:3] + lever - turn @ lever, turn @ self._rotation

    def rest(self, step: Array) -> Rest:
        """What is found there."""
        self._touch(step)
        stored = self._plant.support_contacts["deformation"][:, 1:].copy()
        return Rest(*self.moved(step), stored if self.sticks else np.zeros_like(stored))

    def slides(self, step: Array) -> bool:
        """Whether friction, where it has to hold the object, is at its limit at all that carries it."""
        self._touch(step)
        contacts = self._plant.support_contacts
        return self.sticks and bool(np.all(contacts["limit_surface_use"][contacts["force"][:, 2] > 0.0] > _STUCK))

    def excess(self, step: Array) -> Array:
        """Force over the weight, and moment about the centre of mass over that and the size, shape (6,)."""
        self._touch(step)
        contacts, position, rotation = self._plant.support_contacts, *self.moved(step)
        forces = self._signs[:, None] * np.einsum("kab,kb->ka", contacts["rotation"], contacts["force"][:, :3])
        arms = contacts["point"] - position - rotation @ self._lever
        torsions = (self._signs * contacts["force"][:, 3])[:, None] * contacts["rotation"][:, :, 2]
        moment = np.sum(np.einsum("kij,kj->ki", cross_matrix(arms), forces) + torsions, axis=0)
        return np.concatenate(
            [forces.sum(axis=0) / self.weight + self.load * self._down, moment / (self.weight * self.size)]
        )

    def slope(self, step: Array) -> Array:
        """Derivatives of `excess`, by central differences, shape (6, 6)."""
        h = self._step
        ways = h * np.eye(6)
        return np.column_stack([(self.excess(step + way) - self.excess(step - way)) / (2.0 * h) for way in ways])

    def settled(self, bound: Array) -> Array:
        """Near to where it comes to rest if it sinks slowly, in small steps; those of Newton go far on one corner."""
        step = self.first
        for _ in range(_MOST_STEPS):
            excess, slope = self.excess(step), self.slope(step)
            values, ways = np.linalg.eigh(-0.5 * (slope + slope.T))
            along, drag = ways.T @ excess, _LEAST_DRAG
            while np.abs(along / (np.maximum(values, 0.0) + drag)).max() > _SMALL:
                drag *= 2.0
            if np.linalg.norm(excess) < _NEAR or np.any(np.abs(step) > bound):
                break
            step = step + ways @ (along / (np.maximum(values, 0.0) + drag))
        return np.clip(step, -bound, bound)

    def unloaded(self, bound: Array) -> Array:
        """Near to where it comes to rest if it is pressed onto all that may carry it, and let go little by little.

        A light object on stiff feet sinks less than it is askew, so that its own weight does not bring the next foot
        down.
        """
        step = self.first.copy()
        step[:3] += _TILTED * self._down
        self.load = 0.0
        self.load = max(1.0, float(-self._down @ self.excess(step)[:3]))
        self._step = min(_STEP, 0.1 * _TILTED / self.load)  # far less than it sinks under its own weight
        while True:
            for _ in range(_CORRECTIONS):
                step = step - np.linalg.lstsq(self.slope(step), self.excess(step), rcond=1e-10)[0]
            if self.load == 1.0 or np.any(np.abs(step) > bound + _TILTED):
                self.load = 1.0
                return np.clip(step, -bound, bound)
            self.load = max(1.0, self.load / _LET_GO)

    def is_far(self, step: Array) -> bool:
        """Whether a step goes further than an object may be from where it rests."""
        return bool(np.any(np.abs(step[:3]) > _MOVED / self.size) or np.any(np.abs(step[3:]) > _TILTED))

    def _touch(self, step: Array) -> None:
        """Evaluate the plant with the object there."""
        plant = self._plant
        plant.world.set_object_pose(*self.moved(step), self._q)
        self._z[:] = 0.0
        plant.update(self._q, self._v, self._z)
        if not self.sticks:
            return
        # the way of the object at each contact since it touched first, along the contact, and its turn about the normal
        (position, rotation), (before, axes) = self.moved(step), self.moved(self.first)
        contacts = plant.support_contacts
        way = contacts["point"] - before - (contacts["point"] - position) @ (axes @ rotation.T).T
        turn = pin.log3(rotation @ axes.T)
        frames, touching = contacts["rotation"], contacts["force"][:, 2] > 0.0
        stored = np.column_stack([np.einsum("kab,ka->kb", frames, way)[:, :2], frames[:, :, 2] @ turn])
        self._z[-len(stored) :, :3] = np.where(touching[:, None], -self._signs[:, None] * stored, 0.0)
        plant.update(self._q, self._v, self._z)


def _sign(support: Support, object_joint: int) -> float:
    """Of the force of a support on the object: its base, its pad, or neither."""
    return float(support.base == object_joint) - float(support.joint == object_joint)


def _carriers(plant: Plant) -> list[str]:
    """What may carry the object, in words."""
    carrying = [support for support in plant.supports if _sign(support, plant.world.object_joint)]
    tables = sum(isinstance(support.shape, Face) for support in carrying)
    obstacles = sum(support.obstacle is not None for support in carrying)
    palms = len(carrying) - tables - obstacles
    return ["table"] * (tables > 0) + ["palm"] * (palms > 0) + ["obstacle"] * (obstacles > 0)


def _check_level(supports: Iterable[Support], gravity: Array) -> None:
    normal = next(support.shape.normal for support in supports if isinstance(support.shape, Face))
    down = gravity / np.linalg.norm(gravity)
    slope = float(np.linalg.norm(np.cross(normal, down)))
    if slope > _LEVEL or normal @ down > 0.0:
        raise GraspError(
            "the object stands at the start only on a level table: table.normal must point against gravity; it is "
            f"{math.degrees(math.acos(min(max(-float(normal @ down), -1.0), 1.0))):.3g} deg off.",
            finger="", quantity="table.normal", value=slope,
        )  # fmt: skip
