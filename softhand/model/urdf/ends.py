"""Where the fingers of a hand end: the outermost bodies, the way that each points, and a soft tip that fits there."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from softhand.model.urdf.points import shape_points
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.arrays import Array

RADIUS = 0.004, 0.015
"""Least and greatest radius of a tip that is proposed [m]."""

COVER = 1.5e-3
"""How far a tip that is proposed sticks out of the link that carries it [m]."""

_AT_JOINT = 1e-3  # [m]
_OUTER = 0.9  # share of the farthest point's distance beyond which points tell where a link points
_USUAL = 0.010  # [m] radius where no shape tells one
_ALONG = np.cos(np.radians(25.0))
_UPRIGHT = 1e-3


class FingerEnd(NamedTuple):
    """The last body of a finger.

    Attributes:
        link: that leads the body: the child of the last joint, whose frame is that of the joint.
        points: of the shapes of the body in that frame [m], shape (points, 3).
        out: unit vector from the last joint to the end of the body, in that frame, shape (3,).
        frames: links that are fixed to it: name, position and axes in that frame.
        is_known: whether anything tells where it ends; else `out` is a guess.
    """

    link: str
    points: Array
    out: Array
    frames: tuple[tuple[str, Array, Array], ...]
    is_known: bool

    def own_frame(self, out: Array | None = None) -> tuple[str, Array, Array] | None:
        """The frame that the URDF has at the end with x out of it, as softhand asks for it.

        Args:
            out: where the tip shall press, if elsewhere than along `self.out`, shape (3,).

        Returns:
            Its name, position [m] and x axis in the frame of the link; None if there is none.
        """
        reach = float(np.max(self.points @ self.out, initial=0.0))
        for name, position, axes in self.frames:
            along = float(position @ self.out)
            is_at_end = along > _AT_JOINT and (not reach or along > 0.6 * reach)
            if is_at_end and axes[:, 0] @ (self.out if out is None else out) > _ALONG:
                return name, position, axes[:, 0]
        return None

    def fitted(self, out: Array | None = None) -> tuple[Array, float]:
        """Centre [m] and radius [m] of a ball that covers the end, from the points near to it.

        It sticks out by `COVER` beyond the farthest point along `self.out`, and beyond the farthest one along `out`
        near to it, so that it is the soft tip that touches and no link.

        Args:
            out: where the tip shall press, if elsewhere than along `self.out`, shape (3,).
        """
        if not len(self.points):
            frames = [position for _, position, _ in self.frames]
            far = max(frames, key=lambda position: float(position @ self.out), default=np.zeros(3))
            return np.array(far), _USUAL
        along = self.points @ self.out
        centre, radius = np.zeros(3), _USUAL
        for _ in range(3):
            near = self.points[along > along.max() - 1.5 * radius]
            axes = _axes_across(near, self.out, out)
            across = near @ axes
            low, high = across.min(axis=0), across.max(axis=0)
            radius = float(np.clip(0.5 * np.min(high - low) + COVER, *RADIUS))
            middle = 0.5 * (low + high)
            if out is not None:
                middle[0] = high[0] + COVER - radius
            centre = (along.max() + COVER - radius) * self.out + axes @ middle
        return centre, radius


def find_ends(hand: Urdf, model: pin.Model) -> list[FingerEnd]:
    """The bodies that no further joint moves on, one a finger, in the order of the URDF.

    Args:
        hand: without errors.
        model: of it.
    """
    carrying = {joint.parent for joint in hand.moving_joints}
    bodies = hand.tree.bodies()
    return [
        end_of(hand, model, leader)
        for leader, members in bodies.items()
        if leader != hand.tree.root and not carrying & set(members)
    ]


def end_of(hand: Urdf, model: pin.Model, leader: str) -> FingerEnd:
    """One body; the same for a body that is none of the last ones.

    Args:
        hand: without errors.
        model: of it.
        leader: link that leads the body.
    """
    members = hand.tree.bodies()[leader]
    base = model.frames[model.getFrameId(leader, pin.FrameType.BODY)].placement
    shapes: dict[str, list] = {name: [] for name in members}
    for purpose in ("collision", "visual"):
        of_purpose = [shape for shape in hand.geometries(purpose) if shape.link in shapes]
        for shape in of_purpose:
            shapes[shape.link].append(shape)
        if any(map(len, map(shape_points, shapes.values()))):
            break
    points, frames = [], []
    for name in members:
        place = base.actInv(model.frames[model.getFrameId(name, pin.FrameType.BODY)].placement)
        own = shape_points(shapes[name])
        if len(own):
            points.append(own @ place.rotation.T + place.translation)
        if name != leader:
            frames.append((name, np.array(place.translation), np.array(place.rotation)))
    every = np.concatenate(points) if points else np.empty((0, 3))
    out = _direction(every if len(every) else np.array([position for _, position, _ in frames]).reshape(-1, 3))
    if out is not None:
        return FingerEnd(leader, every, out, tuple(frames), True)
    joint = model.frames[model.getFrameId(leader, pin.FrameType.BODY)].parentJoint
    before = base.rotation.T @ model.jointPlacements[joint].rotation.T @ model.jointPlacements[joint].translation
    size = float(np.linalg.norm(before))
    return FingerEnd(leader, every, before / size if size > _AT_JOINT else np.eye(3)[0], tuple(frames), False)


def _direction(points: Array) -> Array | None:
    """From the origin to the middle of the farthest points, a unit vector; None if all are there."""
    far = np.linalg.norm(points, axis=1)
    if not len(points) or far.max() < _AT_JOINT:
        return None
    outer = points[far > _OUTER * far.max()]
    middle = 0.5 * (outer.min(axis=0) + outer.max(axis=0))
    if np.linalg.norm(middle) < _OUTER * 0.5 * far.max():  # points all round: a ball about its joint
        middle = points[int(np.argmax(far))]
    return np.asarray(middle / np.linalg.norm(middle))


def _axes_across(points: Array, along: Array, out: Array | None) -> Array:
    """Two axes across a direction as columns: the way out and beside it, or the principal ones of the points."""
    if out is not None:
        first = out - (out @ along) * along
    else:
        middle = points - points.mean(axis=0)
        middle = middle - np.outer(middle @ along, along)
        first = np.linalg.svd(middle, full_matrices=False)[2][0]
        first = first - (first @ along) * along
    size = float(np.linalg.norm(first))
    if size < 1e-6:
        first = np.eye(3)[int(np.argmin(np.abs(along)))]
        first = first - (first @ along) * along
        size = float(np.linalg.norm(first))
    first = first / size
    return np.column_stack([first, np.cross(along, first)])


def rpy_to(out: Array) -> tuple[float, float, float]:
    """Roll, pitch, yaw [rad] of axes whose x points along a unit vector, to four digits."""
    pitch = -math.asin(float(np.clip(out[2], -1.0, 1.0)))
    yaw = math.atan2(out[1], out[0]) if math.hypot(out[0], out[1]) > _UPRIGHT else 0.0
    return 0.0, round(pitch, 4) + 0.0, round(yaw, 4) + 0.0
