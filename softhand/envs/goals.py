"""Poses as goals: how far off one is, and what that is worth; all of it for many poses at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from softhand.numerics.arrays import AnyArray, Array

POSE = 7
"""Numbers of a goal: position [m], unit quaternion x, y, z, w."""


class Measure(NamedTuple):
    """How errors of a pose count."""

    near: tuple[float, float]
    """Within these errors of position [m] and orientation [rad] a goal is reached."""
    scale: tuple[float, float]
    """Each of these errors halves the dense reward."""
    is_dense: bool
    """Whether the reward grows on the way, or is 1 where the goal is reached, and 0 elsewhere."""


def errors(achieved: Array, desired: Array) -> tuple[Array, Array]:
    """Distance [m] and angle [rad] between poses, shape (..., 7) each."""
    achieved, desired = np.asarray(achieved, dtype=float), np.asarray(desired, dtype=float)
    distance = np.linalg.norm(achieved[..., :3] - desired[..., :3], axis=-1)
    a, b = achieved[..., 3:], desired[..., 3:]
    along = np.sum(a * b, axis=-1)
    across = b[..., 3:] * a[..., :3] - a[..., 3:] * b[..., :3] - np.cross(a[..., :3], b[..., :3])
    return distance, 2.0 * np.arctan2(np.linalg.norm(across, axis=-1), np.abs(along))


def reached(achieved: Array, desired: Array, measure: Measure) -> AnyArray:
    """Whether poses are near enough to their goals, shape (...,)."""
    distance, angle = errors(achieved, desired)
    return (distance <= measure.near[0]) & (angle <= measure.near[1])


def reward(achieved: Array, desired: Array, measure: Measure, cost: Array | float = 0.0) -> Array:
    """1 / (1 + distance / scale + angle / scale) less the cost; or 1 where a goal is reached, 0 elsewhere, less it."""
    if not measure.is_dense:
        return reached(achieved, desired, measure).astype(float) - cost
    distance, angle = errors(achieved, desired)
    return 1.0 / (1.0 + distance / measure.scale[0] + angle / measure.scale[1]) - cost


def costs(info: Mapping[str, Any] | Sequence[Mapping[str, Any]] | AnyArray | None) -> Array | float:
    """The costs that infos tell: of a step, of a step of many worlds, or in a list of infos, as of replay buffers."""
    if info is None:
        return 0.0
    if isinstance(info, Mapping):
        return np.asarray(info.get("cost", 0.0), dtype=float)
    return np.array([one.get("cost", 0.0) for one in info], dtype=float)
