"""The fields of an observation in groups, as the kernels of the sensor take them."""

from __future__ import annotations

from typing import NamedTuple

from softhand.numerics.arrays import Array


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


GROUPS = (Joints, Object, Tips, Contacts, Jacobians, Supports, Internal, Asked)
