"""Hand, object and soft contacts as one system of ordinary differential equations, [Nakashima] Eqs. (46)-(48)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.contact.elements import ROW
from softhand.contact.friction import note_slip
from softhand.contact.layer import evaluate_contacts
from softhand.contact.pads import Contact, Fingertip, Support, build_pads, contact_columns, memory_size
from softhand.contact.records import CONTACT
from softhand.contact.sliders import slide
from softhand.laws.law import compile_law, compile_like
from softhand.model.compiled_snapshot import CompiledSnapshot
from softhand.model.snapshot import Snapshot
from softhand.model.terms import RigidTerms
from softhand.model.world import World
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.straight import structure_of
from softhand.plant.dynamics import accelerate, add_contact_moment
from softhand.plant.resistance import Resistance, become, evaluate_resistance, resistance_of
from softhand.plant.state import State, is_at, set_at
from softhand.tactile.taxels import Taxels
from softhand.tactile.taxels import become as become_taxels

_CARRIED = ("contacts", "contact_columns", "at", "elements")


class Touch(NamedTuple):
    """The arrays of all contacts of a `Plant`, and what its joints resist with, for kernels."""

    pads: NDArray[np.void]
    columns: NDArray[np.int64]
    contacts: NDArray[np.void]
    jacobian: Array
    depths: Array
    resistance: Resistance
    """Of the joints."""


class Plant:
    """Forces and accelerations at one state.

    All arrays are live: `update` overwrites them.

    Attributes:
        world: the rigid bodies.
        snapshot: their terms at the last state, from Pinocchio or from the kernel, by the argument `terms`.
        fingertips: material of each tip.
        supports: what else may touch; nc counts both.
        materials: fingertips and supports, one a contact.
        pads: constants of each contact, fingertips first, `records.PAD`, shape (nc,).
        contacts: each contact at the last state, `records.CONTACT`, shape (nc,).
        columns: velocities that move each pad, then its base, padded with -1, shape (nc, width).
        contact_columns: [J_CF, -J_O] of each contact by these columns, shape (nc, width, 4); with ellipsoids
            and laws that have a moment 6, see `contact_jacobian`.
        touching: the four together, room for the dr of each where a step began, shape (nc,), and damping, friction and
            stops of the joints.
        rigid: mass matrix and velocity terms at any configuration.
        joints: what `configuration.integrate` needs, shape (joints, 3).
        envelope: first column of each row of the mass matrix and of M + J^T K J (lower triangle), shape (nv,).
        at: the q, v and z that contacts and the poses and Jacobians of the snapshot belong to, one behind the other;
            NaN if unknown, shape (nq + nv + nc n_memory,).
        n_memory: numbers of each contact in z of a `State`.
        can_slip: whether friction has a limit at any contact.
        mass_factor: factor of M after `acceleration`, shape (nv, nv).
        external: generalized force of pushes from outside [N, N m], zero unless somebody sets it, shape (nv,).
        elements: what the last evaluation found for the elements of each contact, see `contact.elements`, shape
            (nc, most elements + 1, ROW); no numbers where every contact slips as a whole.
        taxels: of the tips, if they have any.
        skin: the same for kernels.
        reading: what they do to what they feel.
    """

    def __init__(
        self,
        world: World,
        fingertips: Sequence[Fingertip],
        supports: Sequence[Support] = (),
        terms: Literal["pinocchio", "compiled"] = "pinocchio",
        taxels: Taxels | None = None,
    ) -> None:
        self.world = world
        self.snapshot = CompiledSnapshot(world) if terms == "compiled" else Snapshot(world)
        self.rigid = RigidTerms(world.model, world.coupled)
        self.joints = world.joints
        self.fingertips, self.supports = tuple(fingertips), tuple(supports)
        every: tuple[Contact, ...] = (*self.fingertips, *self.supports)
        self.materials = every
        self._code = {law: compile_law(law) for law in {contact.law for contact in every}}
        self.n_memory = memory_size(every)
        self.pads = build_pads(world, fingertips, supports, self._code)
        most = max(contact.elements for contact in every)
        self.elements = np.zeros((len(every), most + 1 if most > 1 else 0, ROW))
        self._point_at_elements(self.pads)
        self.columns, self.pads["own"], self.envelope = contact_columns(world, supports)
        self.can_slip = any(contact.can_slip for contact in every)
        self.contacts = np.zeros(len(every), CONTACT)
        rolls = self.pads["semi_axes"].any() or self.pads["slope_function"].any()
        self.contact_columns = np.zeros((*self.columns.shape, 6 if rolls else 4))
        self.touching = Touch(self.pads, self.columns, self.contacts, self.contact_columns, np.full(len(every), np.nan),
                              resistance_of(world))  # fmt: skip
        self.at = np.full(world.nq + world.nv + len(every) * self.n_memory, np.nan)
        self.external = np.zeros(world.nv)
        self.mass_factor = np.zeros((world.nv, world.nv))
        self.taxels = taxels
        if taxels is not None:
            self.skin = taxels.skin([tip.law for tip in self.fingertips], world.shape)
            self.reading = taxels.reading()
        if isinstance(self.snapshot, CompiledSnapshot):  # kernels put the deformation into the arguments of laws
            self._structure = structure_of(self.pads), structure_of(self.snapshot.tree.joints)

    def become(
        self,
        world: World,
        fingertips: Sequence[Fingertip],
        supports: Sequence[Support],
        taxels: Taxels | None = None,
    ) -> bool:
        """Be a plant with compiled terms that differs in numbers alone, in the same memory and as if it were new.

        Returns:
            False where it differs in more, in the hand, in a shape or in what is zero; then this plant is of no use.
        """
        every: list[Contact] = [*fingertips, *supports]
        snapshot = self.snapshot
        if not (isinstance(snapshot, CompiledSnapshot) and world.joints is self.world.joints):
            return False
        if len(every) != len(self.materials) or memory_size(every) != self.n_memory:
            return False
        if (0 if taxels is None else len(taxels)) != self.n_taxels:
            return False
        code = {law: compile_like(law, self._code) for law in {contact.law for contact in every}}
        pads = build_pads(world, fingertips, supports, code)
        pads["own"] = self.pads["own"]
        self._point_at_elements(pads)
        before = self._structure
        if not become(self.touching.resistance, resistance_of(world)):
            return False
        snapshot.become(world)
        self._structure = structure_of(pads), structure_of(snapshot.tree.joints)
        if self._structure != before:
            return False
        self.world, self.rigid, self._code, self.materials = (
            world,
            RigidTerms(world.model, world.coupled),
            code,
            tuple(every),
        )
        self.fingertips, self.supports = tuple(fingertips), tuple(supports)
        self.pads[...] = pads
        self.taxels = taxels
        if taxels is not None:
            skin = taxels.skin([tip.law for tip in self.fingertips], world.shape)
            if not become_taxels((self.skin, self.reading), (skin, taxels.reading())):
                return False
        self.forget()
        return True

    def _point_at_elements(self, pads: NDArray[np.void]) -> None:
        for pad, rows in zip(pads, self.elements, strict=True):
            pad["element_rows"] = rows.ctypes.data if pad["elements"] > 1 else 0

    def forget(self) -> None:
        """Know of no state, as if new."""
        self.contacts[...], self.contact_columns[...], self.external[...] = np.zeros(1, CONTACT), 0.0, 0.0
        self.touching.depths[...], self.at[...], self.elements[...] = np.nan, np.nan, 0.0
        if self.taxels is not None:
            self.reading.memory[...], self.reading.begun[...] = 0.0, 0

    @property
    def n_taxels(self) -> int:
        """Taxels of each tip."""
        return 0 if self.taxels is None else len(self.taxels)

    @property
    def n_shares(self) -> int:
        """Fingertips, if some have elements that slip by themselves, else 0."""
        return self.world.n_tips if self.n_elements else 0

    @property
    def n_elements(self) -> int:
        """Most elements of a contact; 0 where all slip as a whole."""
        return max(0, self.elements.shape[1] - 1)

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

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the joints, then of the contacts."""
        return (*self.world.joint_names, *self.contact_names)

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
        evaluate_resistance(self.touching.resistance, q, v)

    def note_slip(self, z: Array, step: float = 0.0) -> None:
        """Make the slip of the last evaluation final, in z and in the totals, see `friction.note_slip`."""
        note_slip(self.pads, self.contacts, z, step)

    def settle(self, state: State, step: float = 0.0) -> None:
        """Make the slip at a state final, for steppers whose forces obey the limit while z runs on within a step.

        To be called before and after a step; a state that was left settled stays as it is.

        Args:
            state: its z is set.
            step: that ends there [s].
        """
        if self.can_slip and not is_at(state.q, state.v, state.z, self.at):
            self.update(state.q, state.v, state.z)
            slide(self.pads, self.contacts, step)
            self.note_slip(state.z, step)
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
            self.touching.depths,
            with_stiffness,
            self.contacts,
            self.contact_columns,
        )

    @property
    def jacobian(self) -> Array:
        """Rows of [J_CF, -J_O] in the velocities of `State`, shape (nc, 4, nv). A copy."""
        jacobian = np.zeros((len(self.contacts), 4, self.world.nv))
        for rows, columns, values in zip(jacobian, self.columns, self.contact_columns, strict=True):
            rows[:, columns[columns >= 0]] = values[columns >= 0, :4].T
        return jacobian

    def moment_force(self) -> Array:
        """Generalized force of the moments of the contacts at the last state, shape (nv,); zero if no law has any."""
        out = np.zeros(self.world.nv)
        for contact, columns, jacobian in zip(self.contacts, self.columns, self.contact_columns, strict=True):
            add_contact_moment(columns, jacobian, contact["lean_elastic"], out)
        return out

    def acceleration(self, torque: Array, out: Array) -> Array:
        """dv/dt at the last state under the joint torques [N m], shape (n,); written to `out`, shape (nv,).

        M dv/dt = (torque + damping and stops, 0) + external - (C v + N) - J^T C_F                     (46), (47)

        Dry friction is none of it: it is no function of the state, see `resistance.hold`.
        """
        accelerate(self.touching, self.snapshot.terms, self.envelope, torque, self.external, self.mass_factor, out)
        return out

    def carry(self) -> dict[str, AnyArray]:
        """What `resume` needs, as copies."""
        return {name: getattr(self, name).copy() for name in _CARRIED}

    def resume(self, state: State, carried: dict[str, AnyArray]) -> None:
        """Be as a plant was when `carry` was called there, at that state."""
        self.snapshot.update(state.q, state.v)
        for name in _CARRIED:
            getattr(self, name)[...] = carried[name]
