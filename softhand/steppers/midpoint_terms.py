"""The linear equations of a midpoint step: matrix, right-hand side, and what of them belongs to the contacts."""

from __future__ import annotations

import numpy as np

from softhand.contact.kinematics import relative_velocity
from softhand.numerics.branches import spared, usually
from softhand.numerics.compiled import compiled
from softhand.numerics.linear import factor, solve
from softhand.plant.dynamics import add_contact_force, copy_mass, generalized_force
from softhand.plant.resistance import add_slopes


@compiled
def factor_matrix(touch, M, envelope, step, matrix):
    """Factor of M + (h/2) J^T D J + (h^2/4) J^T K J, joints included; NaN if it is not positive definite."""
    copy_mass(M, envelope, matrix)
    add_slopes(touch.resistance, step, matrix)
    for i in range(touch.contacts.shape[0]):
        if not spared(touch.contacts[i].is_idle > 0):
            add_stiffness(touch.columns[i], touch.contacts[i], touch.jacobian[i], step, matrix)
    if factor(matrix, envelope) >= 0:
        matrix[:] = np.nan


@compiled
def acceleration_of(touch, nle, envelope, torque, external, pull, matrix, acceleration):
    """a of a kick: matrix^-1 {(tau, 0) + external - (C v + N) - J^T (C_F + pull)}."""
    generalized_force(touch, nle, torque, external, acceleration)
    for i in range(touch.contacts.shape[0]):
        if not spared(touch.contacts[i].is_idle > 0):
            add_contact_force(touch.columns[i], touch.jacobian[i], pull[i], acceleration)
    solve(matrix, envelope, acceleration)


@compiled
def lag_of(touch, envelope, matrix, step, v, lag):
    """-(h^2/6) matrix^-1 J^T K J v: what w lies above v at the begin, with the velocities of the contacts at v."""
    lag[:] = 0.0
    force = np.empty(4)
    for i in range(touch.contacts.shape[0]):
        if not spared(touch.contacts[i].is_idle > 0):
            add_lag(touch.columns[i], touch.contacts[i], touch.jacobian[i], step, force, lag)
    for k in range(touch.resistance.force.shape[0]):
        lag[k] -= step * step / 6.0 * touch.resistance.spring[k] * v[k]
    solve(matrix, envelope, lag)


@compiled
def add_lag(columns, contact, jacobian, step, force, lag):
    """lag -= (h^2/6) J^T K J v of one contact; `force` is scratch, shape (4,)."""
    K, u = contact.stiffness, contact.velocity
    for k in range(4):
        force[k] = step * step / 6.0 * (K[k, 0] * u[0] + K[k, 1] * u[1] + K[k, 2] * u[2] + K[k, 3] * u[3])
    add_contact_force(columns, jacobian, force, lag)


@compiled
def undamped_ahead(touch, envelope, step, matrix, change, acceleration):
    """The first kick damps with the velocity before it; (h/2) D of the matrix is meant for that after it.

    Takes -(h/2) J^T D J a, as solved, to the acceleration; `change` is scratch, shape (nv,).
    """
    change[:] = 0.0
    force = np.empty(4)
    for i in range(touch.contacts.shape[0]):
        if not spared(touch.contacts[i].is_idle > 0):
            add_undamped(touch.columns[i], touch.contacts[i], touch.jacobian[i], step, acceleration, force, change)
    for k in range(touch.resistance.force.shape[0]):
        change[k] += 0.5 * step * touch.resistance.rate[k] * acceleration[k]
    solve(matrix, envelope, change)
    for k in range(change.shape[0]):
        acceleration[k] += change[k]


@compiled
def add_undamped(columns, contact, jacobian, step, acceleration, force, change):
    """change += (h/2) J^T D J a of one contact; `force` is scratch, shape (4,)."""
    relative_velocity(columns, jacobian, acceleration, force)
    for k in range(4):
        force[k] *= -0.5 * step * contact.damping[k]
    add_contact_force(columns, jacobian, force, change)


@compiled
def pull_of(contact, weight, rate, depth, pull):
    """pull = weight K J_delta (delta' now - rate): what the change of J within the step does to the contact force.

    Beside it half of what it does to the viscous force along z, which is taken at the mean rate of the step.

    Zero for a contact that did not touch before the step, where `depth` is NaN.
    """
    if not usually(depth == depth):
        pull[:] = 0.0
        return
    change = contact.deformation_rate
    x = (change[1] - rate[1]) / contact.theta_per_x
    y = (change[2] - rate[2]) / contact.phi_per_y
    z = change[0] - rate[0]
    w = change[3] - rate[3] - contact.psi_per_x * x
    K = contact.stiffness
    for k in range(4):
        pull[k] = weight * (K[k, 0] * x + K[k, 1] * y + K[k, 2] * z + K[k, 3] * w)
    pull[2] += 0.5 * contact.damping[2] * z


@compiled
def add_stiffness(columns, contact, jacobian, step, matrix):
    """Lower triangle of matrix += (h/2) J^T D J + (h^2/4) J^T K J of one contact, K symmetrised."""
    weight, per_step = 0.25 * step * step, 2.0 / step
    K, D = contact.stiffness, contact.damping
    xx, yy = K[0, 0] + per_step * D[0], K[1, 1] + per_step * D[1]
    zz, ww = K[2, 2] + per_step * D[2], K[3, 3] + per_step * D[3]
    xy, xz, xw = 0.5 * (K[0, 1] + K[1, 0]), 0.5 * (K[0, 2] + K[2, 0]), 0.5 * (K[0, 3] + K[3, 0])
    yz, yw, zw = 0.5 * (K[1, 2] + K[2, 1]), 0.5 * (K[1, 3] + K[3, 1]), 0.5 * (K[2, 3] + K[3, 2])
    for b in range(columns.shape[0]):
        column = columns[b]
        if column < 0:
            break
        x, y, z, w = jacobian[b, 0], jacobian[b, 1], jacobian[b, 2], jacobian[b, 3]
        fx = weight * (xx * x + xy * y + xz * z + xw * w)
        fy = weight * (xy * x + yy * y + yz * z + yw * w)
        fz = weight * (xz * x + yz * y + zz * z + zw * w)
        fw = weight * (xw * x + yw * y + zw * z + ww * w)
        for a in range(b, columns.shape[0]):
            row = columns[a]
            if row < 0:
                break
            J = jacobian[a]
            matrix[row, column] += J[0] * fx + J[1] * fy + J[2] * fz + J[3] * fw
    if jacobian.shape[1] > 4:
        _add_rolling(columns, contact, jacobian, weight, matrix)


@compiled
def _add_rolling(columns, contact, jacobian, weight, matrix):
    """Lower triangle of matrix += (h^2/4) J^T `rolling` J, J columns 4 and 5: `roll_stiffness`, `bend_stiffness`."""
    B = contact.leaning
    xx, xy, yy = weight * contact.rolling[0], weight * contact.rolling[1], weight * contact.rolling[2]
    for b in range(columns.shape[0]):
        if columns[b] < 0:
            break
        J, x, y = jacobian[b], jacobian[b, 4], jacobian[b, 5]
        fx, fy = xx * x + xy * y, xy * x + yy * y
        for k in range(4):
            fx += weight * B[k, 0] * J[k]
            fy += weight * B[k, 1] * J[k]
        f0, f1 = weight * (B[0, 0] * x + B[0, 1] * y), weight * (B[1, 0] * x + B[1, 1] * y)
        f2, f3 = weight * (B[2, 0] * x + B[2, 1] * y), weight * (B[3, 0] * x + B[3, 1] * y)
        for a in range(b, columns.shape[0]):
            if columns[a] < 0:
                break
            J = jacobian[a]
            matrix[columns[a], columns[b]] += J[4] * fx + J[5] * fy + J[0] * f0 + J[1] * f1 + J[2] * f2 + J[3] * f3


@compiled
def take_stiffness(columns, contact, jacobian, step, x, out):
    """out -= what `add_stiffness` adds to the matrix, times x, without the matrix."""
    weight, per_step = 0.25 * step * step, 2.0 / step
    K, D = contact.stiffness, contact.damping
    y, force = np.empty(4), np.empty(4)
    relative_velocity(columns, jacobian, x, y)
    for k in range(4):
        force[k] = weight * per_step * D[k] * y[k]
        for j in range(4):
            force[k] += weight * 0.5 * (K[k, j] + K[j, k]) * y[j]
    add_contact_force(columns, jacobian, force, out)
    if jacobian.shape[1] > 4:
        _take_rolling(columns, contact, jacobian, weight, x, y, out)


@compiled
def _take_rolling(columns, contact, jacobian, weight, x, y, out):
    """out -= (h^2/4) J^T `rolling` J x, likewise."""
    about_x, about_y = 0.0, 0.0
    for a in range(columns.shape[0]):
        if columns[a] < 0:
            break
        about_x += jacobian[a, 4] * x[columns[a]]
        about_y += jacobian[a, 5] * x[columns[a]]
    rolling, B = contact.rolling, contact.leaning
    moment_x = weight * (rolling[0] * about_x + rolling[1] * about_y)
    moment_y = weight * (rolling[1] * about_x + rolling[2] * about_y)
    for k in range(4):
        moment_x += weight * B[k, 0] * y[k]
        moment_y += weight * B[k, 1] * y[k]
        y[k] = weight * (B[k, 0] * about_x + B[k, 1] * about_y)
    add_contact_force(columns, jacobian, y, out)
    for a in range(columns.shape[0]):
        if columns[a] < 0:
            break
        out[columns[a]] -= jacobian[a, 4] * moment_x + jacobian[a, 5] * moment_y
