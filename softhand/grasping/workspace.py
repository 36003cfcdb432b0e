"""The object poses that a hand can hold with the contacts kept: the workspace of [Nakashima] section 5.

As the paper has it, with rigid tips and contact points that do not change on the object. Then (13) and (16) with (14)
and (17) say where the centre of each tip must be,

    p_F = p_O + R_BO p_C + r n,   n = R_BO n_O the outward normal of the face

and three joints a finger follow from it. A pose can be held if each finger reaches its point within the joint limits
and touches with the hemisphere: Phi, the latitude of -n on the tip, stays between the rim and the apex. A contact whose
Theta is more than 90 deg from that of the start has gone past the apex: its Phi is counted on, beyond 90 deg.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softhand.assembly.parts import read_laws
from softhand.assembly.plant import read_world
from softhand.errors import GraspError
from softhand.grasping.chains import LINK, finger_chain, reach
from softhand.model.arm import Arm
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.spatial import rotation_of
from softhand.scenario.scenario import Scenario
from softhand.start.grasp import faces_of
from softhand.start.press import APEX, RIM

_STEPS = 6  # from the start to a pose: the elbow stays on its side
_FINEST = 1e-4  # share of the range at which the end of a range is found

PAPER_POSITION = 0.020  # [m]
PAPER_ANGLE = math.radians(30.0)
"""What the paper says: a conservative workspace of +-2 cm and +-30 deg from the start."""

COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")


class Verdict(IntEnum):
    """Why a pose can be held or not; the first thing that fails on the way of the first finger that fails."""

    HELD = 0
    REACH = 1
    LIMIT = 2
    RIM = 3
    APEX = 4


@dataclass(frozen=True, eq=False)
class Verdicts:
    """Answers for some poses.

    Attributes:
        verdict: a `Verdict` each, shape (poses,).
        finger: which finger fails, -1 if none, shape (poses,).
        joint: which of its own joints is at a limit, -1 if none, shape (poses,).
    """

    verdict: NDArray[np.int64]
    finger: NDArray[np.int64]
    joint: NDArray[np.int64]

    @property
    def held(self) -> NDArray[np.bool_]:
        """Whether a pose can be held, shape (poses,)."""
        return self.verdict == Verdict.HELD


class Workspace:
    """The fingers of a scenario at its start, ready to be asked about poses.

    Attributes:
        start: q_O of the start, position [m] and roll, pitch, yaw [rad], shape (6,).
        names: of the fingers.
        joint_names: of the own joints of each finger.

    Raises:
        GraspError: a rigid tip does not reach its contact at the start.
    """

    def __init__(self, scenario: Scenario, phi_range: tuple[float, float] = (RIM, APEX)) -> None:
        """Of a scenario; `phi_range` are the least and the greatest Phi [rad]."""
        world = read_world(scenario)
        faces = faces_of(world, scenario.grasp.contact_points)
        self.start = np.array([*scenario.object.position, *scenario.object.rpy])
        self.names = tuple(tip.name for tip in world.tips)
        self._radius = np.array([law.radius for law in read_laws(scenario)])
        self._phi_range = phi_range
        self._points = np.array(scenario.grasp.contact_points)
        self._normals = np.array([face.normal for face in faces])
        lower, upper = world.position_limits
        guess = scenario.grasp.joint_guess
        middle = np.where(np.isfinite(lower + upper), 0.5 * (lower + upper), 0.0)
        angles = np.clip(np.array(guess), lower, upper) if guess is not None else middle
        arm = Arm(world)
        for i, target in enumerate(self._centres(self.start)):
            gap = arm.reach(i, target, angles)
            if gap > 1e-9:
                raise GraspError(
                    f"{self.names[i]}: a rigid tip of {1e3 * self._radius[i]:g} mm misses its contact at the start by "
                    f"{1e3 * gap:.3g} mm. Move the object, or give another grasp.joint_guess.",
                    finger=self.names[i], quantity="reach", value=gap,
                )  # fmt: skip
        arm.move(angles)
        outward = self._normals @ rotation_of(self.start[3:].tolist()).T
        self._sides = np.array([-(arm.tip(i)[1].T @ normal)[1:] for i, normal in enumerate(outward)])
        chains = [finger_chain(world, i, angles) for i in range(len(self.names))]
        width = max(len(columns) for _, columns in chains)
        count = len(chains)
        self._joints = np.array([len(columns) for _, columns in chains])
        self._links = np.zeros((count, width + 1), LINK)
        self._angles, self._lower, self._upper = (np.zeros((count, width)) for _ in range(3))
        for i, (links, columns) in enumerate(chains):
            self._links[i, : len(links)] = links
            self._angles[i, : len(columns)] = angles[columns]
            self._lower[i, : len(columns)], self._upper[i, : len(columns)] = lower[columns], upper[columns]
        self.joint_names = tuple(tuple(world.joint_names[column] for column in columns) for _, columns in chains)

    def _centres(self, q_O: Array) -> Array:
        """Centres of the tips at a pose [m], shape (nc, 3)."""
        rotation = rotation_of(q_O[3:].tolist())
        return q_O[:3] + (self._points + self._radius[:, None] * self._normals) @ rotation.T

    def judge(self, poses: ArrayLike) -> Verdicts:
        """Which poses can be held.

        Args:
            poses: q_O, position [m] and roll, pitch, yaw [rad], shape (poses, 6).
        """
        poses = np.ascontiguousarray(np.atleast_2d(poses), dtype=float)
        verdict, finger, joint = (np.full(len(poses), value, dtype=np.int64) for value in (0, -1, -1))
        _judge(poses, self.start, self._points, self._normals, self._radius, self._links, self._joints, self._angles,
               self._lower, self._upper, self._sides, *self._phi_range, verdict, finger, joint)  # fmt: skip
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

    def ranges(self, most: ArrayLike = (0.1, 0.1, 0.1, math.pi, 0.49 * math.pi, math.pi)) -> list[Range]:
        """How far each coordinate of the object can go alone, from the start.

        Args:
            most: farthest that is tried [m, rad], shape (6,).
        """
        found = []
        for k, far in enumerate(np.asarray(most, dtype=float)):
            ends = [self._end(k, sign * far) for sign in (-1.0, 1.0)]
            found.append(Range(COORDINATES[k], ends[0][0], ends[1][0], ends[0][1], ends[1][1]))
        return found

    def _end(self, coordinate: int, far: float) -> tuple[float, str]:
        """Where a line of poses ends, seen from the start, and why."""
        shares = np.linspace(0.0, 1.0, 201)[1:]
        verdicts = self.judge(self._along(coordinate, far * shares))
        if verdicts.held.all():
            return far, "not reached"
        first = int(np.argmin(verdicts.held))
        low, high, why = (shares[first - 1] if first else 0.0), shares[first], self.describe(verdicts, first)
        while high - low > _FINEST:
            middle = 0.5 * (low + high)
            verdicts = self.judge(self._along(coordinate, np.array([far * middle])))
            if verdicts.held[0]:
                low = middle
            else:
                high, why = middle, self.describe(verdicts)
        return far * low, why

    def _along(self, coordinate: int, moves: Array) -> Array:
        poses = np.tile(self.start, (len(moves), 1))
        poses[:, coordinate] += moves
        return poses

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

    def share(
        self,
        position: float = PAPER_POSITION,
        angle: float = PAPER_ANGLE,
        samples: int = 20000,
        progress: Callable[[float], None] | None = None,
    ) -> tuple[float, dict[str, float]]:
        """Share of a box of poses about the start that can be held, and what stops the others.

        Args:
            position: half the box along x, y and z [m].
            angle: half the box in roll, pitch and yaw [rad].
            samples: poses, spread evenly by a Sobol sequence (rounded up to a power of two), and the 64 corners.
            progress: called with the number of poses done.

        Returns:
            The share held, and the shares stopped by each reason, the most frequent first.
        """
        poses = self.start + np.array([position] * 3 + [angle] * 3) * _spread(samples)
        reasons: dict[str, int] = {}
        held = 0
        for begin in range(0, len(poses), 1024):
            verdicts = self.judge(poses[begin : begin + 1024])
            held += int(verdicts.held.sum())
            for index in np.flatnonzero(~verdicts.held):
                why = self.describe(verdicts, int(index))
                reasons[why] = reasons.get(why, 0) + 1
            if progress is not None:
                progress(float(min(begin + 1024, len(poses))))
        ordered = sorted(reasons.items(), key=lambda item: -item[1])
        return held / len(poses), {why: count / len(poses) for why, count in ordered}

    def largest_box(self, position: float = PAPER_POSITION, angle: float = PAPER_ANGLE, samples: int = 4096) -> float:
        """Largest factor, up to 1, on a box of poses within which all of some spread poses and the corners are held."""
        moves = np.array([position] * 3 + [angle] * 3) * _spread(samples)
        low, high = 0.0, 1.0
        if self.judge(self.start + moves).held.all():
            return 1.0
        while high - low > 1e-3:
            middle = 0.5 * (low + high)
            if self.judge(self.start + middle * moves).held.all():
                low = middle
            else:
                high = middle
        return low


def _spread(samples: int) -> Array:
    """Points of [-1, 1]^6: the corners and a Sobol sequence, shape (points, 6)."""
    from scipy.stats import qmc

    corners = np.array(list(product((-1.0, 1.0), repeat=6)))
    return np.vstack([corners, 2.0 * qmc.Sobol(6, seed=0).random_base2(math.ceil(math.log2(samples))) - 1.0])


@dataclass(frozen=True)
class Range:
    """How far one coordinate of the object can go alone.

    Attributes:
        name: of `COORDINATES`.
        lower: most negative move [m or rad].
        upper: most positive move.
        lower_end: what ends it there.
        upper_end: what ends it here.
    """

    name: str
    lower: float
    upper: float
    lower_end: str
    upper_end: str


@compiled
def _judge(
    poses, start, points, normals, radius, links, joints, angles, lower, upper, sides, phi_min, phi_max, verdict,
    finger, joint,
):  # fmt: skip
    pose, now, target = np.empty(6), np.empty(angles.shape[1]), np.empty(3)
    rotation, axes, normal = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for k in range(poses.shape[0]):
        for i in range(points.shape[0]):
            count = joints[i]
            own = now[:count]
            for m in range(count):
                own[m] = angles[i, m]
            reached = True
            for step in range(1, _STEPS + 1):
                share = step / _STEPS
                for m in range(6):
                    pose[m] = start[m] + share * (poses[k, m] - start[m])
                _rotate(pose, rotation)
                for m in range(3):
                    target[m], normal[m] = pose[m], 0.0
                    for n in range(3):
                        normal[m] += rotation[m, n] * normals[i, n]
                        target[m] += rotation[m, n] * (points[i, n] + radius[i] * normals[i, n])
                reached = reach(links[i], target, own, axes)
                if not reached:
                    break
            # -n in F: its first component is sin Phi, the others are along (cos Theta, sin Theta)
            x = -(axes[0, 0] * normal[0] + axes[1, 0] * normal[1] + axes[2, 0] * normal[2])
            y = -(axes[0, 1] * normal[0] + axes[1, 1] * normal[1] + axes[2, 1] * normal[2])
            z = -(axes[0, 2] * normal[0] + axes[1, 2] * normal[1] + axes[2, 2] * normal[2])
            Phi = math.atan2(x, math.hypot(y, z))
            if y * sides[i, 0] + z * sides[i, 1] < 0.0:
                Phi = math.pi - Phi
            outcome, which = 0, -1
            if not reached:
                outcome = 1
            else:
                for m in range(count):
                    if not lower[i, m] <= own[m] <= upper[i, m]:
                        outcome, which = 2, m
                        break
                if outcome == 0 and Phi < phi_min:
                    outcome = 3
                if outcome == 0 and Phi > phi_max:
                    outcome = 4
            if outcome != 0:
                verdict[k], finger[k], joint[k] = outcome, i, which
                break


@compiled
def _rotate(pose, rotation):
    """R = R_z(yaw) R_y(pitch) R_x(roll)."""
    a, b, c = math.cos(pose[3]), math.cos(pose[4]), math.cos(pose[5])
    i, j, k = math.sin(pose[3]), math.sin(pose[4]), math.sin(pose[5])
    rotation[0, 0], rotation[0, 1], rotation[0, 2] = c * b, c * j * i - k * a, c * j * a + k * i
    rotation[1, 0], rotation[1, 1], rotation[1, 2] = k * b, k * j * i + c * a, k * j * a - c * i
    rotation[2, 0], rotation[2, 1], rotation[2, 2] = -j, b * i, b * a
