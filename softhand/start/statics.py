"""Forces and torques of a grasp at rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from softhand.contact.grasp_map import grasp_map
from softhand.contact.pairs import contact_pairs
from softhand.errors import GraspError
from softhand.model.arm import Arm
from softhand.model.world import World, slides_of
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import cross_matrix

_FARTHEST = 1e6  # [m]


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
    nothing = np.zeros(6), np.zeros((len(points), 3))
    return contact_loads(world, points, position, rotation, internal_force, *nothing)[:, :3]


def contact_loads(
    world: World,
    points: Sequence[Array],
    position: Array,
    rotation: Array,
    internal_force: ArrayLike,
    moments: Array,
    normals: Array,
) -> Array:
    """As `contact_forces`, where the moments of the tips carry some of the load already.

    What forces cannot carry then, as about the line between two contacts, torsions do, as small as they can be.

    Args:
        world: as there, like the next four.
        points: likewise.
        position: likewise.
        rotation: likewise.
        internal_force: likewise.
        moments: wrench on the object of all moments of the tips: force [N], moment about the object frame [N m] in the
            world, shape (6,).
        normals: into the object at the contacts, in the world, shape (nc, 3).

    Returns:
        Forces in the world [N], then the torsion about the normal [N m], shape (nc, 4).

    Raises:
        GraspError: the contacts cannot carry the load.
    """
    nc = len(points)
    inertia = world.model.inertias[world.object_joint]
    weight = -inertia.mass * world.model.gravity.linear
    load = np.concatenate([weight, cross_matrix(rotation @ inertia.lever) @ weight]) - moments
    G = grasp_map(np.array(points) - position)
    if not np.all(np.abs(G) <= _FARTHEST):
        raise GraspError(
            f"the contact points are {np.max(np.abs(G)):.3g} m away from the object; move them or the object.",
            finger="", quantity="reach", value=float(np.max(np.abs(G))),
        )  # fmt: skip
    inverse, torsions = np.linalg.pinv(G, rcond=1e-9), np.zeros(nc)
    carried = inverse @ load
    residual = G @ carried - load
    left_over = 1e-9 * (1.0 + np.linalg.norm(load))
    if np.any(moments) and not np.linalg.norm(residual) <= left_over:
        about = np.vstack([np.zeros((3, nc)), normals.T])
        torsions = np.linalg.lstsq(about - G @ (inverse @ about), -residual, rcond=1e-9)[0]
        load = load - about @ torsions
        carried = inverse @ load
        residual = G @ carried - load
    if not np.linalg.norm(residual) <= left_over:
        raise GraspError(
            f"the contacts cannot carry the object: {np.linalg.norm(residual[:3]):.3g} N and "
            f"{np.linalg.norm(residual[3:]):.3g} N m remain; move the contact points or add a finger.",
            finger="", quantity="residual load", value=residual,
        )  # fmt: skip
    forces = carried.reshape(nc, 3).copy()
    for (i, j), magnitude in zip(contact_pairs(nc), np.asarray(internal_force, dtype=float), strict=True):
        way = points[j] - points[i]
        pull = magnitude * (way / np.linalg.norm(way))
        forces[i] += pull
        forces[j] -= pull
    return np.column_stack([forces, torsions])


def check_friction(name: str, friction: float, pressing: float, force: Array, normal: Array) -> None:
    """GraspError unless a tip presses, and within its friction cone."""
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


def check_torques(arm: Arm, forces: Array, points: Sequence[Array], moments: Array | float = 0.0) -> None:
    """The joints can hold what the grasp asks of them, forces on the object and the torques that moments ask for."""
    world = arm.world
    torque = arm.gravity_torque() + moments
    for i, (force, point) in enumerate(zip(forces, points, strict=True)):
        torque += arm.point_jacobian(i, point).T @ force[:3]
    worst = int(np.argmax(np.abs(torque) / world.effort_limit))
    if abs(torque[worst]) > world.effort_limit[worst]:
        unit = "N" if slides_of(world)[worst] else "N m"
        raise GraspError(
            f"joint '{world.joint_names[worst]}' would need {torque[worst]:.3g} {unit} at the start; its effort limit "
            f"is {world.effort_limit[worst]:.3g} {unit}. Lower grasp.internal_force or the object's mass.",
            finger=world.joint_names[worst], quantity="torque", value=float(torque[worst]),
        )  # fmt: skip
