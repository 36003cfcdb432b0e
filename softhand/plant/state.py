"""The state: all that the future depends on, given the torques."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled


@dataclass(frozen=True)
class State:
    """All that the future depends on, given the torques.

    Attributes:
        q: joint positions [rad or m], then position [m] and quaternion (x, y, z, w) of the object, shape (nq,).
        v: joint velocities, then linear [m/s] and angular [rad/s] velocity of the object in its own frame, shape (nv,).
        z: dtheta, dphi, dpsi [rad] of each contact, or s1, s2 [m], psi [rad] under a law in surface coordinates; then
            four forces for each relaxation of the damping; then 1 for a tip that slips, where it holds longer before;
            shape (nc, `Plant.n_memory`).
    """

    q: Array
    v: Array
    z: Array

    def __post_init__(self) -> None:
        for name in ("q", "v", "z"):  # kernels take these arrays as they are
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=np.float64))

    def copy(self) -> State:
        """An independent copy."""
        return State(self.q.copy(), self.v.copy(), self.z.copy())


@compiled
def is_at(q, v, z, at):
    """Whether `Plant.at` is this state."""
    nq, nv = q.shape[0], v.shape[0]
    same = True
    for k in range(nq):
        same = same and at[k] == q[k]
    for k in range(nv):
        same = same and at[nq + k] == v[k]
    memory = z.shape[1]
    for i in range(z.shape[0]):
        for k in range(memory):
            same = same and at[nq + nv + memory * i + k] == z[i, k]
    return same


@compiled
def set_at(q, v, z, at):
    """Set `Plant.at` to this state."""
    nq, nv = q.shape[0], v.shape[0]
    for k in range(nq):
        at[k] = q[k]
    for k in range(nv):
        at[nq + k] = v[k]
    memory = z.shape[1]
    for i in range(z.shape[0]):
        for k in range(memory):
            at[nq + nv + memory * i + k] = z[i, k]
