"""Kernels of the equations of motion, [Nakashima] Eqs. (46), (47)."""

from __future__ import annotations

import numpy as np

from softhand.numerics.branches import spared
from softhand.numerics.compiled import compiled
from softhand.numerics.linear import factor, solve


@compiled
def generalized_force(touch, nle, torque, external, out):
    """out = (torque + damping and stops, 0) + external - nle - J^T C_F.

    Args:
        touch: arrays of the contacts, `plant.Touch`, evaluated, and the torque of damping and stops.
        nle: C v + N, shape (nv,).
        torque: of the joints [N m, N], shape (n,).
        external: generalized force of pushes from outside, shape (nv,).
        out: set, shape (nv,).
    """
    for k in range(out.shape[0]):
        out[k] = external[k] - nle[k]
    for k in range(torque.shape[0]):
        out[k] += torque[k]
    for k in range(touch.resistance.force.shape[0]):
        out[k] += touch.resistance.force[k]
    for i in range(touch.contacts.shape[0]):
        if not spared(touch.contacts[i].is_idle > 0):
            add_contact_force(touch.columns[i], touch.jacobian[i], touch.contacts[i].force, out)
            add_contact_moment(touch.columns[i], touch.jacobian[i], touch.contacts[i].lean_elastic, out)


@compiled
def add_contact_force(columns, jacobian, force, out):
    """out -= J^T force of one contact: force [N] and torsion [N m] on the object in C_F, shape (4,)."""
    x, y, z, w = force[0], force[1], force[2], force[3]
    for a in range(columns.shape[0]):
        if columns[a] < 0:
            break
        row = jacobian[a]
        out[columns[a]] -= row[0] * x + row[1] * y + row[2] * z + row[3] * w


@compiled
def add_contact_moment(columns, jacobian, slope, out):
    """out -= J^T dU/dlean of one contact, whose law has a moment; slope [J], shape (2,), zero if it has none."""
    if jacobian.shape[1] == 4:
        return
    for a in range(columns.shape[0]):
        if columns[a] < 0:
            break
        out[columns[a]] -= jacobian[a, 4] * slope[0] + jacobian[a, 5] * slope[1]


@compiled
def copy_mass(M, envelope, mass):
    """Lower triangle of the symmetric `mass` inside its envelope from the upper triangle that Pinocchio fills."""
    for i in range(M.shape[0]):
        for j in range(envelope[i], i + 1):
            mass[i, j] = M[j, i]


@compiled
def accelerate(touch, terms, envelope, torque, external, mass, out):
    """out = M^-1 ((torque, 0) + external - nle - J^T C_F); `mass` is scratch, shape (nv, nv)."""
    generalized_force(touch, terms.nle, torque, external, out)
    copy_mass(terms.M, envelope, mass)
    if factor(mass, envelope) >= 0:
        out[:] = np.nan
    else:
        solve(mass, envelope, out)
