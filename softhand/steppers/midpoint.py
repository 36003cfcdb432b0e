"""The linearised implicit midpoint rule: one evaluation a step, second order, stable for stiff tips."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softhand.compiled import compiled, prepared
from softhand.contact.damping import relax
from softhand.contact.kinematics import integrate_memory
from softhand.contact.layer import evaluate_contacts
from softhand.linear import factor, solve
from softhand.model.configuration import integrate
from softhand.plant import Plant, State, copy_mass, generalized_force
from softhand.steppers.stepper import Integration, Stepper


class Midpoint(Stepper):
    """Linearised implicit midpoint.

    With everything evaluated at q + (h/2) v and z + (h/2) z'(v), velocity terms at v + dv_previous / 2,

        (M + (h/2) J^T D J + (h^2/4) J^T K J) dv = h {(tau, 0) - (C v + N) - J^T C_F},   J = [J_CF, -J_O]
        K = J_delta^-T (d dF / d delta) J_delta^-1, its symmetric part;  D = d C_F / d velocity, of the damping

    then q and z move for h with the mean velocity v + dv/2. No numerical damping. Use `adaptive` where the error
    must be known, and `rk4` where the torques change fast and the tips are soft.
    """

    def start(self, plant: Plant) -> Integration:
        """Ready to integrate this plant."""
        return _MidpointIntegration(plant, self.step)


class _MidpointIntegration(Integration):
    """Each step ends with the prediction of the next middle: a step is two calls of Pinocchio and one kernel."""

    def __init__(self, plant: Plant, step: float) -> None:
        super().__init__(plant)
        nq, nv = plant.world.model.nq, plant.world.model.nv
        self._plant, self._step = plant, step
        self._dv, self._matrix = np.zeros(nv), np.zeros((nv, nv))
        self._ahead = np.full(2 * (nq + nv), np.nan)  # q and v in the middle of the next step, then at its start
        middle = self._ahead[:nq], self._ahead[nq : nq + nv]
        self._mass, self._velocity_terms = plant.snapshot.updates(*middle)
        self._state: State | None = None

    def advance(self, state: State, torque: NDArray[np.float64]) -> None:
        if state is not self._state:
            self._prepare(state)
        if torque is not self.torque:
            self.torque[:] = torque
        self._mass()
        self._velocity_terms()
        if not self._move():  # the state is not where the last step left it
            self._predict()
            self._mass()
            self._velocity_terms()
            self._move()

    def restart(self) -> None:
        self._dv[:] = 0.0
        self._ahead[:] = np.nan

    def _prepare(self, state: State) -> None:
        plant, snapshot, q, v = self._plant, self._plant.snapshot, state.q, state.v
        self._state = state
        self._predict = prepared(_predict, plant.joints, q, v, self._dv, self._step, self._ahead)
        self._move = prepared(
            _move, plant.pads, plant.columns, plant.joints, plant.envelope, snapshot.poses, snapshot.J, snapshot.M,
            snapshot.nle, self.torque, self._step, plant.contacts, plant.contact_columns, self._matrix, self._dv,
            self._ahead, q, v, state.z,
        )  # fmt: skip


@compiled
def _predict(joints, q, v, dv, step, ahead):
    """ahead = (q + (h/2) v, v + dv/2, q, v)."""
    nq, nv = q.shape[0], v.shape[0]
    integrate(joints, q, v, 0.5 * step, ahead[:nq])
    for k in range(nv):
        ahead[nq + k] = v[k] + 0.5 * dv[k]
        ahead[2 * nq + nv + k] = v[k]
    for k in range(nq):
        ahead[nq + nv + k] = q[k]


@compiled
def _is_predicted(q, v, ahead):
    """Whether the middle in `ahead` belongs to this state."""
    nq, nv = q.shape[0], v.shape[0]
    same = True
    for k in range(nq):
        same = same and ahead[nq + nv + k] == q[k]
    for k in range(nv):
        same = same and ahead[2 * nq + nv + k] == v[k]
    return same


@compiled
def _move(
    pads, columns, joints, envelope, poses, J, M, nle, torque, step, contacts, jacobian, matrix, dv, ahead, q, v, z
):  # fmt: skip
    """One step from the snapshot at the middle, and the next middle; False if the middle is that of another state."""
    if not _is_predicted(q, v, ahead):
        return False
    evaluate_contacts(pads, columns, poses, J, v, z, 0.5 * step, True, contacts, jacobian)
    generalized_force(columns, contacts, jacobian, nle, torque, dv)
    copy_mass(M, envelope, matrix)
    _add_stiffness(columns, contacts, jacobian, step, matrix)
    if factor(matrix, envelope) >= 0:
        dv[:] = np.nan
    else:
        solve(matrix, envelope, dv)
    for k in range(v.shape[0]):
        dv[k] *= step
        v[k] += 0.5 * dv[k]
    integrate(joints, q, v, step, q)
    integrate_memory(columns, contacts, jacobian, v, step, z)
    relax(pads, contacts, step, z)
    for k in range(v.shape[0]):
        v[k] += 0.5 * dv[k]
    _predict(joints, q, v, dv, step, ahead)
    return True


@compiled
def _add_stiffness(columns, contacts, jacobian, step, matrix):
    """Lower triangle of matrix += (h/2) J^T D J + (h^2/4) J^T K J, K symmetrised."""
    weight, per_step = 0.25 * step * step, 2.0 / step
    for i in range(contacts.shape[0]):
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
