"""Kernels from what is measured to an observation, as the software of a robot computes it.

Kinematics are those of the measured joints; the object is where it is measured; each contact lies on its tip where the
measured normal and compression say, and its force is turned there from the axes of the tip. So all that a controller
sees is of one grasp, though not of the true one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from softhand.contact.geometry import place_contact
from softhand.contact.kinematics import contact_jacobian, deformation_rate, relative_velocity
from softhand.contact.limit import limit_use, set_limit
from softhand.contact.scaled import traction
from softhand.model.configuration import CONTINUOUS
from softhand.model.coupled import Terms
from softhand.model.rigid import rigid_poses
from softhand.model.tree import Tree
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.quaternions import quaternion_of
from softhand.plant.plant import Touch
from softhand.sensing.measuring import measure
from softhand.sensing.sensor import describe


class Parts(NamedTuple):
    """All quantities, one behind the other in one array: views of it, see `quantities.QUANTITIES`."""

    joint_position: Array
    """Shape (n,)."""
    joint_velocity: Array
    """Shape (n,)."""
    object_position: Array
    """Shape (3,)."""
    object_orientation: Array
    """Shape (3, 3)."""
    object_velocity: Array
    """World axes, shape (3,)."""
    object_angular_velocity: Array
    """World axes, shape (3,)."""
    contact_force: Array
    """Axes of F, shape (nc, 3)."""
    contact_torsion: Array
    """Shape (nc,)."""
    contact_normal: Array
    """z_C in F, shape (nc, 3)."""
    contact_compression: Array
    """dr, shape (nc,)."""


class Observed(NamedTuple):
    """Fields of the true observation that tell what is measured."""

    joint_position: Array
    joint_velocity: Array
    object_coordinates: Array
    object_rotation: Array
    object_twist: Array
    tip_rotation: Array
    contact_rotation: Array
    contact_force: Array
    deformation: Array


class Seen(NamedTuple):
    """The grasp as it is measured, in memory of its own."""

    tree: Tree
    q: Array
    v: Array
    terms: Terms
    touch: Touch


@compiled
def gather(observed, truth):
    """What is true of each quantity.

    Args:
        observed: `Observed`.
        truth: `Parts`, set.
    """
    for k in range(truth.joint_position.shape[0]):
        truth.joint_position[k], truth.joint_velocity[k] = observed.joint_position[k], observed.joint_velocity[k]
    for k in range(3):
        truth.object_position[k] = observed.object_coordinates[k]
        truth.object_velocity[k] = observed.object_twist[k]
        truth.object_angular_velocity[k] = observed.object_twist[3 + k]
        for row in range(3):
            truth.object_orientation[row, k] = observed.object_rotation[row, k]
    for i in range(truth.contact_torsion.shape[0]):
        F, C, f = observed.tip_rotation[i], observed.contact_rotation[i], observed.contact_force[i]
        for k in range(3):
            force, normal = 0.0, 0.0
            for row in range(3):
                force += F[row, k] * (C[row, 0] * f[0] + C[row, 1] * f[1] + C[row, 2] * f[2])
                normal += F[row, k] * C[row, 2]
            truth.contact_force[i, k], truth.contact_normal[i, k] = force, normal
        truth.contact_torsion[i] = f[3]
        truth.contact_compression[i] = observed.deformation[i, 0]


@compiled
def see(body, joints, contacts, seen, measured, desired, groups, parts):
    """The observation that follows from what is measured.

    Args:
        body: `sensor.Body`, with scratch of its own.
        joints: as `World.joints`.
        contacts: those that there are, table `records.CONTACT`.
        seen: `Seen`, set.
        measured: `Parts`.
        desired: what the reference asks for now.
        groups: set, the fields of an observation by `GROUPS`.
        parts: which of them, see `groups.parts_of`.
    """
    q, v, touch, terms = seen.q, seen.v, seen.touch, seen.terms
    _place(joints, measured, q, v)
    rigid_poses(seen.tree, q, terms)
    poses, J = terms.poses, terms.J
    object_pose = poses[poses.shape[0] - 1]
    tips = measured.contact_torsion.shape[0]
    for i in range(contacts.shape[0]):
        touch.contacts[i] = contacts[i]
        if i < tips:
            pad, contact, columns, jacobian = touch.pads[i], touch.contacts[i], touch.columns[i], touch.jacobian[i]
            _place_tip(pad, poses[pad.joint], object_pose, measured, i, contact)
            contact_jacobian(pad, contact, columns, J, jacobian)
            if pad.slope_function != 0:  # which nothing measures
                contact.moment[:] = math.nan
            relative_velocity(columns, jacobian, v, contact.velocity)
            deformation_rate(contact, contact.velocity, contact.deformation_rate)
            set_limit(pad, contact)
            contact.limit_surface_use = limit_use(contact, traction(contact), contact.friction * contact.force[2])
    describe(body, touch, terms, desired, q, v, groups, parts)


@compiled
def see_measured(observed, truth, chain, measured, period, body, joints, contacts, seen, desired, groups, parts):
    """All in one: what is true, what is measured of it, what a controller sees of that.

    Args:
        observed: as in `gather`.
        truth: `Parts` of `Chain.truth`.
        chain: `measuring.Chain`.
        measured: `Parts` of `Chain.measured`.
        period: number of the control period, its first number.
        body: as in `see`, like all that follow.
        joints: likewise.
        contacts: likewise.
        seen: likewise.
        desired: likewise.
        groups: likewise.
        parts: likewise.
    """
    gather(observed, truth)
    measure(chain, period[0])
    see(body, joints, contacts, seen, measured, desired, groups, parts)


@compiled
def _place(joints, measured, q, v):
    """Configuration and velocity of the rigid bodies."""
    n, R = measured.joint_position.shape[0], measured.object_orientation
    for k in range(n):
        i, angle = joints[k, 1], measured.joint_position[k]
        v[joints[k, 2]] = measured.joint_velocity[k]
        if joints[k, 0] == CONTINUOUS:
            q[i], q[i + 1] = math.cos(angle), math.sin(angle)
        else:
            q[i] = angle
    i, j = joints[n, 1], joints[n, 2]
    q[i + 3], q[i + 4], q[i + 5], q[i + 6] = quaternion_of(R)
    for k in range(3):
        q[i + k], linear, angular = measured.object_position[k], 0.0, 0.0
        for row in range(3):
            linear += R[row, k] * measured.object_velocity[row]
            angular += R[row, k] * measured.object_angular_velocity[row]
        v[j + k], v[j + 3 + k] = linear, angular


@compiled
def _place_tip(pad, pose, object_pose, measured, i, contact):
    """Frame, point, force and compression of a contact where it is measured on its tip."""
    n, f = measured.contact_normal[i], measured.contact_force[i]
    force = contact.force
    x, y, z = 0.0, 0.0, 0.0
    for row in range(3):
        tip, normal = pose[9 + row], 0.0
        for k in range(3):
            axis = (
                pose[row] * pad.rotation[0, k] + pose[3 + row] * pad.rotation[1, k] + pose[6 + row] * pad.rotation[2, k]
            )
            normal += axis * n[k]
            tip += pose[3 * k + row] * pad.position[k]
        contact.tip[row], contact.rotation[row, 2] = tip, normal
    for k in range(3):
        contact.normal[k] = 0.0
        for row in range(3):
            contact.normal[k] -= object_pose[3 * k + row] * contact.rotation[row, 2]
    contact.distance = pad.radius - measured.contact_compression[i]
    place_contact(pad, pose, object_pose, contact)
    for row in range(3):
        there = 0.0
        for k in range(3):
            axis = (
                pose[row] * pad.rotation[0, k] + pose[3 + row] * pad.rotation[1, k] + pose[6 + row] * pad.rotation[2, k]
            )
            there += axis * f[k]
        x += contact.rotation[row, 0] * there
        y += contact.rotation[row, 1] * there
        z += contact.rotation[row, 2] * there
    force[0], force[1], force[2], force[3] = x, y, z, measured.contact_torsion[i]
    contact.deformation[0] = measured.contact_compression[i]
