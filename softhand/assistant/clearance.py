"""How deep the links of a hand are in a box, about: points of their hulls, for many postures one after the other.

A grasp is looked at with `softhand.collision` before it is taken; this is what the search goes by until then.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from softhand.assistant.block import Block
from softhand.assistant.fingers import Fingers, TipOnBody
from softhand.collision.shapes import corners_of
from softhand.errors import ModelError
from softhand.model.urdf.geometry import Purpose
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of

_POINTS = 160  # of the hull of a shape
_SOFT = 1.02  # of the radius of a ball, within which links do not count


def shapes_of(hand: Urdf) -> Purpose:
    """By which shapes of a hand one sees what is in the way: visual ones where it has no others."""
    return "collision" if hand.geometries("collision") else "visual"


class Clearance:
    """The links of a hand as points."""

    def __init__(self, fingers: Fingers) -> None:
        self._fingers = fingers
        model, hand = fingers.model, fingers.hand
        self._data = model.createData()
        rng = np.random.default_rng(0)
        self._points: list[tuple[int, Array]] = []
        for geometry in hand.geometries(shapes_of(hand)):
            try:
                points = _spread(corners_of(geometry), rng)
            except ModelError:
                continue
            frame = model.frames[model.getFrameId(geometry.link, pin.FrameType.BODY)]
            place = frame.placement * pin.SE3(geometry.rotation, geometry.position)
            self._points.append((int(frame.parentJoint), points @ place.rotation.T + place.translation))

    def depth(self, motors: Array, block: Block, tips: Sequence[TipOnBody]) -> float:
        """The largest depth of a point in the box [m], 0 if none is inside; those within the soft balls do not count.

        Args:
            motors: of the hand [rad or m], shape (n,).
            block: the box; it lies where the hand is as `block` has turned it.
            tips: that touch it.
        """
        model, data = self._fingers.model, self._data
        pin.forwardKinematics(model, data, self._fingers.configuration(motors))
        R_hand, R = rotation_of(block.hand_rpy), rotation_of(block.rpy)
        half = 0.5 * np.array(block.size)
        balls = [(tip.joint, tip.centre, _SOFT * tip.radius) for tip in tips]
        deepest = 0.0
        for joint, points in self._points:
            pose = data.oMi[joint]
            placed = (points @ pose.rotation.T + pose.translation) @ R_hand.T
            inside = np.min(half - np.abs((placed - block.position) @ R), axis=1)
            for own, centre, radius in balls:
                if own == joint:
                    inside[np.linalg.norm(points - centre, axis=1) < radius] = 0.0
            deepest = max(deepest, float(np.max(inside, initial=0.0)))
        return deepest

    def out_of_the_way(self, motors: Array, block: Block, tips: Sequence[TipOnBody], idle: Sequence[Array]) -> Array:
        """The same motors with each idle finger where it is least in the box, shape (n,).

        Args:
            motors: of the hand [rad or m], shape (n,).
            block: the box.
            tips: that touch it.
            idle: which motors move each idle finger alone, shape (n,) each.
        """
        best, fingers = motors.copy(), self._fingers
        for own in idle:
            if not own.any():
                continue
            tries = []
            for place in (fingers.rest, fingers.low, fingers.high, 0.5 * (fingers.low + fingers.high)):
                trial = best.copy()
                trial[own] = place[own]
                tries.append((self.depth(trial, block, tips), trial))
            best = min(tries, key=lambda one: one[0])[1]
        return best


def _spread(corners: Array, rng: np.random.Generator) -> Array:
    """Points spread over the hull of some corners; the corners themselves if these lie in a plane."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(corners)
    except (QhullError, ValueError):
        return corners
    a, b, c = corners[hull.simplices].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    chosen = rng.choice(len(area), _POINTS, p=area / area.sum())
    u, v = np.sqrt(rng.random(_POINTS))[:, None], rng.random(_POINTS)[:, None]
    inner = (1.0 - u) * a[chosen] + u * (1.0 - v) * b[chosen] + u * v * c[chosen]
    some = hull.vertices if len(hull.vertices) <= _POINTS else rng.choice(hull.vertices, _POINTS, replace=False)
    return np.concatenate([inner, corners[some]])
