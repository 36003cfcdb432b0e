"""The grasp at rest from which a run starts: contact forces, deformations and joint angles in equilibrium."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from softhand.contact.pads import Fingertip, block_size, memory_size, remembered_of
from softhand.contact.records import LEANING, REMEMBERED, STORED
from softhand.errors import GraspError, LawError
from softhand.laws.law import CompiledLaw, Law, compile_like
from softhand.model.arm import Arm
from softhand.model.chain import POINT
from softhand.model.joined import shared_columns
from softhand.model.shapes.face import Face
from softhand.model.world import World, own_columns
from softhand.numerics.arrays import Array
from softhand.plant.state import State
from softhand.start.finger import settle_finger
from softhand.start.leaning import TURNS, Leaning, Leant
from softhand.start.outer import ON_SURFACE, check_is_outer, check_touches_alone
from softhand.start.reach import Reach, initial_joints, millimetres, place_palm
from softhand.start.settle import Settled
from softhand.start.statics import check_friction, check_torques, contact_loads
from softhand.start.together import Together, settle_together

_IN_A_PLANE = 1e-6  # smallest over largest speed of a tip that its joints move in a plane


@dataclass(frozen=True)
class Grasp:
    """A grasp at rest.

    Attributes:
        state: joints, object and deformation memory.
        deformation: dr [m], dtheta, dphi, dpsi [rad], or dr, s1, s2 [m], psi [rad] under a law in surface coordinates,
            shape (nc, 4).
        force: f_x, f_y, f_z [N] and tau [N m] on the object in C_F, shape (nc, 4).
        angles: Theta, Phi [rad], shape (nc, 2).
        friction_use: |f_t| / (mu f_z), shape (nc,).
        leant: forces in the world and torques where tips have moments; None where no law has any.
    """

    state: State
    deformation: Array
    force: Array
    angles: Array
    friction_use: Array
    leant: Leant | None = None


def faces_of(world: World, contact_points: Sequence[ArrayLike]) -> list[Face]:
    """The face of the object that each contact point lies on, or the tangent plane of a curved surface there.

    Args:
        world: hand and object.
        contact_points: in the object frame [m], one a tip.

    Raises:
        GraspError: a point does not lie on the surface.
    """
    found = []
    for tip, point in zip(world.tips, contact_points, strict=True):
        check_is_outer(tip.name, world.shape, point)
        foot, _ = world.shape.nearest(point)
        gap = float(np.linalg.norm(foot - np.asarray(point, dtype=float)))
        if gap > ON_SURFACE:
            raise GraspError(
                f"{tip.name}: the contact point {millimetres(point)} mm of the object frame is {1e3 * gap:.3g} mm off "
                f"the surface; the nearest point of it is {millimetres(foot)} mm. Give a point of the surface in "
                "grasp.contact_points.",
                finger=tip.name, quantity="contact point", value=gap,
            )  # fmt: skip
        found.append(world.shape.face_at(point))
    return found


def solve_grasp(
    world: World,
    fingertips: Sequence[Fingertip],
    contact_points: Sequence[ArrayLike],
    internal_force: ArrayLike,
    position: ArrayLike,
    rotation: Array,
    joint_guess: ArrayLike | None = None,
    known: Mapping[Law, CompiledLaw] | None = None,
    reach: Reach = "fingers",
) -> Grasp:
    """Joint angles and deformations in equilibrium with gravity, without stored torsion.

    The contact forces are f_C = K f_N + (J_O^fT)^+ N_O, (57) with tau_C = 0. Each tip then solves for the deformation
    that the law answers with that force, and for the joint angles that put it there. Where laws have moments, these are
    part of what carries the object: forces, deformations and moments are found in turn, see `statics.contact_loads`.

    Args:
        world: hand and object.
        fingertips: law, friction and face of each tip.
        contact_points: in the object frame [m], one a tip.
        internal_force: f_N [N], one a pair of contacts, in the order of `contact_pairs`.
        position: of the object frame in the world [m].
        rotation: axes of the object frame in the world, shape (3, 3).
        joint_guess: where the inverse kinematics starts [rad], shape (n,); the middle of the joint limits if None.
            With coupled joints these are of the motors, and points and object may be moved, see `settle_together`.
            A finger of more than three joints stays as near as it can, each joint measured by its range.
        known: laws that are compiled, to be quick.
        reach: `fingers`: joints that move several tips, those of a wrist or an arm, stay at the guess; `all`: they move
            so that the fingers are as near to the guess as they can, see `reach_together`.

    Raises:
        GraspError: out of reach, a pulling contact, friction use above 1, Phi at the rim or the apex, a joint or a
            torque beyond its limit, or a weight that the contacts cannot carry. Names the finger and the figure.
    """
    position, rotation = np.asarray(position, dtype=float), np.asarray(rotation, dtype=float)
    points = [position + rotation @ np.asarray(point, dtype=float) for point in contact_points]
    guess = initial_joints(world, joint_guess)
    arm, leaning = Arm(world), Leaning(world, fingertips)
    nc = world.n_tips
    deformation, contact_angles, contact_force = np.zeros((nc, 4)), np.zeros((nc, 2)), np.zeros((nc, 4))
    law_force = np.zeros((nc, 4))
    code = _compiled_laws(fingertips, known or {})
    elements = [np.zeros((fingertip.elements, STORED + REMEMBERED + LEANING)) for fingertip in fingertips]
    settled = [
        Settled(deformation[i], contact_angles[i], contact_force[i], law_force[i], elements[i]) for i in range(nc)
    ]
    asked = points, position, rotation
    for _ in range(TURNS):
        angles, (points, position, rotation) = guess.copy(), asked
        normals = np.array([rotation @ fingertip.face.normal for fingertip in fingertips])
        forces = contact_loads(world, points, position, rotation, internal_force, leaning.wrench, -normals)
        for tip, fingertip, normal, force in zip(world.tips, fingertips, normals, forces[:, :3], strict=True):
            check_friction(
                tip.name, fingertip.friction_at_start(world.shape.rotation), -float(normal @ force), force, normal
            )
        try:
            if reach == "all" and world.coupling is None and shared_columns(world.tips):
                place_palm(arm, fingertips, points, rotation, angles)
            found = _settled(
                arm, fingertips, code, contact_points, internal_force, points, position, rotation, forces, angles,
                settled, leaning.wrench,
            )  # fmt: skip
        except GraspError as error:
            if error.quantity not in ("reach", "joints") or not _is_bound(arm, guess):
                raise
            try:
                found = settle_together(
                    arm, fingertips, code, contact_points, internal_force, position, rotation, guess, settled,
                    leaning.wrench,
                )  # fmt: skip
            except GraspError:
                raise error from None
        if found is not None:
            angles, forces, position, rotation = found.angles, found.forces, found.position, found.rotation
            points = list(position + found.points @ rotation.T)
        arm.move(angles)
        q = arm.q.copy()
        world.set_object_pose(position, rotation, q)
        if not leaning.are_any or leaning.update(q, _memory(fingertips, settled, leaning.slopes), forces):
            break
    else:
        raise GraspError(
            "the moments of the leaning tips and the contact forces do not come into balance: "
            f"{leaning.change:.2g} N are left. Lower grasp.internal_force, or move the contact points to where the "
            "tips lean less.",
            finger="", quantity="moment", value=leaning.change,
        )  # fmt: skip
    for tip, fingertip, point, own in zip(world.tips, fingertips, points, deformation, strict=True):
        there = rotation.T @ (point - position)
        check_touches_alone(tip.name, world.shape, there, fingertip.face.normal, fingertip.law.radius - own[0])
    check_torques(arm, forces, points, leaning.torque)
    friction = np.array([fingertip.friction_at_start(world.shape.rotation) for fingertip in fingertips])
    use = np.hypot(contact_force[:, 0], contact_force[:, 1]) / (friction * contact_force[:, 2])
    state = State(q, np.zeros(world.nv), _memory(fingertips, settled, leaning.slopes))
    return Grasp(state, deformation, contact_force, contact_angles, use, leaning.leant)


def _memory(fingertips: Sequence[Fingertip], settled: Sequence[Settled], slopes: Array) -> Array:
    """z of a state in which all is relaxed."""
    memory, block = np.zeros((len(fingertips), memory_size(fingertips))), block_size(fingertips)
    size = remembered_of(fingertips)
    for row, fingertip, one, slope in zip(memory, fingertips, settled, slopes, strict=True):
        if fingertip.elements == 1:
            one.elements[0] = np.concatenate([one.deformation[1:], one.law_force, slope])
        for k, element in enumerate(one.elements):
            own, remembered = row[k * block : (k + 1) * block], element[STORED : STORED + size]
            own[:STORED], own[STORED:] = element[:STORED], np.tile(remembered, (block - STORED) // size)
    return memory


def _settled(
    arm: Arm,
    fingertips: Sequence[Fingertip],
    code: Mapping[Law, CompiledLaw],
    contact_points: Sequence[ArrayLike],
    internal_force: ArrayLike,
    points: Sequence[Array],
    position: Array,
    rotation: Array,
    forces: Array,
    angles: Array,
    settled: Sequence[Settled],
    moments: Array,
) -> Together | None:
    """All fingers at once where their joints are coupled; else each by itself, which sets the angles."""
    if arm.world.coupling is not None:
        return settle_together(
            arm, fingertips, code, contact_points, internal_force, position, rotation, angles, settled, moments
        )
    for i, fingertip in enumerate(fingertips):
        frame = rotation @ np.column_stack([fingertip.face.tangent, -fingertip.face.normal])
        settle_finger(arm, i, fingertip, code.get(fingertip.law), points[i], frame, forces[i], angles, settled[i])
    return None


def _is_bound(arm: Arm, angles: Array) -> bool:
    """Whether some finger cannot come to any point near to it, with less than three joints or all in a plane."""
    world = arm.world
    if world.coupling is not None:
        return False
    arm.move(angles)
    for i in range(world.n_tips):
        columns = own_columns(world, i)
        sizes = np.linalg.svd(arm.point_jacobian(i, arm.tip(i)[0])[:, columns], compute_uv=False)
        if len(columns) < POINT or sizes[-1] < _IN_A_PLANE * sizes[0]:
            return True
    return False


def _compiled_laws(fingertips: Sequence[Fingertip], known: Mapping[Law, CompiledLaw]) -> dict[Law, CompiledLaw]:
    """Machine code of the laws; without those that cannot be compiled, which is told where they are to be."""
    code = {}
    for law in {fingertip.law for fingertip in fingertips}:
        with suppress(LawError):
            code[law] = compile_like(law, known)
    return code
