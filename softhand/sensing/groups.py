"""The fields of an observation in groups, as the kernels of the sensor take them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from softhand.numerics.arrays import AnyArray, Array


class Joints(NamedTuple):
    """What the joints tell."""

    configuration: Array
    joint_position: Array
    joint_velocity: Array
    gravity_torque: Array


class Object(NamedTuple):
    """Where the object is, how it moves and what holds it."""

    object_coordinates: Array
    object_rotation: Array
    coordinate_map: Array
    object_twist: Array
    object_gravity: Array
    N_O: Array


class Tips(NamedTuple):
    """What depends on the joints alone."""

    tip_position: Array
    tip_rotation: Array
    tip_jacobian: Array
    tip_angular_jacobian: Array


class Contacts(NamedTuple):
    """The contacts of the tips."""

    contact_force: Array
    contact_moment: Array
    contact_angles: Array
    contact_point: Array
    contact_rotation: Array
    contact_coordinates: Array
    contact_coordinates_rate: Array
    contact_feature: Array
    deformation: Array
    deformation_rate: Array
    friction_use: Array
    limit_surface_use: Array
    is_slipping: Array
    slip_travel: Array
    slip_twist: Array
    slip_loss: Array
    slipped_share: Array
    element_deformation: Array
    element_force: Array


class Jacobians(NamedTuple):
    """Of the contacts, by the velocities of joints and object."""

    hand_force_jacobian: Array
    hand_torsion_jacobian: Array
    object_force_jacobian: Array
    object_torsion_jacobian: Array
    J_O_f: Array
    J_O_tau: Array


class Supports(NamedTuple):
    """What else touches."""

    support_force: Array
    support_moment: Array
    support_deformation: Array
    support_point: Array
    support_rotation: Array
    support_is_slipping: Array
    support_slip_loss: Array


class Internal(NamedTuple):
    """Internal forces."""

    internal_force_basis: Array
    internal_force: Array


class Asked(NamedTuple):
    """What the reference asks for."""

    object_coordinates_desired: Array
    object_coordinates_rate_desired: Array
    object_coordinates_acceleration_desired: Array
    object_twist_desired: Array
    object_twist_rate_desired: Array
    internal_force_desired: Array
    opening_desired: Array
    carried_desired: Array
    standoff_desired: Array
    standoff_rate_desired: Array
    standoff_acceleration_desired: Array


GROUPS = (Joints, Object, Tips, Contacts, Jacobians, Supports, Internal, Asked)

JOINTS, OBJECT, TIPS, CONTACTS, FRICTION, ROLLING, JACOBIANS, PAPER, SUPPORTS, INTERNAL = range(10)
"""Parts of an observation that can be left out: the groups, and of them apart what is dear: how near a contact is to
slipping, eta and its rate, and the Jacobians by the coordinates of the object."""

_FRICTION = {"friction_use", "limit_surface_use"}
_ROLLING = {"contact_coordinates", "contact_coordinates_rate"}
_PAPER = {"J_O_f", "J_O_tau"}
_FIELDS = {
    JOINTS: set(Joints._fields),
    OBJECT: {*Object._fields, "object_position", "object_rpy", *_PAPER},
    TIPS: set(Tips._fields),
    CONTACTS: set(Contacts._fields) - _ROLLING - _FRICTION,
    FRICTION: _FRICTION,
    ROLLING: _ROLLING,
    JACOBIANS: set(Jacobians._fields) - _PAPER,
    PAPER: _PAPER,
    SUPPORTS: set(Supports._fields),
    INTERNAL: set(Internal._fields),
}


def parts_of(fields: Iterable[str]) -> AnyArray:
    """Which parts these fields need: 1 at each of them, shape (10,)."""
    names = set(fields)
    return np.array([not names.isdisjoint(own) for own in _FIELDS.values()], dtype=np.int64)
