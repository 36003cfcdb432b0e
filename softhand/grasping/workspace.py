"""How far the object can be moved with the contacts kept: the workspace of [Nakashima] section 5."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from softhand.errors import ScenarioError
from softhand.grasping.poses import COORDINATES, Poses
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.scenario.scenario import Scenario

PAPER_POSITION = 0.020  # [m]
PAPER_ANGLE = math.radians(30.0)
"""What the paper says: a conservative workspace of +-2 cm and +-30 deg from the start."""

POSES = 32768
"""That `workspace` asks for."""

_FINEST = 1e-4  # share of the range at which the end of a range is found
_FARTHEST = (0.1, 0.1, 0.1, math.pi, 0.49 * math.pi, math.pi)  # [m, rad] that is tried
_MOST_REASONS = 3  # that are told


@dataclass(frozen=True)
class Range(Record):
    """How far one coordinate of the object can go alone.

    Attributes:
        name: of `COORDINATES`.
        lower: most negative move [m or rad].
        upper: most positive move.
        lower_end: what ends it there.
        upper_end: what ends it here.
    """

    units: ClassVar = {"lower": "m, rad of roll, pitch, yaw", "upper": "m, rad of roll, pitch, yaw"}

    name: str
    lower: float
    upper: float
    lower_end: str
    upper_end: str

    def rows(self) -> list[tuple[str, str]]:
        """Both ends, beside the paper's."""
        is_length = self.name in "xyz"
        scale, unit, paper = (1e3, "mm", PAPER_POSITION) if is_length else (180.0 / math.pi, "deg", PAPER_ANGLE)
        found = []
        for end, far, why in (("-", self.lower, self.lower_end), ("+", self.upper, self.upper_end)):
            short = ", less than the paper's" if abs(far) < paper else ""
            found.append((f"{end}{self.name} alone", f"{scale * far:+.1f} {unit}  ({why}{short})"))
        return found


@dataclass(frozen=True, eq=False)
class Workspace(Record):
    """The object poses about the start of a scenario that can be held with the contacts kept.

    Attributes:
        poses: that can be asked for more.
        ranges: how far each coordinate can go alone.
        held: share of the poses within +-2 cm and +-30 deg, the paper's workspace, that can be held.
        reasons: shares stopped by each reason, the most frequent first.
        position: half the largest box of the same proportions within which all poses are held, x, y and z [m].
        angle: the same of roll, pitch and yaw [rad].
    """

    units: ClassVar = {"held": "1", "reasons": "1", "position": "m", "angle": "rad"}
    unreported: ClassVar = frozenset({"poses"})

    poses: Poses
    ranges: tuple[Range, ...]
    held: float
    reasons: dict[str, float]
    position: float
    angle: float

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of each line of the table."""
        rows = [row for way in self.ranges for row in way.rows()]
        box = f"±{1e3 * PAPER_POSITION:g} mm, ±{math.degrees(PAPER_ANGLE):g} deg"
        rows.append((f"held within {box}", f"{100.0 * self.held:.1f} % of all poses"))
        for k, (why, share) in enumerate(list(self.reasons.items())[:_MOST_REASONS]):
            rows.append(("" if k else "of the others", f"{100.0 * share:.1f} %  {why}"))
        rows.append(("all held within", f"±{1e3 * self.position:.3g} mm, ±{math.degrees(self.angle):.3g} deg"))
        return rows


def workspace(
    scenario: Scenario,
    phi_range: tuple[float | None, float | None] = (None, None),
    progress: Callable[[float], None] | None = None,
) -> Workspace:
    """The poses of the object that can be held with the contacts kept, with rigid tips, beside the paper's.

    Args:
        scenario: with a grasp.
        phi_range: least and greatest contact angle [rad], 0 at the rim of the tip, pi / 2 at its apex; where None, from
            the rim to the apex, or to the rim on the other side for laws in surface coordinates, which have no pole.
        progress: called with the number of poses done, of `POSES`.

    Raises:
        ScenarioError: the angles are not from 0 to pi, the first the smaller.
        GraspError: a rigid tip does not reach its contact at the start.
    """
    least, most = 0.0 if phi_range[0] is None else phi_range[0], math.pi if phi_range[1] is None else phi_range[1]
    if not 0.0 <= least < most <= math.pi:
        raise ScenarioError(
            f"--phi-min {math.degrees(least):g} and --phi-max {math.degrees(most):g} (phi_range, in radians) must be "
            "from 0 to 180 deg, the first the smaller.",
            key="phi", value=phi_range,
        )  # fmt: skip
    poses = Poses(scenario, phi_range)
    held, reasons = share_held(poses, samples=POSES, progress=progress)
    factor = largest_box(poses)
    return Workspace(poses, ranges(poses), held, reasons, factor * PAPER_POSITION, factor * PAPER_ANGLE)


def ranges(poses: Poses, most: ArrayLike = _FARTHEST) -> tuple[Range, ...]:
    """How far each coordinate of the object can go alone, from the start.

    Args:
        poses: of a scenario.
        most: farthest that is tried [m, rad], shape (6,).
    """
    found = []
    for k, far in enumerate(np.asarray(most, dtype=float)):
        (lower, lower_end), (upper, upper_end) = (_end(poses, k, sign * far) for sign in (-1.0, 1.0))
        found.append(Range(COORDINATES[k], lower, upper, lower_end, upper_end))
    return tuple(found)


def _end(poses: Poses, coordinate: int, far: float) -> tuple[float, str]:
    """Where a line of poses ends, seen from the start, and why."""

    def along(moves: Array) -> Array:
        line = np.tile(poses.start, (len(moves), 1))
        line[:, coordinate] += moves
        return line

    shares = np.linspace(0.0, 1.0, 201)[1:]
    verdicts = poses.judge(along(far * shares))
    if verdicts.held.all():
        return far, "not reached"
    first = int(np.argmin(verdicts.held))
    low, high, why = (shares[first - 1] if first else 0.0), shares[first], poses.describe(verdicts, first)
    while high - low > _FINEST:
        middle = 0.5 * (low + high)
        verdicts = poses.judge(along(np.array([far * middle])))
        if verdicts.held[0]:
            low = middle
        else:
            high, why = middle, poses.describe(verdicts)
    return float(far * low), why


def share_held(
    poses: Poses,
    position: float = PAPER_POSITION,
    angle: float = PAPER_ANGLE,
    samples: int = 20000,
    progress: Callable[[float], None] | None = None,
) -> tuple[float, dict[str, float]]:
    """Share of a box of poses about the start that can be held, and what stops the others.

    Args:
        poses: of a scenario.
        position: half the box along x, y and z [m].
        angle: half the box in roll, pitch and yaw [rad].
        samples: poses, spread evenly by a Sobol sequence (rounded up to a power of two), and the 64 corners.
        progress: called with the number of poses done.

    Returns:
        The share held, and the shares stopped by each reason, the most frequent first.
    """
    asked = poses.start + np.array([position] * 3 + [angle] * 3) * _spread(samples)
    reasons: dict[str, int] = {}
    held = 0
    for begin in range(0, len(asked), 1024):
        verdicts = poses.judge(asked[begin : begin + 1024])
        held += int(verdicts.held.sum())
        for index in np.flatnonzero(~verdicts.held):
            why = poses.describe(verdicts, int(index))
            reasons[why] = reasons.get(why, 0) + 1
        if progress is not None:
            progress(float(min(begin + 1024, len(asked))))
    ordered = sorted(reasons.items(), key=lambda item: -item[1])
    return held / len(asked), {why: count / len(asked) for why, count in ordered}


def largest_box(
    poses: Poses, position: float = PAPER_POSITION, angle: float = PAPER_ANGLE, samples: int = 4096
) -> float:
    """Largest factor, up to 1, on a box of poses within which all of some spread poses and the corners are held."""
    moves = np.array([position] * 3 + [angle] * 3) * _spread(samples)
    low, high = 0.0, 1.0
    if poses.judge(poses.start + moves).held.all():
        return 1.0
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        if poses.judge(poses.start + middle * moves).held.all():
            low = middle
        else:
            high = middle
    return low


def _spread(samples: int) -> Array:
    """Points of [-1, 1]^6: the corners and a Sobol sequence, shape (points, 6)."""
    from scipy.stats import qmc

    corners = np.array(list(product((-1.0, 1.0), repeat=6)))
    return np.vstack([corners, 2.0 * qmc.Sobol(6, seed=0).random_base2(math.ceil(math.log2(samples))) - 1.0])
