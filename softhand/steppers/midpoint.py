"""The linearised implicit midpoint rule: one evaluation a step, second order, stable for stiff tips."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from softhand.contact.damping import relax
from softhand.contact.friction import note_slip
from softhand.contact.kinematics import integrate_memory, relative_velocity
from softhand.contact.layer import evaluate_contacts
from softhand.model.configuration import integrate
from softhand.numerics.compiled import compiled
from softhand.numerics.linear import factor, solve
from softhand.numerics.prepared import prepared
from softhand.plant.dynamics import add_contact_force, copy_mass, generalized_force
from softhand.plant.plant import Plant
from softhand.plant.state import State, is_at, set_at
from softhand.steppers.stepper import Integration, Stepper


class Midpoint(Stepper):
    """Linearised implicit midpoint, as kick, drift, kick.

        kick    w = w + (h/2) a,   J = [J_CF, -J_O]
                (M + (h/2) J^T D J + (h^2/4) J^T K J) a = (tau, 0) - (C v + N) - J^T {C_F + (h^2/4) K J' w}
        drift   q and z moved by w for h, the contact frames of z averaged over both ends
        kick    as before, at the new q and z, with the same torque
        v       w before the second kick + (h/6) (a of the first kick + 2 a of the second)

    with K = J_delta^-T (d dF / d delta) J_delta^-1, its symmetric part, and D = d C_F / d velocity of the damping;
    J a + J' w is the acceleration of the contact.
    The two kicks at one instant share one evaluation, which the controller sees as well. For a linear system q is that
    of the implicit midpoint rule (Newmark's method with beta = 1/4): no numerical damping, and no step is too long. v
    is that of an acceleration which grows evenly within the step. Use `adaptive` where the error must be known, and
    `rk4` where the torques change fast and the tips are soft.
    """

    def start(self, plant: Plant) -> Integration:
        """Ready to integrate this plant."""
        return _MidpointIntegration(plant, self.step)


class _MidpointIntegration(Integration):
    """Each step ends with the plant evaluated at the new state, so that the sensor need not do it again."""

    def __init__(self, plant: Plant, step: float) -> None:
        super().__init__(plant)
        nv = plant.world.model.nv
        self._plant, self._step = plant, step
        self._velocity = np.zeros((4, nv))  # w; in the middle of the step; expected at its end; see `_begin`
        self._acceleration, self._matrix = np.zeros(nv), np.zeros((nv, nv))
        self._turning = np.zeros((2, len(plant.contacts), 4))  # J' w: before the drift; (h^2/4) K J' w
        self._held = np.zeros_like(self.torque)
        self._state: State | None = None

    def advance(self, state: State, torque: NDArray[np.float64]) -> None:
        if state is not self._state:
            self._prepare(state)
        if torque is not self.torque:
            self.torque[:] = torque
        if not self._leave():  # the state is not where the last step left it
            self._plant.snapshot.update(state.q, state.v)
            self._begin()
            self._leave()
        self._mass()
        self._velocity_terms()
        self._arrive()

    def restart(self) -> None:
        self._held[:] = np.nan
        self._velocity[:] = np.nan

    def _prepare(self, state: State) -> None:
        plant, snapshot, step, q, v, z = self._plant, self._plant.snapshot, self._step, state.q, state.v, state.z
        contacts = plant.columns, plant.contacts, plant.contact_columns
        geometry = plant.pads, plant.envelope, snapshot.poses, snapshot.J, snapshot.M
        force = snapshot.nle, self.torque
        memory = self._velocity, self._acceleration, self._matrix, self._turning, self._held, plant.at
        self._state = state
        self._mass, self._velocity_terms = snapshot.updates(q, self._velocity[2])
        self._begin = prepared(_begin, *geometry, *contacts, *memory, step, q, v, z)
        self._leave = prepared(
            _leave, plant.pads, plant.joints, plant.envelope, *force, *contacts, *memory, step, q, v, z
        )
        self._arrive = prepared(_arrive, *geometry, *force, *contacts, *memory, step, q, v, z)


@compiled
def _begin(
    pads, envelope, poses, J, M, columns, contacts, jacobian, velocity, acceleration, matrix, turning, held, at, step,
    q, v, z,
):  # fmt: skip
    """The first step from a state: contacts and matrix there, and the w that belongs to v.

    The acceleration will change within the step by about -M^-1 J^T K J v h, so w = v - (h^2/6) M^-1 J^T K J v. What w
    is lower than v is kept, so that the end of the step can settle the rest.
    """
    evaluate_contacts(pads, columns, poses, J, v, z, 0.0, True, contacts, jacobian)
    note_slip(pads, contacts, z)
    _factor_matrix(M, envelope, columns, contacts, jacobian, step, matrix)
    w, lower = velocity[0], velocity[3]
    w[:] = 0.0
    for i in range(contacts.shape[0]):
        if contacts[i].is_idle:
            continue
        K, u, force = contacts[i].stiffness, contacts[i].velocity, turning[1, i]
        for k in range(4):
            force[k] = step * step / 6.0 * (K[k, 0] * u[0] + K[k, 1] * u[1] + K[k, 2] * u[2] + K[k, 3] * u[3])
        add_contact_force(columns[i], jacobian[i], force, w)
    solve(matrix, envelope, w)
    for k in range(v.shape[0]):
        lower[k] = -w[k]
        w[k] += v[k]
    turning[:] = 0.0
    held[:] = np.nan
    set_at(q, v, z, at)


@compiled
def _leave(
    pads, joints, envelope, nle, torque, columns, contacts, jacobian, velocity, acceleration, matrix, turning, held,
    at, step, q, v, z,
):  # fmt: skip
    """First kick and drift; False if the plant was not evaluated at this state by the step before."""
    if not (is_at(q, v, z, at) and velocity[0, 0] == velocity[0, 0]):
        return False
    w, middle, ahead = velocity[0], velocity[1], velocity[2]
    if held[0] != held[0]:
        _accelerate(envelope, nle, torque, columns, contacts, jacobian, turning[1], matrix, acceleration)
        _without_damping_ahead(envelope, columns, contacts, jacobian, step, matrix, turning, ahead, acceleration)
    else:
        _add_torque(envelope, torque, held, matrix, ahead, acceleration)
    held[:] = torque
    for k in range(v.shape[0]):
        middle[k] = w[k] + 0.5 * step * acceleration[k]
        ahead[k] = middle[k] + 0.5 * step * acceleration[k]
    relax(pads, contacts, 0.5 * step, z)
    integrate_memory(columns, contacts, jacobian, middle, 0.5 * step, z)
    integrate(joints, q, middle, step, q)
    return True


@compiled
def _arrive(
    pads, envelope, poses, J, M, nle, torque, columns, contacts, jacobian, velocity, acceleration, matrix, turning,
    held, at, step, q, v, z,
):  # fmt: skip
    """Contacts and matrix at the new state, and the second kick."""
    w, middle, lower = velocity[0], velocity[1], velocity[3]
    for i in range(contacts.shape[0]):
        for k in range(4):
            turning[0, i, k] = contacts[i].deformation_rate[k] if not contacts[i].is_idle else math.nan
    evaluate_contacts(pads, columns, poses, J, middle, z, 0.5 * step, True, contacts, jacobian)
    for i in range(contacts.shape[0]):
        for k in range(3):
            z[i, k] = contacts[i].deformation[1 + k]
        if not contacts[i].is_idle:
            _turn(contacts[i], 0.25 * step, turning[0, i], turning[1, i])
    note_slip(pads, contacts, z)
    relax(pads, contacts, 0.5 * step, z)
    _factor_matrix(M, envelope, columns, contacts, jacobian, step, matrix)
    was_first = lower[0] == lower[0]
    for k in range(v.shape[0]):
        v[k] = middle[k] + step / 6.0 * acceleration[k]
        lower[k] -= step / 6.0 * acceleration[k]
    _accelerate(envelope, nle, torque, columns, contacts, jacobian, turning[1], matrix, acceleration)
    for k in range(v.shape[0]):
        missing = lower[k] + step / 6.0 * acceleration[k] if was_first else 0.0
        v[k] += step / 3.0 * acceleration[k] + missing
        w[k] = middle[k] + 0.5 * step * acceleration[k] + missing
    lower[:] = math.nan
    set_at(q, v, z, at)


@compiled
def _turn(contact, weight, rate, force):
    """force = weight K J_delta (delta' now - rate): what the change of J within the step does to the contact force.

    Zero for a support that did not touch before the step, whose rate is NaN.
    """
    if rate[0] != rate[0]:
        force[:] = 0.0
        return
    change = contact.deformation_rate
    x = (change[1] - rate[1]) / contact.theta_per_x
    y = (change[2] - rate[2]) / contact.phi_per_y
    z = change[0] - rate[0]
    w = change[3] - rate[3] - contact.psi_per_x * x
    K = contact.stiffness
    for k in range(4):
        force[k] = weight * (K[k, 0] * x + K[k, 1] * y + K[k, 2] * z + K[k, 3] * w)


@compiled
def _factor_matrix(M, envelope, columns, contacts, jacobian, step, matrix):
    """Factor of M + (h/2) J^T D J + (h^2/4) J^T K J; NaN if it is not positive definite."""
    copy_mass(M, envelope, matrix)
    _add_stiffness(columns, contacts, jacobian, step, matrix)
    if factor(matrix, envelope) >= 0:
        matrix[:] = np.nan


@compiled
def _without_damping_ahead(envelope, columns, contacts, jacobian, step, matrix, turning, change, acceleration):
    """The first kick damps with the velocity before it; (h/2) D of the matrix is meant for that after it."""
    change[:] = 0.0
    for i in range(contacts.shape[0]):
        if contacts[i].is_idle:
            continue
        force = turning[0, i]
        relative_velocity(columns[i], jacobian[i], acceleration, force)
        for k in range(4):
            force[k] *= -0.5 * step * contacts[i].damping[k]
        add_contact_force(columns[i], jacobian[i], force, change)
    solve(matrix, envelope, change)
    for k in range(change.shape[0]):
        acceleration[k] += change[k]


@compiled
def _add_torque(envelope, torque, held, matrix, change, acceleration):
    """What another torque than the one held before adds to the acceleration; `change` is scratch."""
    same = True
    for k in range(change.shape[0]):
        change[k] = torque[k] - held[k] if k < torque.shape[0] else 0.0
        same = same and change[k] == 0.0
    if not same:
        solve(matrix, envelope, change)
        for k in range(change.shape[0]):
            acceleration[k] += change[k]


@compiled
def _accelerate(envelope, nle, torque, columns, contacts, jacobian, extra, matrix, acceleration):
    generalized_force(columns, contacts, jacobian, nle, torque, acceleration)
    for i in range(contacts.shape[0]):
        if not contacts[i].is_idle:
            add_contact_force(columns[i], jacobian[i], extra[i], acceleration)
    solve(matrix, envelope, acceleration)


@compiled
def _add_stiffness(columns, contacts, jacobian, step, matrix):
    """Lower triangle of matrix += (h/2) J^T D J + (h^2/4) J^T K J, K symmetrised."""
    weight, per_step = 0.25 * step * step, 2.0 / step
    for i in range(contacts.shape[0]):
        if contacts[i].is_idle:
            continue
        K, D = contacts[i].stiffness, contacts[i].damping
        xx, yy = K[0, 0] + per_step * D[0], K[1, 1] + per_step * D[1]
        zz, ww = K[2, 2] + per_step * D[2], K[3, 3] + per_step * D[3]
        xy, xz, xw = 0.5 * (K[0, 1] + K[1, 0]), 0.5 * (K[0, 2] + K[2, 0]), 0.5 * (K[0, 3] + K[3, 0])
        yz, yw, zw = 0.5 * (K[1, 2] + K[2, 1]), 0.5 * (K[1, 3] + K[3, 1]), 0.5 * (K[2, 3] + K[3, 2])
        for b in range(columns.shape[1]):
            column = columns[i, b]
            if column < 0:
                break
            x, y, z, w = jacobian[i, b, 0], jacobian[i, b, 1], jacobian[i, b, 2], jacobian[i, b, 3]
            fx = weight * (xx * x + xy * y + xz * z + xw * w)
            fy = weight * (xy * x + yy * y + yz * z + yw * w)
            fz = weight * (xz * x + yz * y + zz * z + zw * w)
            fw = weight * (xw * x + yw * y + zw * z + ww * w)
            for a in range(b, columns.shape[1]):
                row = columns[i, a]
                if row < 0:
                    break
                J = jacobian[i, a]
                matrix[row, column] += J[0] * fx + J[1] * fy + J[2] * fz + J[3] * fw
