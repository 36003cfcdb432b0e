"""Gains: one number for all, or one for each."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.errors import ScenarioError


def diagonal(key: str, gain: Any, size: int) -> np.ndarray:
    """A gain as an array of its diagonal, shape (size,).

    Args:
        key: its name in the controller's settings, for the message.
        gain: one number or `size` of them.
        size: how many.

    Raises:
        ScenarioError: another count.
    """
    values = np.atleast_1d(np.asarray(gain, dtype=float))
    if values.size not in (1, size):
        raise ScenarioError(
            f"controller.{key} has {values.size} entries; give one number or {size}.", key=key, value=gain
        )
    return np.broadcast_to(values, (size,)).copy()


def pose_diagonal(key: str, position: Any, orientation: Any) -> np.ndarray:
    """Gains of position and orientation as one array, shape (6,); the keys are KEY_position and KEY_orientation.

    Raises:
        ScenarioError: not one number or three.
    """
    return np.concatenate([diagonal(f"{key}_position", position, 3), diagonal(f"{key}_orientation", orientation, 3)])
