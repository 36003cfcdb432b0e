"""Bringing an observation up to date: one compiled call after Pinocchio."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from softhand.contact.kinematics import move_contacts
from softhand.contact.layer import evaluate_contacts
from softhand.contact.pairs import contact_pairs
from softhand.model.coupled import Coupled, project_force
from softhand.model.coupled import room as room_for_coupled
from softhand.model.gravity import gravity_forces
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled
from softhand.numerics.prepared import prepared
from softhand.numerics.straight import structure_of
from softhand.plant.plant import Plant
from softhand.plant.state import State, is_at
from softhand.references.reference import Desired
from softhand.sensing.describe import (
    copy_desired,
    describe_contacts,
    describe_friction,
    describe_jacobians,
    describe_joints,
    describe_object,
    describe_paper_jacobians,
    describe_rolling,
    describe_supports,
    describe_tips,
)
from softhand.sensing.fields import FIELDS, pick, room
from softhand.sensing.groups import (
    CONTACTS,
    FRICTION,
    GROUPS,
    INTERNAL,
    JACOBIANS,
    JOINTS,
    OBJECT,
    PAPER,
    ROLLING,
    SUPPORTS,
    TIPS,
    parts_of,
)
from softhand.sensing.internal_forces import internal_forces
from softhand.sensing.known import Known
from softhand.sensing.observation import Observation
from softhand.tactile.field import Felt, feel


class Body(NamedTuple):
    """What the sensor knows of the rigid bodies."""

    joints: AnyArray
    """As `World.joints`."""
    tip_joints: AnyArray
    """Joint that carries each tip, shape (nc,)."""
    tip_views: AnyArray
    """First column of J for each tip, see `World.view`, shape (nc,)."""
    tip_rotations: Array
    """Axes of F in the frame of that joint, shape (nc, 3, 3)."""
    pairs: AnyArray
    """Contacts that an internal force acts between, shape (np, 2)."""
    bodies: AnyArray
    """As `World.bodies`."""
    gravity: Array
    """[m/s^2], shape (3,)."""
    moments: Array
    """Scratch of `gravity_forces`."""
    gravity_terms: Array
    """N(q), shape (nv,)."""
    coupled: Coupled
    """Of joints to motors; its nle is scratch for N of all joints."""


class Wanted(NamedTuple):
    """The arrays of a `Desired`."""

    coordinates: Array
    coordinates_rate: Array
    coordinates_acceleration: Array
    internal_force: Array
    twist: Array
    twist_rate: Array
    opening: Array
    carried: Array
    standoff: Array
    standoff_rate: Array
    standoff_acceleration: Array

    @classmethod
    def of(cls, desired: Desired) -> Wanted:
        """Those of one."""
        return cls(*(getattr(desired, name) for name in cls._fields))


class Sensor:
    """Keeps an observation up to date; without Pinocchio where the stepper has left the plant at the very state.

    Args:
        plant: what is observed.
        desired: what is asked for, live.
        block: where the observation lies; memory of its own if not given.
    """

    def __init__(self, plant: Plant, desired: Desired, block: Array | None = None) -> None:
        world, pairs = plant.world, contact_pairs(plant.world.n_tips)
        self._plant, self._desired = plant, desired
        self.body = Body(
            plant.joints,
            np.array([tip.joint for tip in world.tips], dtype=np.int64),
            np.array([world.view(tip.joint, world.object_joint) for tip in world.tips], dtype=np.int64),
            np.array([tip.rotation for tip in world.tips]),
            np.array(pairs, dtype=np.int64).reshape(-1, 2),
            world.bodies,
            world.gravity,
            np.zeros((world.model.njoints, 4)),
            np.zeros(world.nv),
            room_for_coupled(world.coupled),
        )
        known = Known.of(plant, len(pairs))
        self.block = np.zeros(room(known.sizes)) if block is None else block
        self.observation = Observation(known, self.block, is_live=True)
        self.groups = tuple(pick(group, self.observation._views) for group in GROUPS)
        self.felt = pick(Felt, self.observation._views)
        self._state: State | None = None

    def become(self) -> bool:
        """Be that of what the plant has become, in the same memory; False where that takes other code."""
        body, world = self.body, self._plant.world
        before = structure_of(body.bodies)
        body.bodies[...], body.gravity[...], self.block[...] = world.bodies, world.gravity, 0.0
        self.observation.__dict__["known"] = Known.of(self._plant, len(body.pairs))
        return structure_of(body.bodies) == before

    def observe(self, state: State, time: float) -> Observation:
        """The observation at a state and a time [s]."""
        if state is not self._state:
            self._prepare(state)
        if not self._observe(True):
            self._plant.snapshot.sense(state.q)
            self._observe(False)
        if self._plant.taxels is not None:
            self._feel()
        self.observation.__dict__["time"] = self.observation._views.clock[0] = time
        return self.observation

    def _prepare(self, state: State) -> None:
        plant, desired = self._plant, self._desired
        self._state = state
        self._observe = prepared(
            _observe_from_there,
            self.body,
            plant.touching,
            plant.snapshot.terms,
            Wanted.of(desired),
            state.arrays,
            plant.at,
            self.groups,
            parts_of(FIELDS),
            varying=(True,),
        )
        if plant.taxels is not None:
            self._feel = prepared(feel, plant.skin, plant.pads, plant.contacts, plant.snapshot.terms.poses, self.felt)


@compiled
def _observe_from_there(body, touch, terms, desired, state, at, groups, parts, evaluated):
    """`observe`; False if the plant is said to be evaluated at this state and is not."""
    if evaluated and not is_at(state.q, state.v, state.z, at):
        return False
    observe(body, touch, terms, desired, state, at, groups, parts, evaluated)
    return True


@compiled
def observe(body, touch, terms, desired, state, at, groups, parts, evaluated):
    """All parts that are asked for, but the time.

    Args:
        body: what does not change.
        touch: arrays of the contacts, `plant.Touch`.
        terms: `Snapshot.terms`; J and poses belong to the state.
        desired: what the reference asks for now.
        state: `State.arrays`.
        at: `Plant.at`.
        groups: set, the fields of an observation by `GROUPS`.
        parts: which of them, see `groups.parts_of`.
        evaluated: whether the stepper has evaluated the contacts at this state.
    """
    if not evaluated:
        evaluate_contacts(touch.pads, touch.columns, terms.poses, terms.J, state.v, state.z, 0.0, touch.depths, False,
                          touch.contacts, touch.jacobian)  # fmt: skip
        at[0] = math.nan
    else:
        move_contacts(touch.pads, touch.columns, touch.contacts, touch.jacobian, state.v)
    describe(body, touch, terms, desired, state.q, state.v, groups, parts)


@compiled
def describe(body, touch, terms, desired, q, v, groups, parts):
    """The fields of an observation from contacts and rigid bodies as they stand; args as those of `observe`."""
    contacts, poses, J = touch.contacts, terms.poses, terms.J
    object_pose = poses[poses.shape[0] - 1]
    joints, object_, tips, at_tips, jacobians, supports, internal, asked = groups
    if parts[JOINTS] or parts[OBJECT]:
        if body.coupled.S.shape[0] == 0:
            gravity_forces(body.bodies, body.gravity, poses, J, body.moments, body.gravity_terms)
        else:
            gravity_forces(body.bodies, body.gravity, poses, J, body.moments, body.coupled.nle)
            project_force(body.coupled, body.coupled.nle, body.gravity_terms)
    if parts[JOINTS]:
        describe_joints(body, q, v, joints)
    if parts[OBJECT]:
        describe_object(object_pose, v, body.gravity_terms, object_)
    if parts[TIPS]:
        describe_tips(body, touch.columns, poses, J, contacts, tips)
    if parts[CONTACTS]:
        describe_contacts(touch, at_tips)
    if parts[FRICTION]:
        describe_friction(touch, at_tips)
    if parts[ROLLING]:
        describe_rolling(touch, poses, J, v, at_tips)
    if parts[JACOBIANS]:
        describe_jacobians(touch, object_pose, jacobians)
    if parts[PAPER]:
        describe_paper_jacobians(touch, object_pose, object_.coordinate_map, jacobians)
    if parts[SUPPORTS]:
        describe_supports(contacts, at_tips.is_slipping.shape[0], supports)
    if parts[INTERNAL]:  # f_N = K^+ f_C                                                               (58)
        internal_forces(contacts, body.pairs, internal.internal_force_basis, internal.internal_force)
    copy_desired(desired, asked)
