"""The grasp at rest from which a run starts: contact forces, deformations and joint angles in equilibrium."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from softhand.contact.kinematics import deformation_jacobian
from softhand.contact.pads import Fingertip, memory_size
from softhand.errors import GraspError, LawError
from softhand.laws.law import Law
from softhand.model.arm import REACHED, Arm
from softhand.model.shapes.face import Face
from softhand.model.world import World
from softhand.observation import contact_pairs
from softhand.plant import State
from softhand.roots import find_root

Array = NDArray[np.float64]

ON_SURFACE = 1e-6  # [m] a contact point may lie so far from the surface
_ANSWERED = 1e-9  # of the force
_WISHES = 4  # turns of the start solver in which a redundant finger seeks the guess
RIM = math.radians(1.0)
APEX = math.radians(89.0)
"""Phi of a start must lie between RIM and APEX: at 90 deg J_delta of the polar coordinates is singular. A law in
surface coordinates needs no such limit at the apex."""


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
    """

    state: State
    deformation: Array
    force: Array
    angles: Array
    friction_use: Array


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
        foot, _ = world.shape.nearest(point)
        gap = float(np.linalg.norm(foot - np.asarray(point, dtype=float)))
        if gap > ON_SURFACE:
            raise GraspError(
                f"{tip.name}: the contact point {_mm(point)} mm of the object frame is {1e3 * gap:.3g} mm off the "
                f"surface; the nearest point of it is {_mm(foot)} mm. Give a point of the surface in "
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
) -> Grasp:
    """Joint angles and deformations in equilibrium with gravity, without stored torsion.

    The contact forces are f_C = K f_N + (J_O^fT)^+ N_O, (57) with tau_C = 0. Each tip then solves for the deformation
    that the law answers with that force, and for the joint angles that put it there.

    Args:
        world: hand and object.
        fingertips: law, friction and face of each tip.
        contact_points: in the object frame [m], one a tip.
        internal_force: f_N [N], one a pair of contacts, in the order of `contact_pairs`.
        position: of the object frame in the world [m].
        rotation: axes of the object frame in the world, shape (3, 3).
        joint_guess: where the inverse kinematics starts [rad], shape (n,); the middle of the joint limits if None.
            Joints that move several tips (a wrist) stay there; a finger of more than three joints stays as near as
            it can, each joint measured by its range.

    Raises:
        GraspError: out of reach, a pulling contact, friction use above 1, Phi at the rim or the apex, a joint or a
            torque beyond its limit, or a weight that the contacts cannot carry. Names the finger and the figure.
    """
    position = np.asarray(position, dtype=float)
    points = [position + rotation @ np.asarray(point, dtype=float) for point in contact_points]
    forces = contact_forces(world, points, position, rotation, internal_force)
    normals = [rotation @ fingertip.face.normal for fingertip in fingertips]
    for tip, fingertip, normal, force in zip(world.tips, fingertips, normals, forces, strict=True):
        _check_friction(
            tip.name, fingertip.friction_at_start(world.shape.rotation), -float(normal @ force), force, normal
        )
    angles = initial_joints(world, joint_guess)
    arm = Arm(world)
    nc = world.n_tips
    deformation, contact_angles, contact_force = np.zeros((nc, 4)), np.zeros((nc, 2)), np.zeros((nc, 4))
    law_force = np.zeros((nc, 4))
    for i in range(nc):
        frame = rotation @ np.column_stack([fingertips[i].face.tangent, -fingertips[i].face.normal])
        deformation[i], contact_angles[i], contact_force[i], law_force[i] = _settle(
            arm, i, fingertips[i], points[i], frame, forces[i], angles
        )
    arm.move(angles)
    check_torques(arm, forces, points)
    q = arm.q.copy()
    q[-7:-4], q[-4:] = position, pin.Quaternion(rotation).coeffs()
    friction = np.array([fingertip.friction_at_start(world.shape.rotation) for fingertip in fingertips])
    use = np.hypot(contact_force[:, 0], contact_force[:, 1]) / (friction * contact_force[:, 2])
    memory = np.zeros((nc, memory_size(fingertips)))
    memory[:, :3] = deformation[:, 1:]
    relaxations = (memory.shape[1] - 3) // 4
    memory[:, 3 : 3 + 4 * relaxations] = np.tile(law_force, relaxations)  # all is relaxed
    state = State(q, np.zeros(world.model.nv), memory)
    return Grasp(state, deformation, contact_force, contact_angles, use)


def contact_forces(
    world: World, points: Sequence[Array], position: Array, rotation: Array, internal_force: ArrayLike
) -> Array:
    """Forces on the object at the contacts, f_C = K f_N + (J_O^fT)^+ N_O, (57) with tau_C = 0.

    Args:
        world: hand and object.
        points: of the contacts in the world [m], one a tip.
        position: of the object frame in the world [m].
        rotation: axes of the object frame in the world, shape (3, 3).
        internal_force: f_N [N], one a pair of contacts, in the order of `contact_pairs`.

    Returns:
        In the world [N], shape (nc, 3).

    Raises:
        GraspError: point contacts there cannot carry the weight.
    """
    nc = len(points)
    inertia = world.model.inertias[world.object_joint]
    weight = -inertia.mass * world.model.gravity.linear
    load = np.concatenate([weight, np.cross(rotation @ inertia.lever, weight)])
    grasp_map = np.hstack([np.vstack([np.eye(3), pin.skew(point - position)]) for point in points])
    carried = np.linalg.pinv(grasp_map, rcond=1e-9) @ load
    residual = grasp_map @ carried - load
    if np.linalg.norm(residual) > 1e-9 * (1.0 + np.linalg.norm(load)):
        raise GraspError(
            f"the contacts cannot carry the object: {np.linalg.norm(residual[:3]):.3g} N and "
            f"{np.linalg.norm(residual[3:]):.3g} N m remain; move the contact points or add a finger.",
            finger="", quantity="residual load", value=residual,
        )  # fmt: skip
    forces = carried.reshape(nc, 3).copy()
    for (i, j), magnitude in zip(contact_pairs(nc), np.asarray(internal_force, dtype=float), strict=True):
        direction = (points[j] - points[i]) / np.linalg.norm(points[j] - points[i])
        forces[i] += magnitude * direction
        forces[j] -= magnitude * direction
    return forces


def _check_friction(name: str, friction: float, pressing: float, force: Array, normal: Array) -> None:
    if pressing <= 0.0:
        raise GraspError(
            f"{name}: the contact would have to pull the object with {-pressing:.3g} N; a fingertip only pushes. "
            "Raise grasp.internal_force or move the contact points.",
            finger=name, quantity="normal force", value=pressing,
        )  # fmt: skip
    use = float(np.linalg.norm(force - (normal @ force) * normal)) / (friction * pressing)
    if use > 1.0:
        raise GraspError(
            f"{name}: the start needs {use:.3g} times the available friction (mu = {friction:g}, "
            f"{pressing:.3g} N pressing). Raise grasp.internal_force or fingertip.friction, or move the points.",
            finger=name, quantity="friction use", value=use,
        )  # fmt: skip


def initial_joints(world: World, guess: ArrayLike | None) -> Array:
    """Where the inverse kinematics starts [rad], shape (n,); GraspError for a guess of another length."""
    lower, upper = world.position_limits
    if guess is None:
        return np.where(np.isfinite(lower + upper), 0.5 * (lower + upper), 0.0)
    angles = np.array(guess, dtype=float)
    if angles.shape != lower.shape:
        raise GraspError(
            f"grasp.joint_guess has {angles.size} angles; the hand has {lower.size} joints.",
            finger="", quantity="joints", value=angles.size,
        )  # fmt: skip
    return np.clip(angles, lower, upper)


def _settle(
    arm: Arm, index: int, fingertip: Fingertip, point: Array, frame: Array, force: Array, angles: Array
) -> tuple[Array, Array, Array, Array]:
    """Deformation, (Theta, Phi), contact force and force of the law of one finger; sets its joints in `angles`.

    `frame` has as columns the tangent and the inward normal of the face in the world.
    """
    name, law, guess = arm.world.tips[index].name, fingertip.law, angles.copy()
    is_surface = law.coordinates == "surface"
    tangent, z_C = frame.T
    deformation = np.zeros(4)
    for attempt in range(50):
        # after a few of them the depth is all but found, and the finger only follows it to the last digit
        wish = guess if attempt < _WISHES else None
        reach_point(arm, index, point - (law.radius - deformation[0]) * z_C, angles, wish)
        _, axes = arm.tip(index)
        u = axes.T @ z_C
        Theta, Phi = math.atan2(u[2], u[1]), math.asin(min(max(float(u[0]), -1.0), 1.0))
        if not RIM < Phi < (math.inf if is_surface else APEX):
            place = "rim of the flat face" if Phi <= RIM else "apex, where the paper's coordinates are singular"
            raise GraspError(
                f"{name}: the contact lies at Phi = {math.degrees(Phi):.1f} deg, at the {place}; a start needs "
                f"{math.degrees(RIM):.0f} to {90.0 if is_surface else math.degrees(APEX):.0f} deg. "
                "Move the object or the contact point.",
                finger=name, quantity="Phi", value=Phi,
            )  # fmt: skip
        x_C = tangent if is_surface else axes @ np.array([0.0, -math.sin(Theta), math.cos(Theta)])
        y_C = np.cross(z_C, x_C)
        bearing = math.atan2(axes[:, 0] @ y_C, axes[:, 0] @ x_C)
        wanted = np.array([x_C @ force, y_C @ force, z_C @ force, 0.0])
        previous = deformation
        deformation = _deform(name, law, Phi, bearing, wanted / fingertip.damping.relaxed())
        if np.max(np.abs(deformation - previous)) < 1e-14:
            break
    return deformation, np.array([Theta, Phi]), wanted, law(deformation, Phi, bearing)


def reach_point(
    arm: Arm, index: int, target: Array, angles: Array, wish: Array | None, place: str = "the contact point"
) -> None:
    """Set the joints of one finger so that its tip frame is at a point; see `Arm.reach` for the wish.

    Raises:
        GraspError: that is out of reach, or no joint moves this tip alone.
    """
    if not arm.own_columns(index):
        name = arm.world.tips[index].name
        raise GraspError(
            f"{name}: no joint moves this tip without another one. Give each tip a finger of its own in hand.tips.",
            finger=name, quantity="joints", value=0,
        )  # fmt: skip
    gap = arm.reach(index, target, angles, wish)
    if gap > REACHED:
        name, joints = arm.world.tips[index].name, len(arm.own_columns(index))
        few = f" with {joints} joint{'' if joints == 1 else 's'}, where any point needs 3" if joints < 3 else ""
        raise GraspError(
            f"{name}: {place} is out of reach by {1e3 * gap:.3g} mm within the joint limits{few}. "
            "Move the object or the contact point closer, or give another grasp.joint_guess.",
            finger=name, quantity="reach", value=gap,
        )  # fmt: skip


def _deform(name: str, law: Law, Phi: float, bearing: float, wanted: Array) -> Array:
    """The deformation that the law answers with a contact force, J_delta^-T dF = wanted."""
    is_surface = law.coordinates == "surface"
    J_delta = np.eye(4)[[1, 2, 0, 3]]
    tangential = law.radius if is_surface else 1.0
    lengths = np.array([law.radius, tangential, tangential, 1.0])
    size = law.radius / lengths * np.linalg.norm(wanted)

    def excess(scaled: Array) -> Array:
        deformation = scaled * lengths
        if not is_surface:
            deformation_jacobian(law.radius - deformation[0], math.sin(Phi), math.cos(Phi), J_delta)
        return (law(deformation, Phi, bearing) - J_delta.T @ wanted) / size

    def slope(scaled: Array) -> Array:
        return np.column_stack([(excess(scaled + h) - excess(scaled - h)) / 2e-6 for h in 1e-6 * np.eye(4)])

    lower, upper = np.array([1e-6, -1.5, RIM - Phi, -3.0]), np.array([0.95, 1.5, math.pi - RIM - Phi, 3.0])
    if is_surface:
        lower[2], upper[2] = -1.5, 1.5
    depth = plain_depth(law, Phi, bearing, wanted[2])
    start = np.array([depth / law.radius, 0.0, 0.0, 0.0])
    if not np.all(np.isfinite(excess(start))):
        raise LawError(
            f"law '{type(law).__name__}' answers the plain compression dr = {1e3 * depth:.3g} mm of {name} with NaN or "
            "infinity; there is no start. Mend the formula, or lower grasp.internal_force.",
            law=type(law).__name__,
        )
    scaled, left = find_root(excess, slope, [start], lower, upper, _ANSWERED)
    if left > _ANSWERED:
        raise GraspError(
            f"{name}: no deformation of the tip answers with the force {np.round(wanted[:3], 3).tolist()} N "
            f"(the best is off by {left:.1e} of it). Lower grasp.internal_force or stiffen it.",
            finger=name, quantity="force", value=wanted,
        )  # fmt: skip
    return scaled * lengths


def plain_depth(law: Law, Phi: float, bearing: float, pressing: float) -> float:
    """dr [m], within 5 %, at which the law first answers with that normal force [N] without shear.

    A law may have a second answer with less depth and much more shear, which a start from no depth would find.
    """
    depth = 1e-3 * law.radius
    while depth < 0.9 * law.radius and law([depth, 0.0, 0.0, 0.0], Phi, bearing)[0] < pressing:
        depth *= 1.05
    return depth


def check_torques(arm: Arm, forces: Array, points: Sequence[Array]) -> None:
    """The joints can hold what the grasp asks of them."""
    world = arm.world
    torque = arm.gravity_torque()
    for i, (force, point) in enumerate(zip(forces, points, strict=True)):
        torque += arm.point_jacobian(i, point).T @ force
    worst = int(np.argmax(np.abs(torque) / world.effort_limit))
    if abs(torque[worst]) > world.effort_limit[worst]:
        raise GraspError(
            f"joint '{world.joint_names[worst]}' would need {torque[worst]:.3g} N m at the start; its effort limit is "
            f"{world.effort_limit[worst]:.3g} N m. Lower grasp.internal_force or the object's mass.",
            finger=world.joint_names[worst], quantity="torque", value=float(torque[worst]),
        )  # fmt: skip


def _mm(point: ArrayLike) -> str:
    return "(" + ", ".join(f"{1e3 * float(value):.4g}" for value in np.asarray(point)) + ")"
