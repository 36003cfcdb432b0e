"""What is left of the forces on joints and object at states without velocity, and the way from one to another."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from softhand.closed_loop.linearize import is_memory
from softhand.closed_loop.object_tangent import length_of
from softhand.closed_loop.start import relax_memory
from softhand.model.configuration import integrate
from softhand.model.world import slides_of
from softhand.numerics.arrays import Array
from softhand.plant.dynamics import generalized_force
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.resting.torques import Torques
from softhand.simulation.faults import APEX, FLAT, HEALTHY, RIM, find_fault
from softhand.simulation.pushes import Pushes

_STEP, _LEAST_STEP = 1e-6, 1e-9  # of differences [rad, m]
_SHIFT, _TURN = 1e-3, 0.03  # the longest step of a way [m, rad]
_FAULTS = {FLAT: "is pressed flat", APEX: "rolls over its apex", RIM: "rolls over its rim"}


class Point(NamedTuple):
    """A point of the way."""

    state: State
    """Its z is that after all slip."""
    memory: Any
    """Of the controller, as the way up to here left it."""


class Found(NamedTuple):
    """What holds at the end of a step."""

    left: Array
    """Of joint torques and, in axes of the object, force and moment on it; then changes of the memory, (nv + m,)."""
    state: State
    """Before its slip is final."""
    command: Array
    """Before effort limits [N m, N], shape (n,)."""
    memory: Any


class Balance:
    """A plant that stands still, under torques.

    Attributes:
        plant: left where it was asked last.
        size: count of the unknowns: displacement of joints and object, then numbers of the memory.
        is_length: which displacements are lengths, shape (nv,).
        mass: mass matrix at the start, shape (nv, nv).
        length: by which moments count as forces [m].
        steps: by which one of these is moved at most in one step of the way, shape (size,).
        weights: of what is left, the roots of the inertias; shape (size,).
    """

    def __init__(self, plant: Plant, torques: Torques, pushes: Pushes, start: Point) -> None:
        self.plant, self.torques, self._pushes = plant, torques, pushes
        world, nv = plant.world, plant.world.nv
        self._effort, self._nv, self._still = world.effort_limit, nv, np.zeros(nv)
        self._Theta = np.full(world.n_tips, np.nan)
        self._relaxes = bool(np.any(is_memory(plant)))
        self.size = nv + len(torques.sizes)
        self.is_length = np.array([*slides_of(world), True, True, True, False, False, False])
        steps = np.where(self.is_length, _SHIFT, _TURN)
        self.steps = np.concatenate([steps, np.full(len(torques.sizes), np.inf)])
        plant.update(start.state.q, self._still, start.state.z)
        M = plant.rigid.mass_matrix(start.state.q)
        self.mass = M
        self.weights = np.concatenate([np.sqrt(np.diag(M)), torques.sizes])
        self.length = length_of(world.model.inertias[world.object_joint])

    def at(self, point: Point, way: Array) -> Found:
        """At the end of a step from a point, straight in joints and object, the contacts rolling along."""
        q, z = self._roll(point.state, way[: self._nv])
        return self._here(State(q, self._still, z, point.state.time), point.memory, way[self._nv :])

    def slope(self, point: Point, way: Array, near: float = 1.0) -> Array:
        """Derivatives of `left` by the way, by central differences, shape (size, size).

        Args:
            point: where the step begins.
            way: where they are taken.
            near: how far it is to a root [rad, m]; a kink beyond it is not to be seen.
        """
        found = np.empty((self.size, self.size))
        h = min(_STEP, max(_LEAST_STEP, 0.3 * near))
        steps = np.concatenate([np.full(self._nv, h), _STEP * self.torques.sizes])
        for k, h in enumerate(steps):
            move = np.zeros(self.size)
            move[k] = h
            found[:, k] = (self.at(point, way + move).left - self.at(point, way - move).left) / (2.0 * h)
        return found

    def accept(self, point: Point, way: Array) -> Point:
        """The point at the end of a step, slip made final."""
        found = self.at(point, way)
        self.plant.update(*found.state.arrays)
        z = found.state.z.copy()
        self.plant.note_slip(z)
        self.torques.go_on()
        return Point(State(found.state.q, self._still, z, found.state.time), found.memory)

    def fault(self, found: Point) -> str:
        """What ends the fingertip model at a point, in words; nothing if it holds there."""
        self.plant.update(*found.state.arrays)
        fault, contact = find_fault(self._still, self.plant.pads, self.plant.contacts, self._Theta)
        name = self.plant.contact_names[contact]
        return "" if fault == HEALTHY else f"{name} {_FAULTS.get(fault, 'has no force there by its law')}"

    def share_of_step(self, way: Array) -> float:
        """How long a way is, 1 for the longest step."""
        return float(np.max(np.abs(way) / self.steps))

    def newtons(self, left: Array) -> float:
        """Size of what is left [N], moments over the length of the object; changes of the memory of their sizes."""
        scale = np.concatenate([np.where(self.is_length, 1.0, self.length), self.torques.sizes])
        return float(np.max(np.abs(left) / scale))

    def scale(self) -> float:
        """The weight and all that the contacts carry where the plant was asked last [N]."""
        world = self.plant.world
        weight = world.object_mass * float(np.linalg.norm(world.gravity))
        return weight + float(np.sum(np.abs(self.plant.contacts["force"][:, :3]))) + 1e-3

    def torque(self, command: Array) -> Array:
        """What arrives of a command [N m, N], shape (n,)."""
        return np.clip(command, -self._effort, self._effort)

    def _here(self, state: State, memory: Any, more: Array) -> Found:
        plant = self.plant
        plant.update(*state.arrays)
        if self._relaxes:
            relax_memory(plant, state)
            plant.update(*state.arrays)
        answer = self.torques.ask(state, memory, more)
        left = np.empty(self._nv)
        plant.update(*state.arrays)
        plant.external[:] = 0.0
        if self._pushes.are_any:
            self._pushes.apply(state.time, state.q)
        terms = plant.snapshot.terms
        generalized_force(plant.touching, terms.nle, self.torque(answer.command), plant.external, left)
        return Found(np.concatenate([left, answer.change]), state, answer.command, answer.memory)

    def _roll(self, state: State, way: Array) -> tuple[Array, Array]:
        """q and z after a step, by Simpson's rule: how fast z moves with the way depends on q alone."""
        plant, z = self.plant, state.z.copy()
        q = state.q.copy()
        for share, weight in ((0.0, 1.0), (0.5, 4.0), (1.0, 1.0)):
            integrate(plant.joints, state.q, way, share, q)
            plant.update(q, way, state.z)
            z[:, :3] += weight / 6.0 * plant.contacts["deformation_rate"][:, 1:]
        return q, z
