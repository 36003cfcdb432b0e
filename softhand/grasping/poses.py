"""Which poses of its object a hand can hold with the contacts kept, as [Nakashima] section 5 asks.

As the paper has it, with rigid tips and contact points that do not change on the object. Then (13) and (16) with (14)
and (17) say where the centre of each tip must be,

    p_F = p_O + R_BO p_C + r n,   n = R_BO n_O the outward normal of the face

and three joints a finger follow from it. A pose can be held if each finger reaches its point within the joint limits
and touches with the hemisphere: Phi, the latitude of -n on the tip, stays between the rim and the apex, where laws in
polar coordinates end. A contact whose Theta is more than 90 deg from that of the start has gone past the apex: its Phi
is counted on, beyond 90 deg.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softhand.assembly.parts import read_laws
from softhand.assembly.plant import read_world
from softhand.errors import GraspError
from softhand.grasping.chains import LINK, finger_chain, require_uncoupled
from softhand.grasping.palm import standing_joints
from softhand.grasping.verdicts import Fingers, Verdict, Verdicts, judge_poses
from softhand.model.arm import Arm
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.scenario.scenario import Scenario
from softhand.start.answering import APEX, RIM
from softhand.start.grasp import faces_of

COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")


class Poses:
    """The fingers of a scenario at its start, ready to be asked about poses.

    Attributes:
        start: q_O of the start, position [m] and roll, pitch, yaw [rad], shape (6,).
        names: of the fingers.
        joint_names: of the own joints of each finger.
        fingers: as the kernels read them.

    Raises:
        GraspError: a rigid tip does not reach its contact at the start.
    """

    def __init__(self, scenario: Scenario, phi_range: tuple[float | None, float | None] = (None, None)) -> None:
        """Of a scenario; `phi_range` are the least and the greatest Phi [rad].

        Where they are None, the rim and the apex, or the rim on the other side for laws in surface coordinates.
        """
        world = read_world(scenario)
        require_uncoupled(world)
        points = np.array(scenario.grasp.contact_points)
        normals = np.array([face.normal for face in faces_of(world, scenario.grasp.contact_points)])
        laws = read_laws(scenario)
        radius = np.array([law.radius for law in laws])
        ends = [(RIM, APEX if law.coordinates == "polar" else math.pi - RIM) for law in laws]
        given = [[end if end is not None else usual for end, usual in zip(phi_range, own, strict=True)] for own in ends]
        self.start = np.array([*scenario.object.position, *scenario.object.rpy])
        self.names = tuple(tip.name for tip in world.tips)
        rotation = rotation_of(scenario.object.rpy)
        centres = self.start[:3] + (points + radius[:, None] * normals) @ rotation.T
        arm, angles = Arm(world), standing_joints(world, scenario)
        self._touch(arm, angles, centres, radius)
        sides = np.array([-(arm.tip(i)[1].T @ normal)[1:] for i, normal in enumerate(normals @ rotation.T)])
        chains = [finger_chain(world, i, angles) for i in range(world.n_tips)]
        self.joint_names = tuple(tuple(world.joint_names[column] for column in columns) for _, columns in chains)
        self.fingers = Fingers(points, normals, radius, *_side_by_side(world, chains, angles), sides, np.array(given))

    def _touch(self, arm: Arm, angles: Array, centres: Array, radius: Array) -> None:
        """Put the tips at their contacts; sets `angles`."""
        for i, target in enumerate(centres):
            gap = arm.reach(i, target, angles)
            if gap > 1e-9:
                raise GraspError(
                    f"{self.names[i]}: a rigid tip of {1e3 * radius[i]:g} mm misses its contact at the start by "
                    f"{1e3 * gap:.3g} mm. Move the object, or give another grasp.joint_guess.",
                    finger=self.names[i], quantity="reach", value=gap,
                )  # fmt: skip
        arm.move(angles)

    def judge(self, poses: ArrayLike) -> Verdicts:
        """Which poses can be held.

        Args:
            poses: q_O, position [m] and roll, pitch, yaw [rad], shape (poses, 6).
        """
        poses = np.ascontiguousarray(np.atleast_2d(poses), dtype=float)
        verdict, finger, joint = (np.full(len(poses), value, dtype=np.int64) for value in (0, -1, -1))
        judge_poses(poses, self.start, self.fingers, verdict, finger, joint)
        return Verdicts(verdict, finger, joint)

    def describe(self, verdicts: Verdicts, index: int = 0) -> str:
        """One answer in words."""
        kind, finger = Verdict(verdicts.verdict[index]), verdicts.finger[index]
        if kind is Verdict.HELD:
            return "held"
        name = self.names[finger]
        if kind is Verdict.LIMIT:
            return f"limit of {self.joint_names[finger][verdicts.joint[index]]}"
        return {Verdict.REACH: f"{name} out of reach", Verdict.RIM: f"{name} at its rim",
                Verdict.APEX: f"{name} at its apex"}[kind]  # fmt: skip

    def map(
        self, first: int, second: int, half: ArrayLike, count: int, others: ArrayLike | None = None
    ) -> tuple[Array, Array, Verdicts]:
        """A plane of poses about the start.

        Args:
            first: coordinate along the rows of the result, 0 to 5.
            second: coordinate along its columns.
            half: how far to go on both sides [m, rad], shape (2,).
            count: points in each direction.
            others: added to all poses, shape (6,).

        Returns:
            Moves of the first and of the second coordinate, shape (count,) each, and the verdicts row by row.
        """
        half = np.asarray(half, dtype=float)
        one, two = (np.linspace(-end, end, count) for end in half)
        poses = np.tile(self.start + (0.0 if others is None else np.asarray(others)), (count * count, 1))
        poses[:, first] += np.repeat(one, count)
        poses[:, second] += np.tile(two, count)
        return one, two, self.judge(poses)


def _side_by_side(
    world: World, chains: list[tuple[NDArray[np.void], list[int]]], angles: Array
) -> tuple[NDArray[np.void], NDArray[np.int64], Array, Array, Array]:
    """Links, joints, angles, lower and upper of `Fingers`, filled up to the longest finger."""
    lower, upper = world.position_limits
    count, width = len(chains), max(len(columns) for _, columns in chains)
    links, padded = np.zeros((count, width + 1), LINK), np.zeros((3, count, width))
    for i, (chain, columns) in enumerate(chains):
        links[i, : len(chain)] = chain
        padded[:, i, : len(columns)] = angles[columns], lower[columns], upper[columns]
    return links, np.array([len(columns) for _, columns in chains]), *padded
