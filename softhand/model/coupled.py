"""Rigid-body terms of coupled joints in the coordinates of their motors, exactly: those of the joints, projected.

    q_F = S m + offset,   M = S^T M_F S + armature,   C v + N = S^T (C_F v_F + N_F),   J = J_F S

S is constant, so that nothing is left out. A motor gives different twists to different bodies, so that the columns of J
belong to a body: behind those of all joints there is a view for each body, nv columns wide.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.model.configuration import CONTINUOUS
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled


class Terms(NamedTuple):
    """The arrays of a `Snapshot`, for kernels."""

    M: Array
    J: Array
    nle: Array
    poses: Array


class Coupled(NamedTuple):
    """What kernels know of a coupling; all empty for a hand without one. Only q, v, M and nle are written."""

    S: Array
    """From v to the velocities of all joints and the object, shape (N, nv), or (0, 0)."""
    offset: Array
    """Of the joints with all motors at zero [rad or m], shape (joints,)."""
    joints: NDArray[np.int64]
    """Kind, index in the whole configuration, and index in q where it stands already, or -1, shape (joints, 3)."""
    motors: NDArray[np.int64]
    """Index in q of each motor, shape (motors,)."""
    entries: NDArray[np.int64]
    """Column of a view, and of a joint, shape (entries, 2)."""
    ratios: Array
    """What of the latter is in the former, shape (entries,)."""
    armature: Array
    """Inertia of the rotor of each motor, then zeros, shape (nv,)."""
    q: Array
    """Room: configuration of all joints and the object."""
    v: Array
    """Room: their velocity."""
    M: Array
    """Room: their mass matrix, shape (N, N)."""
    nle: Array
    """Room: their C v + N."""


def room(coupled: Coupled) -> Coupled:
    """The same coupling with room of its own, as whoever runs side by side needs it."""
    return coupled._replace(
        armature=coupled.armature.copy(), q=coupled.q.copy(), v=coupled.v.copy(), M=np.zeros_like(coupled.M),
        nle=coupled.nle.copy(),
    )  # fmt: skip


def uncoupled() -> Coupled:
    """That of a hand without coupling."""
    none = np.zeros((0, 2), np.int64)
    return Coupled(
        np.zeros((0, 0)), np.zeros(0), np.zeros((0, 3), np.int64), np.zeros(0, np.int64), none, np.zeros(0),
        np.zeros(0), np.zeros(0), np.zeros(0), np.zeros((2, 2), order="F"), np.zeros(0),
    )  # fmt: skip


def sizes_of(model: pin.Model, coupled: Coupled | None) -> tuple[int, int]:
    """Velocities, and columns of J."""
    if coupled is None or not coupled.S.size:
        return model.nv, model.nv
    nv = coupled.S.shape[1]
    return nv, model.nv + nv * (1 + int(coupled.entries[:, 0].max() - model.nv) // nv)


@compiled
def expand_configuration(coupled, q):
    """coupled.q = the configuration of all joints and the object at q."""
    joints, whole = coupled.joints, coupled.q
    for k in range(joints.shape[0]):
        i, source = joints[k, 1], joints[k, 2]
        if source >= 0:
            whole[i] = q[source]
            if joints[k, 0] == CONTINUOUS:
                whole[i + 1] = q[source + 1]
            continue
        x = coupled.offset[k]
        for m in range(coupled.motors.shape[0]):
            x += coupled.S[k, m] * q[coupled.motors[m]] if coupled.S[k, m] != 0.0 else 0.0
        if joints[k, 0] == CONTINUOUS:
            whole[i], whole[i + 1] = np.cos(x), np.sin(x)
        else:
            whole[i] = x
    for k in range(1, 8):
        whole[whole.shape[0] - k] = q[q.shape[0] - k]


@compiled
def expand_velocity(coupled, v):
    """coupled.v = S v."""
    S = coupled.S
    for k in range(S.shape[0]):
        x = 0.0
        for m in range(S.shape[1]):
            x += S[k, m] * v[m]
        coupled.v[k] = x


@compiled
def project_force(coupled, whole, out):
    """out = S^T whole: a generalized force of the joints as one of the motors."""
    S = coupled.S
    for m in range(S.shape[1]):
        x = 0.0
        for k in range(S.shape[0]):
            x += S[k, m] * whole[k]
        out[m] = x


@compiled
def project_mass(coupled, whole, out):
    """Upper triangle of out = S^T M S + armature, from the upper triangle of M.

    Each product is of two columns of S, few of whose numbers are not zero.
    """
    S = coupled.S
    N, n = S.shape
    for a in range(n):
        for b in range(a, n):
            x = 0.0
            for k in range(N):
                if S[k, a] != 0.0:
                    y = 0.0
                    for i in range(N):
                        if S[i, b] != 0.0:
                            y += (whole[k, i] if k <= i else whole[i, k]) * S[i, b]
                    x += S[k, a] * y
            out[a, b] = x
        out[a, a] += coupled.armature[a]


@compiled
def set_views(coupled, J):
    """The views of J from its first columns, those of all joints."""
    entries = coupled.entries
    for c in range(coupled.S.shape[0], J.shape[1]):
        for row in range(6):
            J[row, c] = 0.0
    for e in range(entries.shape[0]):
        view, joint, ratio = entries[e, 0], entries[e, 1], coupled.ratios[e]
        for row in range(6):
            J[row, view] += ratio * J[row, joint]


@compiled
def project_terms(coupled, M, nle, out):
    """M, nle and the views of J of `out` from the terms of all joints; the first columns of its J are theirs."""
    project_mass(coupled, M, out.M)
    project_force(coupled, nle, out.nle)
    set_views(coupled, out.J)
