"""The numbers of a moment that the live page draws as curves."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.numerics.arrays import Array
from softhand.plots.quantities import finger_name
from softhand.plots.style import finger_color
from softhand.viewer.scene.moment import Moment


def readings(moment: Moment) -> Array:
    """Normal force of each tip [N], friction use of each tip, distance [mm] and angle [deg] from the desired pose.

    Shape (2 nc + 2,).
    """
    now, wanted = moment.object_pose, moment.desired_pose
    distance = 1e3 * np.linalg.norm(now[:3, 3] - wanted[:3, 3])
    cosine = 0.5 * (np.trace(now[:3, :3].T @ wanted[:3, :3]) - 1.0)
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return np.concatenate([moment.contact_force[:, 2], moment.friction_use, [distance, angle]])


def describe_fingers(tips: tuple[str, ...]) -> list[dict[str, Any]]:
    """Tip, name and colour of each finger, in the order of its readings."""
    return [{"tip": tip, "text": finger_name(tip), "color": finger_color(k)} for k, tip in enumerate(tips)]
