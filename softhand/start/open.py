"""The start with open fingers: each tip stands off its contact point, the object rests by itself, all is still."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from softhand.contact.pads import Fingertip, Support
from softhand.errors import GraspError
from softhand.model.arm import Arm
from softhand.model.joined import shared_columns
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.start.grasp import Grasp
from softhand.start.reach import Reach, initial_joints, place_palm, reach_point
from softhand.start.rest import Rest, resting_pose
from softhand.start.statics import check_torques
from softhand.start.together import open_together

_ROUNDS = 20  # in which the fingers follow the object, and the object the palms on their links
_STILL = 1e-12  # [m], and of the rotation


def solve_open_start(
    world: World,
    fingertips: Sequence[Fingertip],
    contact_points: Sequence[ArrayLike],
    opening: float,
    position: ArrayLike,
    rotation: ArrayLike,
    supports: Sequence[Support] = (),
    joint_guess: ArrayLike | None = None,
    reach: Reach = "fingers",
    standoff: ArrayLike = (0.0, 0.0, 0.0),
) -> Grasp:
    """Joint angles that put each tip before its contact point, along the outward normal n of its face.

        p_F = p + (r + opening) n + standoff

    The contact points must be in reach as well. With coupled joints the tips stand as `open_together` puts them. The
    object is moved to where it rests, see `resting_pose`.

    Args:
        world: hand and object.
        fingertips: law and face of each tip.
        contact_points: in the object frame [m], one a tip.
        opening: gap between tip and face [m], above 0.
        position: of the object frame in the world [m].
        rotation: axes of the object frame in the world, shape (3, 3).
        supports: whatever else may touch; a table and palms carry the object.
        joint_guess: as in `solve_grasp`.
        reach: likewise.
        standoff: of the whole hand from there, in the world [m], shape (3,).

    Raises:
        GraspError: a contact point or the place before it is out of reach, gravity asks for more torque than there
            is, or the object does not rest there. Names the finger or the joint and the figure.
    """
    guess, arm, nc = initial_joints(world, joint_guess), Arm(world), world.n_tips
    away = np.asarray(standoff, dtype=float)
    plant, angles = Plant(world, fingertips, supports), guess.copy()
    about = np.asarray(position, dtype=float), np.asarray(rotation, dtype=float)
    pose = _rest(plant, arm, angles, about)
    for _ in range(_ROUNDS):
        angles[:] = guess
        if world.coupling is not None:
            open_together(arm, fingertips, contact_points, opening, pose.position + away, pose.rotation, angles)
        else:
            points = [pose.position + pose.rotation @ np.asarray(point, dtype=float) for point in contact_points]
            _open_fingers(arm, fingertips, points, opening, pose.rotation, angles, guess, reach == "all", away)
        last, pose = pose, _rest(plant, arm, angles, about)
        if max(np.max(np.abs(now - before)) for now, before in zip(pose[:2], last[:2], strict=True)) <= _STILL:
            break
    else:
        raise GraspError(
            "the object does not come to rest on a palm that moves with the finger which reaches for it; put the palm "
            "on another link.",
            finger="", quantity="rest", value=_ROUNDS,
        )  # fmt: skip
    arm.move(angles)
    check_torques(arm, np.zeros((nc, 3)), list(np.zeros((nc, 3))))
    q = arm.q.copy()
    world.set_object_pose(pose.position, pose.rotation, q)
    z = np.zeros((len(plant.contacts), plant.n_memory))
    z[nc:, :3] = pose.stored
    state = State(q, np.zeros(world.nv), z)
    return Grasp(state, np.zeros((nc, 4)), np.zeros((nc, 4)), np.zeros((nc, 2)), np.zeros(nc))


def _rest(plant: Plant, arm: Arm, angles: Array, about: tuple[Array, Array]) -> Rest:
    """Where the object rests with the joints at these angles."""
    arm.move(angles)
    q = arm.q.copy()
    plant.world.set_object_pose(*about, q)
    return resting_pose(plant, q)


def _open_fingers(
    arm: Arm, fingertips: Sequence[Fingertip], points: Sequence[Array], opening: float, rotation: Array, angles: Array,
    guess: Array, with_palm: bool, away: Array,
) -> None:  # fmt: skip
    """Put the tips before their contact points, with the palm where it would be if they touched; sets the angles."""
    with_palm = with_palm and bool(shared_columns(arm.world.tips))
    outward = [rotation @ tip.face.normal for tip in fingertips]
    radii, nowhere, wish = [tip.law.radius for tip in fingertips], np.zeros(3), guess
    if with_palm:
        place_palm(arm, fingertips, points, rotation, angles)
        wish = angles.copy()
    start = f"the start {1e3 * opening:.3g} mm before its face"
    ways = [(0.0, nowhere, "the contact point"), (opening, nowhere if with_palm else away, start)]
    for gap, way, place in ways:
        for i, (point, radius, normal) in enumerate(zip(points, radii, outward, strict=True)):
            reach_point(arm, i, point + (radius + gap) * normal + way, angles, wish, place)
    if with_palm and away.any():
        place_palm(arm, fingertips, [point + away for point in points], rotation, angles, opening, "the standoff")
