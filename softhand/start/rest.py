"""Where the object rests by itself: on a table, on palms, on both."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pinocchio as pin

from softhand.contact.pads import Support
from softhand.errors import GraspError
from softhand.model.shapes.face import Face
from softhand.numerics.arrays import Array
from softhand.numerics.roots import find_root
from softhand.plant.plant import Plant

_MOVED = 1e-3  # [m] by which the object may be off the place where it rests
_TILTED = 0.02  # [rad] likewise
_SUNK = 1e-5  # [m] how deep the search begins
_BALANCED = 1e-12  # of the weight
_LEVEL = 1e-9  # sine of the angle between gravity and the normal of the table
_STEP = 1e-6  # of derivatives, over the size of the object and in [rad]


def resting_pose(plant: Plant, q: Array) -> tuple[Array, Array]:
    """Where the object is in equilibrium on what carries it, with nothing stored in shear.

    It is moved in the shortest way to where the normal forces f_k of its supports at x_k along n_k, on the object of
    mass m and with the centre of mass c, are

        sum f_k n_k + m g = 0,   sum (x_k - c) x f_k n_k = 0

    Without gravity it stays.

    Args:
        plant: left anywhere; its fingertips have no part in this.
        q: the hand as it is at the start, and the object about where it rests, shape (nq,).

    Returns:
        Position [m], shape (3,), and rotation, shape (3, 3), of the object frame.

    Raises:
        GraspError: nothing is below the object, the table is not level, or the object does not rest there.
    """
    world = plant.world
    place = _Place(plant, q)
    if place.weight == 0.0:
        return world.object_position(q).copy(), world.object_rotation(q)
    names = _carriers(plant)
    if not names:
        raise GraspError(
            "with grasp.opening no finger holds the object at the start, and it would fall; add a [table] below it, or "
            "a [[palm]].",
            finger="", quantity="support", value=0,
        )  # fmt: skip
    if names == ["table"]:
        _check_level(plant.supports, world.gravity)
    gap = place.gap()
    sunk = np.concatenate([(gap + _SUNK) / place.size * place.down, np.zeros(3)])
    limit = np.array([_MOVED / place.size] * 3 + [_TILTED] * 3)
    bound, slope = limit + np.abs(sunk[:3]).max(), place.slope(sunk)
    balanced = _BALANCED + 10.0 * np.finfo(float).eps * float(np.linalg.norm(slope))
    step, left = find_root(place.excess, place.slope, [sunk], -bound, bound, balanced)
    if left > balanced or np.any(np.abs(step) > limit):
        raise GraspError(
            f"the object does not stand on the {' and the '.join(names)} at object.position: it is {1e3 * gap:.3g} mm "
            f"above it where it is lowest; put it there within {1e3 * _MOVED:g} mm, within "
            f"{math.degrees(_TILTED):.2g} deg of where it rests without friction.",
            finger="", quantity="height", value=gap,
        )  # fmt: skip
    return place.moved(step)


class _Place:
    """The load of the object at poses beside one, in multiples of its weight and its size."""

    def __init__(self, plant: Plant, q: Array) -> None:
        world, self._plant = plant.world, plant
        inertia, gravity = world.model.inertias[world.object_joint], world.gravity
        g = float(np.linalg.norm(gravity))
        self.weight = float(inertia.mass) * g
        self.down = gravity / g if g > 0.0 else gravity
        self.size = math.sqrt(float(np.trace(inertia.inertia)) / float(inertia.mass))
        self._position, self._rotation = world.object_position(q).copy(), world.object_rotation(q)
        self._q, self._lever = q.copy(), inertia.lever
        self._v, self._z = np.zeros(world.model.nv), np.zeros((len(plant.contacts), plant.n_memory))
        self._signs = np.array([_sign(support, world.object_joint) for support in plant.supports])

    def moved(self, step: Array) -> tuple[Array, Array]:
        """The pose after a way [of the size] and a turn [rad] about the centre of mass, shape (6,)."""
        turn = pin.exp3(step[3:])
        lever = self._rotation @ self._lever
        return self._position + self.size * step[:3] + lever - turn @ lever, turn @ self._rotation

    def gap(self) -> float:
        """Between the object and the nearest of what may carry it [m]; negative in touch."""
        self._touch(np.zeros(6))
        carrying = self._signs != 0.0
        pads, contacts = self._plant.pads[-len(carrying) :], self._plant.support_contacts
        return float(np.min((contacts["distance"] - pads["radius"])[carrying]))

    def excess(self, step: Array) -> Array:
        """Force over the weight, and moment about the centre of mass over that and the size, shape (6,)."""
        centre = self._touch(step)
        contacts = self._plant.support_contacts
        forces = self._signs[:, None] * np.einsum("kab,kb->ka", contacts["rotation"], contacts["force"][:, :3])
        moment = np.sum(np.cross(contacts["point"] - centre, forces), axis=0)
        return np.concatenate([forces.sum(axis=0) / self.weight + self.down, moment / (self.weight * self.size)])

    def slope(self, step: Array) -> Array:
        """Derivatives of `excess`, by central differences, shape (6, 6)."""
        ways = _STEP * np.eye(6)
        return np.column_stack([(self.excess(step + way) - self.excess(step - way)) / (2.0 * _STEP) for way in ways])

    def _touch(self, step: Array) -> Array:
        """Evaluate the plant with the object there; returns the centre of mass [m]."""
        position, rotation = self.moved(step)
        self._plant.world.set_object_pose(position, rotation, self._q)
        self._plant.update(self._q, self._v, self._z)
        return position + rotation @ self._lever


def _sign(support: Support, object_joint: int) -> float:
    """Of the force of a support on the object: its base, its pad, or neither."""
    return float(support.base == object_joint) - float(support.joint == object_joint)


def _carriers(plant: Plant) -> list[str]:
    """What may carry the object, in words."""
    carrying = [support for support in plant.supports if _sign(support, plant.world.object_joint)]
    tables = sum(isinstance(support.shape, Face) for support in carrying)
    return ["table"] * (tables > 0) + ["palm"] * (tables < len(carrying))


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
