"""The linearised implicit midpoint rule: one evaluation a step, second order, stable for stiff tips."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softhand.compiled import compiled
from softhand.contact.kinematics import integrate_memory
from softhand.contact.layer import evaluate_contacts
from softhand.linear import factor, solve
from softhand.model.configuration import integrate
from softhand.plant import Plant, State, copy_mass, generalized_force
from softhand.steppers.stepper import Integration, Stepper


class Midpoint(Stepper):
    """Linearised implicit midpoint.

    With everything evaluated at q + (h/2) v and z + (h/2) z'(v), velocity terms at v + dv_previous / 2,

        (M + (h^2/4) J^T K J) dv = h {(tau, 0) - (C v + N) - J^T C_F},   J = [J_CF, -J_O]
        K = J_delta^-T (d dF / d delta) J_delta^-1, its symmetric part

    then q and z move for h with the mean velocity v + dv/2. No numerical damping. Use `adaptive` where the error
    must be known, and `rk4` where the torques change fast and the tips are soft.
    """

    def start(self, plant: Plant) -> Integration:
        """Ready to integrate this plant."""
        return _MidpointIntegration(plant, self.step)


class _MidpointIntegration(Integration):
    def __init__(self, plant: Plant, step: float) -> None:
        nv = plant.world.model.nv
        self._plant, self._step = plant, step
        self._q = np.zeros(plant.world.model.nq)
        self._v = np.zeros(nv)
        self._dv = np.zeros(nv)
        self._matrix = np.zeros((nv, nv))

    def advance(self, state: State, torque: NDArray[np.float64]) -> None:
        plant, snapshot = self._plant, self._plant.snapshot
        _predict(plant.joints, state.q, state.v, self._dv, self._step, self._q, self._v)
        snapshot.update(self._q, self._v)
        _advance(
            plant.pads,
            plant.columns,
            plant.joints,
            plant.envelope,
            snapshot.poses,
            snapshot.J,
            snapshot.M,
            snapshot.nle,
            torque,
            self._step,
            plant.contacts,
            plant.jacobian,
            self._matrix,
            self._dv,
            state.q,
            state.v,
            state.z,
        )


@compiled
def _predict(joints, q, v, dv, step, q_middle, v_middle):
    """q + (h/2) v and v + dv/2."""
    integrate(joints, q, v, 0.5 * step, q_middle)
    for k in range(v.shape[0]):
        v_middle[k] = v[k] + 0.5 * dv[k]


@compiled
def _advance(
    pads, columns, joints, envelope, poses, J, M, nle, torque, step, contacts, jacobian, matrix, dv, q, v, z
):  # fmt: skip
    """One step from the snapshot at the middle; dv is left for the next prediction."""
    evaluate_contacts(pads, columns, poses, J, v, z, 0.5 * step, True, contacts, jacobian)
    generalized_force(columns, contacts, jacobian, nle, torque, dv)
    copy_mass(M, envelope, matrix)
    _add_stiffness(columns, contacts, jacobian, 0.25 * step * step, matrix)
    if factor(matrix, envelope) >= 0:
        dv[:] = np.nan
    else:
        solve(matrix, envelope, dv)
    for k in range(v.shape[0]):
        dv[k] *= step
        v[k] += 0.5 * dv[k]
    integrate(joints, q, v, step, q)
    integrate_memory(columns, contacts, jacobian, v, step, z)
    for k in range(v.shape[0]):
        v[k] += 0.5 * dv[k]


@compiled
def _add_stiffness(columns, contacts, jacobian, weight, matrix):
    """Lower triangle of matrix += weight J^T K J, K symmetrised."""
    n = columns.shape[1]
    nv = matrix.shape[0]
    KJ = np.empty((4, n + 6))
    moved = np.empty(n + 6, np.int64)
    for i in range(contacts.shape[0]):
        K = contacts[i].stiffness
        count = 0
        for k in range(n):
            if columns[i, k] >= 0:
                moved[count] = columns[i, k]
                count += 1
        for column in range(nv - 6, nv):
            moved[count] = column
            count += 1
        for a in range(count):
            for row in range(4):
                KJ[row, a] = 0.0
                for k in range(4):
                    KJ[row, a] += 0.5 * (K[row, k] + K[k, row]) * jacobian[i, k, moved[a]]
        for a in range(count):
            for b in range(a + 1):
                value = 0.0
                for row in range(4):
                    value += jacobian[i, row, moved[a]] * KJ[row, b]
                matrix[moved[a], moved[b]] += weight * value
