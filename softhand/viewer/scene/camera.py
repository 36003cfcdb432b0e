"""What a camera has to fit, and from where to look."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from softhand.numerics.arrays import Array
from softhand.viewer.scene.moment import Moment


class Sphere(NamedTuple):
    """What a camera can fit."""

    centre: Array
    """[m], shape (3,)."""
    radius: float
    """[m]"""


class Bounds(NamedTuple):
    """Spheres around what is seen, and from where to look at it."""

    whole: Sphere
    """Around everything."""
    grasp: Sphere
    """Around the object and the tips."""
    azimuth: float
    """Of the camera in the upright picture about z, from x to y [rad]: where the fewest fingers are in the way."""
    upright: Array
    """Turns the world so that gravity points down in the picture, shape (3, 3)."""

    def plain(self) -> dict[str, Any]:
        """As the pages take it."""
        whole, grasp = ({"center": sphere.centre.tolist(), "radius": sphere.radius} for sphere in self[:2])
        return {**whole, "grasp": grasp, "azimuth": self.azimuth, "upright": self.upright.ravel().tolist()}


def sphere_around(places: list[Array]) -> Sphere:
    """Around points [m], each of shape (n, 3)."""
    cloud = np.concatenate(places)
    cloud = cloud[np.isfinite(cloud).all(axis=1)]
    centre = 0.5 * (cloud.min(axis=0) + cloud.max(axis=0))
    return Sphere(centre, float(np.linalg.norm(cloud - centre, axis=1).max()))


def open_side(moment: Moment, base: Array, upright: Array) -> float:
    """Azimuth [rad] a little beside the middle of the widest gap between the fingers, seen from above.

    A palm that is beside the object, and not below it, is in the way as well.
    """
    middle = moment.object_pose[:3, 3]
    reach = ((moment.tip_position - middle) @ upright.T)[:, :2]
    palm = ((base - middle) @ upright.T)[:2]
    if np.linalg.norm(palm) > np.linalg.norm(reach, axis=1).min():
        reach = np.vstack([reach, palm])
    azimuths = np.sort(np.arctan2(reach[:, 1], reach[:, 0]))
    gaps = np.diff(np.append(azimuths, azimuths[0] + 2.0 * np.pi))
    widest = int(np.argmax(np.round(gaps, 3)))
    return float(azimuths[widest] + 0.36 * gaps[widest])
