"""Bringing an observation up to date: one compiled call after Pinocchio."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from softhand.contact.kinematics import move_contacts
from softhand.contact.layer import evaluate_contacts
from softhand.contact.pairs import contact_pairs
from softhand.model.gravity import gravity_forces
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled
from softhand.numerics.prepared import prepared
from softhand.plant.plant import Plant
from softhand.plant.state import State, is_at
from softhand.references.reference import Desired
from softhand.sensing.describe import (
    copy_desired,
    describe_contacts,
    describe_jacobians,
    describe_joints,
    describe_object,
    describe_supports,
    describe_tips,
)
from softhand.sensing.fields import pick, room
from softhand.sensing.groups import GROUPS
from softhand.sensing.internal_forces import internal_forces
from softhand.sensing.known import Known
from softhand.sensing.observation import Observation


class Body(NamedTuple):
    """What the sensor knows of the rigid bodies."""

    joints: AnyArray
    """As `World.joints`."""
    tip_joints: AnyArray
    """Joint that carries each tip, shape (nc,)."""
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


class Sensor:
    """Keeps an observation up to date; without Pinocchio where the stepper has left the plant at the very state."""

    def __init__(self, plant: Plant, desired: Desired) -> None:
        world, pairs = plant.world, contact_pairs(plant.world.n_tips)
        self._plant, self._desired = plant, desired
        self._body = Body(
            plant.joints,
            np.array([tip.joint for tip in world.tips], dtype=np.int64),
            np.array([tip.rotation for tip in world.tips]),
            np.array(pairs, dtype=np.int64).reshape(-1, 2),
            world.bodies,
            world.gravity,
            np.zeros((world.model.njoints, 4)),
            np.zeros(world.model.nv),
        )
        known = Known.of(plant, len(pairs))
        self.block = np.zeros(room(known.sizes))
        self.observation = Observation(known, self.block, is_live=True)
        self._state: State | None = None

    def observe(self, state: State, time: float) -> Observation:
        """The observation at a state and a time [s]."""
        if state is not self._state:
            self._prepare(state)
        if not self._observe(True):
            self._plant.snapshot.sense(state.q)
            self._observe(False)
        self.observation.__dict__["time"] = time
        return self.observation

    def _prepare(self, state: State) -> None:
        plant, desired = self._plant, self._desired
        self._state = state
        self._observe = prepared(
            _observe,
            self._body,
            plant.touching,
            plant.snapshot.terms,
            Wanted(*(getattr(desired, name) for name in Wanted._fields)),
            state.arrays,
            plant.at,
            tuple(pick(group, self.observation._views) for group in GROUPS),
            varying=(True,),
        )


@compiled
def _observe(body, touch, terms, desired, state, at, groups, evaluated):
    """Everything but the time; False if the plant is said to be evaluated at this state and is not."""
    contacts, poses, J = touch.contacts, terms.poses, terms.J
    joints, object_, tips, at_tips, jacobians, supports, internal, asked = groups
    if not evaluated:
        evaluate_contacts(touch.pads, touch.columns, poses, J, state.v, state.z, 0.0, False, contacts, touch.jacobian)
        at[0] = math.nan
    elif is_at(state.q, state.v, state.z, at):
        move_contacts(touch.columns, contacts, touch.jacobian, state.v)
    else:
        return False
    gravity_forces(body.bodies, body.gravity, poses, J, body.moments, body.gravity_terms)
    describe_joints(body, state.q, state.v, joints)
    describe_object(poses[poses.shape[0] - 1], state.v, body.gravity_terms, object_)
    describe_tips(body, touch.columns, poses, J, contacts, tips)
    describe_contacts(touch, poses, J, state.v, at_tips)
    describe_jacobians(touch, poses[poses.shape[0] - 1], object_.coordinate_map, jacobians)
    describe_supports(contacts, at_tips.friction_use.shape[0], supports)
    # f_N = K^+ f_C                                                                                  (58)
    internal_forces(contacts, body.pairs, internal.internal_force_basis, internal.internal_force)
    copy_desired(desired, asked)
    return True
