"""Hand, object and soft contacts as one system of ordinary differential equations, [Nakashima] Eqs. (46)-(48)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softhand.compiled import compiled
from softhand.contact.friction import face_of, note_slip
from softhand.contact.layer import evaluate_contacts
from softhand.contact.records import CONTACT, LAW_ARGUMENTS, MAX_LAW_PARAMETERS, MAX_RELAXATIONS, PAD
from softhand.dampings.damping import Damping
from softhand.errors import LawError
from softhand.laws.law import LEADING, Law, compile_law
from softhand.linear import factor, solve
from softhand.model.faces import Face
from softhand.model.snapshot import Snapshot
from softhand.model.world import World

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Fingertip:
    """Material of one tip and the face that it touches."""

    law: Law
    friction: float
    """Coefficient mu."""
    face: Face
    damping: Damping = Damping()  # noqa: RUF009  frozen
    can_slip: bool = False
    """Whether friction has a limit and the object has edges; else the tip rolls on an endless face under any load."""
    static_friction: float | None = None
    """Coefficient until slip begins, not below `friction`; None: the same."""
    torsion_length: float | None = None
    """tau_max / (mu f_z) [m]; None: from the pressure of the law."""
    face_friction: tuple[float, ...] = ()
    """mu on the faces +x, -x, +y, -y, +z, -z of a box in place of `friction`; 0 where that holds; empty: nowhere."""

    def friction_at_start(self, axes: Array) -> float:
        """mu on the face that the tip touches at the start; `axes` are those of the box, shape (3, 3)."""
        own = self.face_friction[face_of(axes, self.face.normal)] if self.face_friction else 0.0
        return own or self.friction

    @property
    def holds_longer(self) -> bool:
        """Whether slip, once begun, goes on at less friction, so that it must be remembered."""
        return self.can_slip and self.static_friction is not None and self.static_friction > self.friction


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
        pads: constants of each contact, `records.PAD`, shape (nc,).
        contacts: each contact at the last state, `records.CONTACT`, shape (nc,).
        columns: velocities that move each tip, then the six of the object, padded with -1, shape (nc, width).
        contact_columns: [J_CF, -J_O] of each contact by these columns, shape (nc, width, 4).
        joints: what `configuration.integrate` needs, shape (joints, 3).
        envelope: first column of each row of the mass matrix, shape (nv,).
        at: the q, v and z that contacts and the poses and Jacobians of the snapshot belong to, one behind the other;
            NaN if unknown, shape (nq + nv + nc n_memory,).
        n_memory: numbers of each contact in z of a `State`.
        can_slip: whether friction has a limit at any contact.
    """

    def __init__(self, world: World, fingertips: Sequence[Fingertip]) -> None:
        self.world = world
        self.snapshot = Snapshot(world)
        self.joints = world.joints
        self.envelope = world.envelope
        self.columns = _pad_columns(world)
        self.fingertips = tuple(fingertips)
        self._code = {law: compile_law(law) for law in {fingertip.law for fingertip in fingertips}}
        self.n_memory = memory_size(fingertips)
        self.pads = self._build_pads()
        self.can_slip = any(fingertip.can_slip for fingertip in fingertips)
        self.contacts = np.zeros(world.n_tips, CONTACT)
        self.contact_columns = np.zeros((*self.columns.shape, 4))
        self.at = np.full(world.model.nq + world.model.nv + world.n_tips * self.n_memory, np.nan)
        self._mass = np.zeros((world.model.nv, world.model.nv))

    def _build_pads(self) -> NDArray[np.void]:
        pads = np.zeros(self.world.n_tips, PAD)
        for pad, tip, fingertip in zip(pads, self.world.tips, self.fingertips, strict=True):
            code = self._code[fingertip.law]
            if len(code.parameters) > MAX_LAW_PARAMETERS:
                name = type(fingertip.law).__name__
                raise LawError(
                    f"law '{name}' has {len(code.parameters)} parameters; at most {MAX_LAW_PARAMETERS} fit.", law=name
                )
            pad["joint"], pad["rotation"], pad["position"] = tip.joint, tip.rotation, tip.position
            pad["radius"], pad["friction"] = fingertip.law.radius, fingertip.friction
            pad["face_normal"], pad["face_tangent"] = fingertip.face.normal, fingertip.face.tangent
            pad["face_offset"] = fingertip.face.offset
            pad["force_function"], pad["stiffness_function"] = code.force.address, code.stiffness.address
            leading = len(LEADING[fingertip.law.coordinates])
            arguments = np.zeros(LAW_ARGUMENTS)
            arguments[leading : leading + len(code.parameters)] = code.parameters
            pad["law_arguments"] = arguments
            box = self.world.box
            pad["is_solid"] = fingertip.can_slip
            pad["box_rotation"], pad["box_centre"], pad["box_half"] = box.rotation, box.centre, box.half
            pad["can_slip"] = fingertip.can_slip
            pad["static_friction"] = fingertip.static_friction or fingertip.friction
            pad["has_faces"] = any(fingertip.face_friction)
            pad["face_friction"] = fingertip.face_friction or 0.0
            pad["slip_column"] = self.n_memory - 1 if fingertip.holds_longer else -1
            pad["torsion_length"] = fingertip.torsion_length or 0.0
            pad["torsion_share"] = fingertip.law.torsion_share or 0.0
            pad["is_surface"] = fingertip.law.coordinates == "surface"
            _set_damping(pad, fingertip.damping)
        return pads

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
        jacobian = np.zeros((self.world.n_tips, 4, self.world.model.nv))
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


def memory_size(fingertips: Sequence[Fingertip]) -> int:
    """Numbers of each contact in z of a `State`: three, four for each relaxation of the damping, one for slip."""
    relaxations = max(len(fingertip.damping.relaxation()) for fingertip in fingertips)
    return 3 + 4 * relaxations + any(fingertip.holds_longer for fingertip in fingertips)


def _set_damping(pad: np.void, damping: Damping) -> None:
    pad["viscosity"], pad["viscosity_per_force"] = damping.viscosity(), damping.viscosity_per_force()
    pairs = damping.relaxation()
    if len(pairs) > MAX_RELAXATIONS:
        raise LawError(
            f"damping '{type(damping).__name__}' has {len(pairs)} relaxations; at most {MAX_RELAXATIONS} fit.",
            law=type(damping).__name__,
        )
    for k, pair in enumerate(pairs):
        pad["relaxation"][k] = pair
    pad["is_damped"] = any(damping.viscosity()) or any(damping.viscosity_per_force()) or bool(pairs)


def _pad_columns(world: World) -> NDArray[np.int64]:
    of_object = range(world.n_joints, world.model.nv)
    moved = [[*tip.columns, *of_object] for tip in world.tips]
    width = max(map(len, moved))
    return np.array([columns + [-1] * (width - len(columns)) for columns in moved], dtype=np.int64)


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
