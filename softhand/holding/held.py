"""The contacts of a held object as linear maps: wrench, joint torques and internal forces from contact forces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.closed_loop.object_tangent import length_of
from softhand.closed_loop.start import HeldStart, held_end, held_sample, held_start
from softhand.contact.pads import Fingertip
from softhand.errors import GraspError, LawError, ScenarioError
from softhand.grasping.materials import Material
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import cross_matrix
from softhand.recording.recording import Recording
from softhand.scenario.scenario import Scenario, as_scenario
from softhand.sensing.observation import Observation
from softhand.start.press import plain_depth

_FLAT = np.radians(60.0)  # Phi at which the depth of a tip is taken by its force
_LEAST_PRESS = 1e-3  # [N]


@dataclass(frozen=True, eq=False)
class Held:
    """An object in the grip of nc fingertips, n joints.

    Contact forces f = (f_x, f_y, f_z) and torsions tau are those on the object, in the contact frames, z into the
    object; wrenches are about the centre of mass, in world axes.

    Attributes:
        tips: names, one a contact.
        joints: names.
        force_map: wrench from the forces, shape (6, 3 nc).
        torsion_map: wrench from the torsions, shape (6, nc).
        basis: K of (58), forces from internal forces, shape (3 nc, np).
        hand_force: J_CF^f, whose transpose gives joint torques from forces, shape (3 nc, n).
        hand_torsion: J_CF^tau, shape (nc, n).
        hand_weight: joint torques that hold the hand, from the gravity in the base frame [kg m, kg], shape (n, 3).
        gravity: [m/s^2], shape (3,).
        effort: limits of the joint torques [N m, N], infinite for none, shape (n,).
        friction: mu, shape (nc,).
        lever: tau_max / (mu f_z) [m], shape (nc,).
        curve: of the limit surface, see `contact.limit.set_limit`, zeros for the ellipse, shape (nc, 5).
        mass: of the object [kg].
        length: by which its moments count as forces [m].
        force: f now [N], shape (3 nc,).
        torsion: tau now [N m], shape (nc,).
        position: of the centre of mass, in the world [m].
        lever_at: the lever of contact i under another normal force [N]; that of now if not given.
    """

    tips: tuple[str, ...]
    joints: tuple[str, ...]
    force_map: Array
    torsion_map: Array
    basis: Array
    hand_force: Array
    hand_torsion: Array
    hand_weight: Array
    gravity: Array
    effort: Array
    friction: Array
    lever: Array
    curve: Array
    mass: float
    length: float
    force: Array
    torsion: Array
    position: Array
    lever_at: Callable[[int, float], float] | None = None

    @property
    def internal_force(self) -> Array:
        """f_N = K^+ f now [N], shape (np,)."""
        return np.asarray(np.linalg.pinv(self.basis) @ self.force)

    @property
    def limit_use(self) -> Array:
        """Of the limit surface by the forces of now, shape (nc,)."""
        return limit_use(self, self.force, self.torsion)

    def with_friction(self, friction: float) -> Held:
        """The same with one mu at all contacts."""
        return replace(self, friction=np.full(len(self.friction), friction))

    def pressed(self, normal: Array) -> Held:
        """The same with the levers that go with these normal forces [N], shape (nc,)."""
        if self.lever_at is None:
            return self
        levers = [self.lever_at(i, float(force)) for i, force in enumerate(normal)]
        return replace(self, lever=np.array(levers))


def limit_use(held: Held, force: Array, torsion: Array) -> Array:
    """sqrt(H) / (mu f_z), 1 on the limit surface, of many loads at once; infinite without pressing.

    Args:
        held: the contacts.
        force: [N], shape (..., 3 nc).
        torsion: [N m], shape (..., nc).

    Returns:
        Shape (..., nc).
    """
    parts = force.reshape(*torsion.shape, 3)
    sliding, spin = np.sum(parts[..., :2] ** 2, axis=-1), (torsion / held.lever) ** 2
    square = sliding + spin
    u = np.divide(sliding, square, out=np.zeros_like(square), where=square > 0.0)
    P = sum(held.curve[:, k] * u**k for k in range(5))
    size, room = np.sqrt(square * (1.0 + u * (1.0 - u) * P)), held.friction * parts[..., 2]
    use: Array = np.divide(size, room, out=np.full_like(size, np.inf), where=room > 0.0)
    return np.where((size <= 0.0) & (parts[..., 2] >= 0.0), 0.0, use)


def look(source: Scenario | Recording | str | Path, at: float | None = None) -> HeldStart:
    """The start of a scenario; or a sample of a run, without a time the quietest since its reference rests.

    Raises:
        ScenarioError: a time is given for a scenario.
    """
    if isinstance(source, Recording):
        return held_end(source) if at is None else held_sample(source, at)
    if at:
        raise ScenarioError(
            f"at: got {at:g} s for a scenario, which is looked at at its start; simulate it and give the recording.",
            key="at", value=at,
        )  # fmt: skip
    return held_start(as_scenario(source))


def held_there(start: HeldStart) -> Held:
    """The contacts of a held object.

    Raises:
        GraspError: a fingertip does not press on the object.
        LawError: as `held_by`.
    """
    plant, observed = start.probe.plant, start.probe.at(start.state, start.time)
    return held_by(observed, plant.tip_contacts, plant.fingertips, plant.world, start.time)


def held_by(
    observed: Observation,
    contacts: NDArray[np.void],
    fingertips: tuple[Fingertip, ...] | list[Fingertip],
    world: World,
    time: float,
) -> Held:
    """The same from an observation and the contacts that go with it.

    Raises:
        GraspError: as `held_there`.
        LawError: a law has a moment, which what follows does not count.
    """
    for law in (tip.law for tip in fingertips if tip.law.moment is not None):
        raise LawError(
            f"law '{type(law).__name__}' transmits moments where the tips lean, and how a grasp holds is told by "
            "forces and torsions alone; take a law without, such as `conservative`, or push in a simulation.",
            law=type(law).__name__,
        )
    open_tips = [name for name, row in zip(observed.tip_names, observed.contact_force, strict=True) if not row[2] > 0.0]
    if open_tips:
        raise GraspError(
            f"{', '.join(open_tips)}: not pressing on the object at t = {time:g} s, so that no squeeze can be told; "
            "set grasp.opening = 0, or give the recording and `at`, a time at which all tips hold.",
            finger=open_tips[0], quantity="normal force", value=0.0,
        )  # fmt: skip
    arm = observed.object_rotation @ observed.object_lever
    about = np.eye(6)
    about[3:, :3] = -cross_matrix(arm)
    n = len(observed.joint_position)
    materials = [Material(tip.law, tip.friction, tip.torsion_length or 0.0, tip.limit) for tip in fingertips]
    lever, normal = contacts["lever"].copy(), observed.contact_force[:, 2].copy()

    def length_at(i: int, force: float) -> float:
        law = materials[i].law
        return materials[i].torsion(plain_depth(law, _FLAT, 0.0, max(force, _LEAST_PRESS))).length

    own = [length_at(i, float(normal[i])) for i in range(len(lever))]
    return Held(
        tips=tuple(observed.tip_names),
        joints=world.joint_names,
        force_map=about @ observed.object_force_jacobian.T,
        torsion_map=about @ observed.object_torsion_jacobian.T,
        basis=observed.internal_force_basis.copy(),
        hand_force=observed.hand_force_jacobian.copy(),
        hand_torsion=observed.hand_torsion_jacobian.copy(),
        hand_weight=_hand_weight(world, observed.configuration, n),
        gravity=np.array(world.gravity),
        effort=observed.effort_limit.copy(),
        friction=contacts["friction"].copy(),
        lever=lever,
        curve=contacts["curve"].copy(),
        mass=observed.object_mass,
        length=length_of(world.model.inertias[world.object_joint]),
        force=observed.f_C.copy(),
        torsion=observed.tau_C.copy(),
        position=observed.object_position + arm,
        lever_at=lambda i, force: float(lever[i] * length_at(i, force) / own[i]),
    )


def _hand_weight(world: World, q: Array, n: int) -> Array:
    """Torques of joints or motors against a gravity of 1 m/s^2 along x, y, z of the base [kg m, kg], shape (n, 3)."""
    turned, columns, whole = world.model.copy(), [], world.configuration(q)
    for axis in np.eye(3):
        turned.gravity = pin.Motion(axis, np.zeros(3))
        gravity = pin.computeGeneralizedGravity(turned, turned.createData(), whole)
        columns.append((gravity if world.coupling is None else world.coupled.S.T @ gravity)[:n].copy())
    return np.column_stack(columns)
