"""Hand, object and soft contacts as one system of ordinary differential equations, [Nakashima] Eqs. (46)-(48)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softhand.compiled import compiled
from softhand.contact.friction import note_slip
from softhand.contact.layer import evaluate_contacts
from softhand.contact.pads import Contact, Fingertip, Support, build_pads, contact_columns, memory_size
from softhand.contact.records import CONTACT
from softhand.laws.law import compile_law
from softhand.linear import factor, solve
from softhand.model.snapshot import Snapshot
from softhand.model.world import World

Array = NDArray[np.float64]


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


class Plant:
    """Forces and accelerations at one state.

    All arrays are live: `update` overwrites them.

    Attributes:
        world: the rigid bodies.
        snapshot: their terms at the last state.
        fingertips: material of each tip.
        supports: what else may touch; nc counts both.
        materials: fingertips and supports, one a contact.
        pads: constants of each contact, fingertips first, `records.PAD`, shape (nc,).
        contacts: each contact at the last state, `records.CONTACT`, shape (nc,).
        columns: velocities that move each pad, then its base, padded with -1, shape (nc, width).
        contact_columns: [J_CF, -J_O] of each contact by these columns, shape (nc, width, 4).
        joints: what `configuration.integrate` needs, shape (joints, 3).
        envelope: first column of each row of the mass matrix and of M + J^T K J (lower triangle), shape (nv,).
        at: the q, v and z that contacts and the poses and Jacobians of the snapshot belong to, one behind the other;
            NaN if unknown, shape (nq + nv + nc n_memory,).
        n_memory: numbers of each contact in z of a `State`.
        can_slip: whether friction has a limit at any contact.
    """

    def __init__(self, world: World, fingertips: Sequence[Fingertip], supports: Sequence[Support] = ()) -> None:
        self.world = world
        self.snapshot = Snapshot(world)
        self.joints = world.joints
        self.fingertips, self.supports = tuple(fingertips), tuple(supports)
        every: tuple[Contact, ...] = (*self.fingertips, *self.supports)
        self.materials = every
        self._code = {law: compile_law(law) for law in {contact.law for contact in every}}
        self.n_memory = memory_size(every)
        self.pads = build_pads(world, fingertips, supports, self._code)
        self.columns, self.pads["own"], self.envelope = contact_columns(world, supports)
        self.can_slip = any(contact.can_slip for contact in every)
        self.contacts = np.zeros(len(every), CONTACT)
        self.contact_columns = np.zeros((*self.columns.shape, 4))
        self.at = np.full(world.model.nq + world.model.nv + len(every) * self.n_memory, np.nan)
        self._mass = np.zeros((world.model.nv, world.model.nv))

    @property
    def tip_contacts(self) -> NDArray[np.void]:
        """The contacts of the fingertips: a view of the first rows, shape (n_tips,)."""
        return self.contacts[: self.world.n_tips]

    @property
    def support_contacts(self) -> NDArray[np.void]:
        """Those of the supports: a view of the rows behind."""
        return self.contacts[self.world.n_tips :]

    @property
    def contact_names(self) -> tuple[str, ...]:
        """Names of the tips, then of the supports."""
        return (*(tip.name for tip in self.world.tips), *(support.name for support in self.supports))

    def with_supports(self, state: State) -> State:
        """A state whose z has rows for the fingertips alone, with rows for all: supports that store nothing."""
        z = np.zeros((len(self.contacts), self.n_memory))
        rows, columns = state.z.shape
        z[:rows, :columns] = state.z
        return State(state.q, state.v, z)

    def update(self, q: Array, v: Array, z: Array) -> None:
        """Rigid-body terms, contacts and forces at one state."""
        self.at[0] = np.nan
        self.snapshot.update(q, v)
        self.touch(v, z)

    def note_slip(self, z: Array) -> None:
        """Make the slip of the last evaluation final, in z and in the totals of the contacts."""
        note_slip(self.pads, self.contacts, z)

    def settle(self, state: State) -> None:
        """Make the slip at a state final, for steppers whose forces obey the limit while z runs on within a step.

        To be called before and after a step; a state that was left settled stays as it is.
        """
        if self.can_slip and not is_at(state.q, state.v, state.z, self.at):
            self.update(state.q, state.v, state.z)
            self.note_slip(state.z)
            set_at(state.q, state.v, state.z, self.at)

    def touch(self, v: Array, z: Array, lead: float = 0.0, with_stiffness: bool = False) -> None:
        """Contacts and forces at the configuration of the snapshot; see `evaluate_contacts`."""
        snapshot = self.snapshot
        evaluate_contacts(
            self.pads,
            self.columns,
            snapshot.poses,
            snapshot.J,
            v,
            z,
            lead,
            with_stiffness,
            self.contacts,
            self.contact_columns,
        )

    @property
    def jacobian(self) -> Array:
        """Rows of [J_CF, -J_O] in the velocities of `State`, shape (nc, 4, nv). A copy."""
        jacobian = np.zeros((len(self.contacts), 4, self.world.model.nv))
        for rows, columns, values in zip(jacobian, self.columns, self.contact_columns, strict=True):
            rows[:, columns[columns >= 0]] = values[columns >= 0].T
        return jacobian

    def acceleration(self, torque: Array, out: Array) -> Array:
        """dv/dt at the last state under the joint torques [N m], shape (n,); written to `out`, shape (nv,).

        M dv/dt = (torque, 0) - (C v + N) - J^T C_F                                                    (46), (47)
        """
        snapshot = self.snapshot
        accelerate(
            self.columns,
            self.envelope,
            self.contacts,
            self.contact_columns,
            snapshot.M,
            snapshot.nle,
            torque,
            self._mass,
            out,
        )
        return out


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


@compiled
def generalized_force(columns, contacts, jacobian, nle, torque, out):
    """out = (torque, 0) - nle - J^T C_F, shape (nv,)."""
    for k in range(out.shape[0]):
        out[k] = -nle[k]
    for k in range(torque.shape[0]):
        out[k] += torque[k]
    for i in range(contacts.shape[0]):
        if not contacts[i].is_idle:
            add_contact_force(columns[i], jacobian[i], contacts[i].force, out)


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
def copy_mass(M, envelope, mass):
    """Lower triangle of the symmetric `mass` inside its envelope from the upper triangle that Pinocchio fills."""
    for i in range(M.shape[0]):
        for j in range(envelope[i], i + 1):
            mass[i, j] = M[j, i]


@compiled
def accelerate(columns, envelope, contacts, jacobian, M, nle, torque, mass, out):
    """out = M^-1 ((torque, 0) - nle - J^T C_F); `mass` is scratch, shape (nv, nv)."""
    generalized_force(columns, contacts, jacobian, nle, torque, out)
    copy_mass(M, envelope, mass)
    if factor(mass, envelope) >= 0:
        out[:] = np.nan
    else:
        solve(mass, envelope, out)
