"""The parts of a control period of one midpoint step, followed one by one: rigid bodies, contacts, pushes, the drift.

The accelerations of a step are solutions of linear equations, A a = r. A part does not solve them: with a as found it
gives its share of r - A a, of which the derivatives, dr - dA a, are all that A^-1 has to be put in front of. So a part
depends on a few numbers alone, and nothing goes through the factor of a matrix.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from softhand.contact.damping import press, relax_contact
from softhand.contact.friction import note_slip_of
from softhand.contact.geometry import find_nearest
from softhand.contact.kinematics import deformation_rate, relative_velocity
from softhand.contact.layer import evaluate_contact
from softhand.model.configuration import integrate
from softhand.model.rigid import branch_terms
from softhand.numerics.arrays import Array
from softhand.numerics.symbols import REAL, WHOLE, Symbol
from softhand.plant.dynamics import add_contact_force, add_contact_moment
from softhand.simulation.pushes import add_pushes
from softhand.steppers.midpoint import meet_contact
from softhand.steppers.midpoint_terms import add_lag, add_undamped, take_stiffness


class Found(NamedTuple):
    """What the step found on its way, each shape (nv,) but q."""

    lag: Array
    """What w lies above v at the begin."""
    first: Array
    """Acceleration of the first kick, before `undamped_ahead`."""
    begun: Array
    """The same, as what `change` follows from."""
    change: Array
    """What `undamped_ahead` adds."""
    middle: Array
    """w between the kicks."""
    ahead: Array
    """Where C v of the second kick is taken."""
    q: Array
    """Configuration at the end, shape (nq,)."""
    second: Array
    """Acceleration of the second kick."""


class Rest(NamedTuple):
    """r - A a of the four equations, each shape (nv,)."""

    lag: Array
    first: Array
    change: Array
    second: Array


def branch_part(tree, first, last, velocities, envelope, terms, base, found):
    """Rigid bodies of one branch of the tree: `Rest` of its velocities."""
    rest = _no_rest(found)
    branch_terms(tree, first, last, base.q, base.v, terms)
    for i in velocities:
        rest.first[i] -= terms.nle[i]
        for j in velocities:
            if j >= envelope[i] and i >= envelope[j]:
                M = terms.M[min(i, j), max(i, j)]
                rest.lag[i] -= M * found.lag[j]
                rest.first[i] -= M * found.first[j]
                rest.change[i] -= M * found.change[j]
    branch_terms(tree, first, last, found.q, found.ahead, terms)
    for i in velocities:
        rest.second[i] -= terms.nle[i]
        for j in velocities:
            if j >= envelope[i] and i >= envelope[j]:
                rest.second[i] -= terms.M[min(i, j), max(i, j)] * found.second[j]
    return rest


def contact_part(i, tree, branches, touch, terms, kicks, step, base, found):
    """One contact, and the branches of the tree that it depends on: `Rest`; its row of z is set."""
    pad, columns, contact, jacobian = touch.pads[i], touch.columns[i], touch.contacts[i], touch.jacobian[i]
    memory, rest, force = base.z[i], _no_rest(found), np.empty(4)
    clear(contact)
    for first, last in branches:
        branch_terms(tree, first, last, base.q, base.v, terms)
    # where the period begins, as `start_step`
    evaluate_contact(pad, columns, terms.poses, terms.J, base.v, memory, 0.0, touch.depths[i], True, contact, jacobian)
    note_slip_of(pad, contact, memory, 0.0)
    if not contact.is_idle > 0:
        add_lag(columns, contact, jacobian, step, force, rest.lag)
        take_stiffness(columns, contact, jacobian, step, found.lag, rest.lag)
        add_contact_force(columns, jacobian, contact.force, rest.first)
        add_contact_moment(columns, jacobian, contact.lean_elastic, rest.first)
        take_stiffness(columns, contact, jacobian, step, found.first, rest.first)
        add_undamped(columns, contact, jacobian, step, found.begun, force, rest.change)
        take_stiffness(columns, contact, jacobian, step, found.change, rest.change)
    # the drift, as `kick_drift`; the viscous forces at its velocity are not asked for
    relax_contact(pad, contact, 0.5 * step, memory)
    if not contact.is_idle > 0:
        relative_velocity(columns, jacobian, found.middle, contact.velocity)
        deformation_rate(contact, contact.velocity, contact.deformation_rate)
        for k in range(3):
            memory[k] += 0.5 * step * contact.deformation_rate[1 + k]
    # where it ends; in place of a matrix its product with a
    for first, last in branches:
        branch_terms(tree, first, last, found.q, found.ahead, terms)
    matrix = found.second, rest.second
    own = kicks._replace(middle=found.middle, acceleration=rest.second, matrix=matrix)
    meet_contact(i, touch, terms, own, step, base.z)
    return rest


def clear(contact):
    """All zero, which is how the contacts of a period begin."""
    raise NotImplementedError("has a meaning on symbols alone")


def cleared(followed, contact):
    """That meaning."""
    sums, memory, begin, dtype, _ = contact._parts
    for name in dtype.names:
        kind, offset = dtype.fields[name][:2]
        is_real = kind.base.kind == "f"
        for at in range(begin + offset, begin + offset + kind.itemsize, 8):
            sums.write(REAL if is_real else WHOLE, (memory, at), 0)


def watched(function):
    """The meaning of a function that says on which side of a switch a contact is: what it compares is noted."""

    def meaning(followed, *arguments):
        sums = followed.sums
        first = len(sums.steps)
        result = followed.on_symbols(function)(*arguments)
        for word, *rest in sums.steps[first:]:
            if word == "fcmp" and rest[0] in _ORDERED and (isinstance(rest[2], Symbol) or math.isfinite(rest[2])):
                followed.notes.append(rest[1] - rest[2])
        return result

    return meaning


_ORDERED = ("ogt", "olt", "oge", "ole")


def placed(followed, pad, pose, base_pose, contact):
    """`find_nearest`, watched, and the depth."""
    watched(find_nearest)(followed, pad, pose, base_pose, contact)
    followed.notes.append(pad.radius - contact.distance)


SWITCHES = {find_nearest: placed, press: watched(press)}
"""Meanings of functions that decide on which side a contact is: apart or touching, where on the object, slipping."""


def product_in_place_of_matrix(followed, columns, contact, jacobian, step, matrix):
    """`add_stiffness` where the matrix is a pair of a solution and of its `Rest`."""
    followed.on_symbols(take_stiffness)(columns, contact, jacobian, step, *matrix)


def push_part(tree, branches, terms, base, pushes, time, external):
    """Generalized force of the pushes, shape (nv,)."""
    for first, last in branches:
        branch_terms(tree, first, last, base.q, base.v, terms)
    for k in range(external.shape[0]):
        external[k] = 0.0
    add_pushes(pushes, time[0], terms.poses, terms.J, external)


def drift_part(joints, base, found, step, q):
    """The configuration at the end, shape (nq,)."""
    integrate(joints, base.q, found.middle, step, q)


def _no_rest(found):
    nv = found.lag.shape[0]
    return Rest(np.zeros(nv), np.zeros(nv), np.zeros(nv), np.zeros(nv))
