"""The state: all that the future depends on, given the torques."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled


class StateArrays(NamedTuple):
    """q, v and z of a `State`, for kernels."""

    q: Array
    v: Array
    z: Array


@dataclass(frozen=True)
class Carried:
    """What a simulation hands on from one control period to the next beside q, v and z.

    Attributes:
        plant: each contact as the last step left it, and what its Jacobians and forces were evaluated at.
        stepper: what the stepper takes from one step into the next.
        loop: torques that are held, and what the search for faults compares with.
        memory: of the controller, before it speaks at this time.
        names: of the joints, then of the contacts, to tell the plant by.
    """

    plant: dict[str, AnyArray]
    stepper: dict[str, AnyArray]
    loop: dict[str, AnyArray]
    memory: Any = None
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class State:
    """All that the future depends on, given the torques.

    q, v and z are the mechanical state: a run can start from them alone. `Simulation.save` adds the time and what the
    loop hands on, so that a run that is cut in two there goes on as the uncut one would have, to the last bit; it can
    be pickled and taken to another process.

    Attributes:
        q: joint positions [rad or m], then position [m] and quaternion (x, y, z, w) of the object, shape (nq,).
        v: joint velocities, then linear [m/s] and angular [rad/s] velocity of the object in its own frame, shape (nv,).
        z: dtheta, dphi, dpsi [rad] of each contact, or s1, s2 [m], psi [rad] under a law in surface coordinates; then
            four forces for each relaxation of the damping; all that again for each further element of a contact; then
            1 for a tip that slips, where it holds longer before; shape (nc, `Plant.n_memory`).
        time: [s].
        carried: what a simulation hands on; None for a state that starts afresh.
    """

    q: Array
    v: Array
    z: Array
    time: float = 0.0
    carried: Carried | None = None

    def __post_init__(self) -> None:
        for name in StateArrays._fields:  # kernels take these arrays as they are
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=np.float64))

    @property
    def arrays(self) -> StateArrays:
        """q, v and z, for kernels."""
        return StateArrays(self.q, self.v, self.z)

    def copy(self) -> State:
        """An independent copy of q, v and z."""
        return replace(self, q=self.q.copy(), v=self.v.copy(), z=self.z.copy())

    def assign(self, other: State) -> None:
        """Take over q, v and z of another state, in place."""
        for mine, given in zip(self.arrays, other.arrays, strict=True):
            mine[...] = given


@compiled
def is_at(q, v, z, at):
    """Whether `Plant.at` is this state."""
    nq, nv = q.shape[0], v.shape[0]
    same = True
    for k in range(nq):
        same &= at[k] == q[k]
    for k in range(nv):
        same &= at[nq + k] == v[k]
    memory = z.shape[1]
    for i in range(z.shape[0]):
        for k in range(memory):
            same &= at[nq + nv + memory * i + k] == z[i, k]
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
