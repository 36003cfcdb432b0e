"""The start with open fingers: each tip stands off its contact point, the object stands on a table, all at rest."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from softhand.contact.pads import Fingertip, Support, memory_size
from softhand.errors import GraspError
from softhand.model.arm import Arm
from softhand.model.shapes.face import Face
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.numerics.roots import find_root
from softhand.plant.state import State
from softhand.start.grasp import Grasp
from softhand.start.reach import initial_joints, reach_point
from softhand.start.statics import check_torques

_MOVED = 1e-3  # [m] by which the object may be off the place where it stands
_TILTED = 0.02  # [rad] likewise
_BALANCED = 1e-12  # of the weight
_LEVEL = 1e-9  # sine of the angle between gravity and the normal of the table


def solve_open_start(
    world: World,
    fingertips: Sequence[Fingertip],
    contact_points: Sequence[ArrayLike],
    opening: float,
    position: ArrayLike,
    rotation: Array,
    supports: Sequence[Support] = (),
    joint_guess: ArrayLike | None = None,
) -> Grasp:
    """Joint angles that put each tip before its contact point, along the outward normal n of its face.

        p_F = p + (r + opening) n

    The contact points must be in reach as well. The object is moved to where it rests, see `resting_pose`.

    Args:
        world: hand and object.
        fingertips: law and face of each tip.
        contact_points: in the object frame [m], one a tip.
        opening: gap between tip and face [m], above 0.
        position: of the object frame in the world [m].
        rotation: axes of the object frame in the world, shape (3, 3).
        supports: whatever else may touch; corners of the object on a table carry it.
        joint_guess: as in `solve_grasp`.

    Raises:
        GraspError: a contact point or the place before it is out of reach, gravity asks for more torque than there
            is, or the object does not stand. Names the finger or the joint and the figure.
    """
    standing, axes = resting_pose(world, supports, np.asarray(position, dtype=float), rotation)
    guess, arm, nc = initial_joints(world, joint_guess), Arm(world), world.n_tips
    angles = guess.copy()
    for i, (fingertip, point) in enumerate(zip(fingertips, contact_points, strict=True)):
        touched, normal = standing + axes @ np.asarray(point, dtype=float), axes @ fingertip.face.normal
        for gap, place in ((0.0, "the contact point"), (opening, f"the start {1e3 * opening:.3g} mm before its face")):
            reach_point(arm, i, touched + (fingertip.law.radius + gap) * normal, angles, guess, place)
    arm.move(angles)
    check_torques(arm, np.zeros((nc, 3)), list(np.zeros((nc, 3))))
    q = arm.q.copy()
    world.set_object_pose(standing, axes, q)
    state = State(q, np.zeros(world.model.nv), np.zeros((nc, memory_size(fingertips))))
    return Grasp(state, np.zeros((nc, 4)), np.zeros((nc, 4)), np.zeros((nc, 2)), np.zeros(nc))


def resting_pose(world: World, supports: Sequence[Support], position: Array, rotation: Array) -> tuple[Array, Array]:
    """Where the object stands in equilibrium on the corners that a table carries, with nothing stored in shear.

    Height along the normal n of the table and two turns about axes in it, so that with the forces f_k of the corners
    x_k, the mass m and its centre c

        sum f_k = m |g|,   sum (x_k - c) x n f_k = 0

    Without gravity the pose stays.

    Args:
        world: with the object.
        supports: those between object and world are the corners.
        position: of the object frame [m], about where it stands.
        rotation: likewise, shape (3, 3).

    Returns:
        Position [m], shape (3,), and rotation, shape (3, 3).

    Raises:
        GraspError: there is no table, it is not level, or the object does not stand on it there.
    """
    inertia, gravity = world.model.inertias[world.object_joint], world.gravity
    weight = float(inertia.mass * np.linalg.norm(gravity))
    if weight == 0.0:
        return position, rotation
    corners = [support for support in supports if support.base == 0 and support.joint == world.object_joint]
    plane = corners[0].shape if corners else None
    if not isinstance(plane, Face):
        raise GraspError(
            "with grasp.opening no finger holds the object at the start, and it would fall; add a [table] below it.",
            finger="", quantity="support", value=0,
        )  # fmt: skip
    n = plane.normal
    slope = float(np.linalg.norm(np.cross(n, gravity))) / float(np.linalg.norm(gravity))
    if slope > _LEVEL or n @ gravity > 0.0:
        raise GraspError(
            "the object stands at the start only on a level table: table.normal must point against gravity; it is "
            f"{math.degrees(math.acos(min(max(-float(n @ gravity) / float(np.linalg.norm(gravity)), -1.0), 1.0))):.3g} "
            "deg off.",
            finger="", quantity="table.normal", value=slope,
        )  # fmt: skip
    places, radii = np.array([corner.position for corner in corners]), np.array([corner.radius for corner in corners])
    across = np.column_stack([plane.tangent, np.cross(n, plane.tangent)])
    size = max(float(np.ptp(places @ rotation.T @ across, axis=0).max()), float(radii.max()))

    def moved(step: Array) -> tuple[Array, Array]:
        return position + size * step[0] * n, pin.exp3(across @ step[1:]) @ rotation

    def excess(step: Array) -> Array:
        origin, axes = moved(step)
        arms = (places - inertia.lever) @ axes.T
        depths = plane.offset + radii - (origin + places @ axes.T) @ n
        forces = np.array([_pressing(corner, depth) for corner, depth in zip(corners, depths, strict=True)]) / weight
        moment = np.einsum("k,ki->i", forces, np.cross(arms, n)) / size
        return np.array([forces.sum() - 1.0, *(across.T @ moment)])

    def derivative(step: Array) -> Array:
        return np.column_stack([(excess(step + h) - excess(step - h)) / 2e-8 for h in 1e-8 * np.eye(3)])

    limit = np.array([_MOVED / size, _TILTED, _TILTED])
    gaps = (position + places @ rotation.T) @ n - plane.offset - radii
    sunk = np.array([-(gaps.min() + 1e-5) / size, 0.0, 0.0])
    step, left = find_root(excess, derivative, [sunk], -limit - abs(sunk[0]), limit + abs(sunk[0]), _BALANCED)
    if left > _BALANCED or np.any(np.abs(step) > limit):
        raise GraspError(
            f"the object does not stand on the table at object.position: its lowest corner is {1e3 * gaps.min():.3g} "
            f"mm above it; put it there within {1e3 * _MOVED:g} mm, flat within {math.degrees(_TILTED):.2g} deg.",
            finger="", quantity="height", value=float(gaps.min()),
        )  # fmt: skip
    return moved(step)


def _pressing(corner: Support, depth: float) -> float:
    """Normal force [N] of a corner at a depth [m]."""
    return float(corner.law((depth, 0.0, 0.0, 0.0), 0.5 * math.pi)[0]) if depth > 0.0 else 0.0
