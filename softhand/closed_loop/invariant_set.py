"""What may still move where the fingers stand still: L of (60), and the contact stiffness as the object sees it.

The proof of [Nakashima] Theorem 1 ends with K_O (q_O - q_Od) = N_O - F_O (71) while q_F' = 0. Its derivative with (43)
is L (q_O', delta') = 0, so that nothing moves if L is nonsingular. F_O depends on q_O, delta and eta, and with q_F' = 0

    eta' = H V_C = - H (D_delta delta' + D_O T_O q_O')                                  (35), (38)-(40)

so that

    L = [ dF_O/dq_O - dF_O/deta H D_O T_O + K_O - dN_O/dq_O     dF_O/ddelta - dF_O/deta H D_delta ]      (60), mended
        [ J_O                                                   J_delta                           ]

The paper prints H J_O, whose sizes do not fit (15 x 18 times 12 x 6), and leaves out - dF_O/deta H D_delta and
- dN_O/dq_O; the last is zero for an object whose frame is at its centre of mass.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from softhand.assembly.probe import Probe
from softhand.contact.grasp_map import grasp_map
from softhand.errors import ModelError
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.numerics.spatial import rotation_of, turning_of
from softhand.sensing.observation import Observation

_STEP = 1e-6
_FORCE_ROWS = [0, 1, 2, 5]  # of a twist: B_C of (42)


@dataclass(frozen=True, eq=False)
class InvariantSet:
    """L and what can be said from it.

    Attributes:
        L: (60), mended, shape (6 + 4 nc, 6 + 4 nc).
        contact_stiffness: K_c = - dF_O/dq_O along rolling motions with the fingers held, in the coordinates q_O
            [N/m, N, N m/rad], shape (6, 6).
        smallest: smallest singular value of L in SI. Its entries have different units: compare it with itself only.
        use: largest real part of the eigenvalues of (K_c + dN_O/dq_O)^-1 K_O, free of units: the share of the contact
            stiffness that K_O takes up. L is singular where an eigenvalue is 1; below that it is not.
    """

    L: Array
    contact_stiffness: Array
    smallest: float
    use: float


@dataclass(frozen=True)
class _Plane:
    """What F_O needs to know of one contact."""

    law: Law
    normal: Array
    tangent: Array
    offset: float


def examine(probe: Probe, observation: Observation, spring: Array) -> InvariantSet:
    """L and the contact stiffness at the state that was last given to a probe.

    Args:
        probe: at the state.
        observation: what it returned.
        spring: K_O in the coordinates q_O, see `Gains.spring`, shape (6, 6).

    Raises:
        ModelError: a tip touches a curved surface.
    """
    nc, planes = len(probe.laws), _planes(probe)
    by_q, by_delta, by_eta = np.zeros((6, 6)), np.zeros((6, 4 * nc)), np.zeros((6, 5 * nc))
    H_D_O, H_D_delta = np.zeros((5 * nc, 6)), np.zeros((5 * nc, 4 * nc))
    J_O, J_delta = np.zeros((4 * nc, 6)), np.zeros((4 * nc, 4 * nc))
    for i, plane in enumerate(planes):
        q_O, delta, eta = observation.q_O, observation.deformation[i], observation.eta[i]
        H, D_delta, D_O = _contact_maps(plane, q_O, delta, eta)
        slope = _differences(partial(_share, plane), np.concatenate([q_O, delta, eta]))
        five, four = slice(5 * i, 5 * i + 5), slice(4 * i, 4 * i + 4)
        by_q += slope[:, :6]
        by_delta[:, four], by_eta[:, five] = slope[:, 6:10], slope[:, 10:]
        H_D_O[five], H_D_delta[five, four] = H @ D_O, H @ D_delta
        J_O[four], J_delta[four, four] = D_O[_FORCE_ROWS], D_delta[_FORCE_ROWS]
    free_q = by_q - by_eta @ H_D_O
    free_delta = by_delta - by_eta @ H_D_delta
    gravity = _differences(partial(_load, probe), observation.q_O.copy())
    L = np.block([[free_q + spring - gravity, free_delta], [J_O, J_delta]])
    K_c = -(free_q - free_delta @ np.linalg.solve(J_delta, J_O))
    use = np.linalg.eigvals(np.linalg.solve(K_c + gravity, spring)).real
    return InvariantSet(L, K_c, float(np.linalg.svd(L, compute_uv=False)[-1]), float(use.max()))


def _planes(probe: Probe) -> list[_Plane]:
    """What each contact needs; ModelError for a curved one."""
    fingertips, file = probe.plant.fingertips, probe.plant.world.object_urdf
    if any(fingertip.face.is_curved for fingertip in fingertips):
        raise ModelError(
            f"{file}: L of (60) is written for plane faces, and this object is curved where it is touched; "
            "`softhand stability` takes it.",
            file=str(file),
        )
    faces = (fingertip.face for fingertip in fingertips)
    return [_Plane(law, face.normal, face.tangent, face.offset) for law, face in zip(probe.laws, faces, strict=True)]


def _load(probe: Probe, q_O: Array) -> Array:
    """N_O, the gravity terms of the object, shape (6,)."""
    model = probe.plant.world.model
    inertia = model.inertias[probe.plant.world.object_joint]
    lever = rotation_of(q_O[3:].tolist()) @ inertia.lever
    return _twist_map(q_O).T @ grasp_map(lever[None]) @ (-inertia.mass * model.gravity.linear)


@dataclass(frozen=True, eq=False)
class InvariantSeries(Record):
    """`InvariantSet.smallest` and `.use` at some samples of a run, shape (samples,)."""

    units: ClassVar = {"time": "s", "smallest": "SI, of mixed units", "use": "1"}

    time: Array
    smallest: Array
    use: Array


def _share(plane: _Plane, x: Array) -> Array:
    """What one contact adds to F_O = J_O^T J_delta^-T dF, as a function of (q_O, delta, eta), shape (6,)."""
    q_O, delta, eta = x[:6], x[6:10], x[10:]
    _, D_delta, D_O = _contact_maps(plane, q_O, delta, eta)
    dF = plane.law.force(*delta.tolist(), float(eta[1]), *plane.law.parameters().tolist())
    return D_O[_FORCE_ROWS].T @ np.linalg.solve(D_delta[_FORCE_ROWS].T, np.array(dF))


def _twist_map(q_O: Array) -> Array:
    """T_O: velocity of the origin and angular velocity, world axes, from q_O', shape (6, 6)."""
    T_O = np.eye(6)
    T_O[3:, 3:] = turning_of(q_O[3:])
    return T_O


def _contact_maps(plane: _Plane, q_O: Array, delta: Array, eta: Array) -> tuple[Array, Array, Array]:
    """H of eta' = H V_C, D_delta of (37), and D_O T_O of (23), of one contact: shapes (5, 6), (6, 4), (6, 6)."""
    R, Phi, Psi = plane.law.radius - delta[0], eta[1] - delta[2], eta[4] + delta[3]
    sin_Phi, cos_Phi, sin_Psi, cos_Psi = math.sin(Phi), math.cos(Phi), math.sin(Psi), math.cos(Psi)
    R_psi = np.array([[cos_Psi, -sin_Psi], [-sin_Psi, -cos_Psi]])
    # rows theta, phi, alpha_o (two), psi; columns v_x, v_y, v_z, w_x, w_y, w_z
    H = np.zeros((5, 6))
    H[0, 4], H[1, 3] = -1.0 / cos_Phi, 1.0
    H[2:4, :2] = R_psi
    H[2:4, 3:5] = R_psi @ np.array([[0.0, -R], [R, 0.0]])
    H[4, 5], H[4, 4] = 1.0, -sin_Phi / cos_Phi
    D_delta = np.zeros((6, 4))
    D_delta[0, 1], D_delta[1, 2], D_delta[2, 0] = R * cos_Phi, R, 1.0
    D_delta[3, 2], D_delta[4, 1], D_delta[5, 1], D_delta[5, 3] = -1.0, cos_Phi, sin_Phi, 1.0
    second = np.cross(plane.normal, plane.tangent)
    R_CO_CF = np.zeros((3, 3))
    R_CO_CF[:2, :2], R_CO_CF[2, 2] = R_psi, -1.0
    R_BO = rotation_of(q_O[3:].tolist())
    R_BC = R_BO @ np.column_stack([plane.tangent, second, plane.normal]) @ R_CO_CF
    arm = R_BO @ (plane.offset * plane.normal + eta[2] * plane.tangent + eta[3] * second)
    velocity, spin = grasp_map(arm[None]).T, np.eye(6)[3:]  # of the object's point at the contact
    return H, D_delta, np.vstack([R_BC.T @ velocity, R_BC.T @ spin]) @ _twist_map(q_O)


def _differences(function: Callable[[Array], Array], x: Array) -> Array:
    """Central differences of a function of a vector."""
    columns = []
    for k in range(len(x)):
        upper, lower = x.copy(), x.copy()
        upper[k] += _STEP
        lower[k] -= _STEP
        columns.append((function(upper) - function(lower)) / (2.0 * _STEP))
    return np.column_stack(columns)
