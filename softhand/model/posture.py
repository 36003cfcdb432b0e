"""All joints of a hand at once, those of its wrist and arm among them, that put every tip at its place."""

from __future__ import annotations

import math

import numpy as np

from softhand.model.arm import REACHED, Arm
from softhand.model.joined import shared_columns
from softhand.numerics.arrays import Array
from softhand.numerics.least_on_roots import least_on_roots, root_within

SHARED = 100.0
"""How much farther a joint that moves several tips goes for the same cost."""

_STARTS = 12
_MARGIN = 1e-3  # of the range, so that a finger can settle


def reach_together(arm: Arm, targets: Array, guess: Array) -> tuple[Array, float]:
    """Angles of all joints that put every tip frame at its point, near to a guess and within the joint limits.

    A hand on an arm of six joints reaches the points in many ways, as the palm may stand elsewhere. Of these the one
    is taken that minimises

        sum over the joints of one finger ((q - guess) / range)^2
        + SHARED^-2 sum over joints that move several tips ((q - guess) / range)^2

    so the fingers keep the posture of the guess as well as they can, and the arm brings the palm to where they do; what
    is left free, as the elbow of an arm of seven joints, stays near the guess.

    Args:
        arm: of the hand; left at the angles that are returned.
        targets: of the tip frames in the world [m], shape (nc, 3).
        guess: of all joints [rad or m], shape (n,).

    Returns:
        The angles, shape (n,), and the largest distance of a tip that is left [m], at most `REACHED` if all are there.
    """
    world, (lower, upper) = arm.world, arm.limits
    size = np.where(np.isfinite(upper - lower), upper - lower, 2.0 * math.pi)
    lower, upper = lower + _MARGIN * size, upper - _MARGIN * size
    shared = shared_columns(world.tips)
    size[shared] *= SHARED

    def miss(angles: Array) -> Array:
        arm.move(angles)
        return np.concatenate([arm.tip(i)[0] - target for i, target in enumerate(targets)])

    def slope(angles: Array) -> Array:
        arm.move(angles)
        return np.vstack([arm.point_jacobian(i, arm.tip(i)[0]) for i in range(len(targets))])

    within = np.maximum(lower, -math.pi), np.minimum(upper, math.pi)
    others = np.tile(guess, (_STARTS, 1))
    others[:, shared] = np.random.default_rng(0).uniform(*within, others.shape)[:, shared]
    angles, left = root_within(miss, slope, [guess, *others], lower, upper, size, REACHED)
    if left <= REACHED:
        angles = least_on_roots(miss, slope, angles, guess, lower, upper, size, REACHED)
    gaps = np.linalg.norm(miss(angles).reshape(-1, 3), axis=1)
    return angles, float(gaps.max())
