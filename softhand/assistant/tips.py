"""The soft tips of a hand of which nothing is known but its URDF."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from softhand.assistant.fingers import Fingers, TipOnBody, Tips
from softhand.errors import ModelError
from softhand.model.urdf.ends import FingerEnd, end_of, find_ends, rpy_to
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.arrays import Array

_SHORT = 0.6  # of the longest finger, below which an end is that of a bar and no fingertip
_ONE_WAY = 0.05  # smallest over largest singular value of what the motors do to a tip that can go one way only


class FoundTip(NamedTuple):
    """A tip and where it comes from."""

    name: str
    """Of the tip."""
    link: str
    """That carries it."""
    on_body: TipOnBody
    """Where it is."""
    rpy: tuple[float, float, float]
    """Of its axes in the frame of the link [rad]."""
    is_frame: bool
    """Whether the link itself is the frame of the tip."""
    why: str
    """How it was found."""


def find_tips(hand: Urdf, model: pin.Model, fingers: Fingers, only: Sequence[str] = ()) -> list[FoundTip]:
    """A tip at the end of each finger, x out of it.

    Args:
        hand: without errors.
        model: of it.
        fingers: of it.
        only: links, or joints' children, whose bodies alone are fingers; all ends if empty.

    Raises:
        ModelError: there is no such link, or no two ends.
    """
    ends = _chosen(hand, model, only) if only else find_ends(hand, model)
    if not ends:
        raise ModelError(
            f"{hand.file}: no link of it moves, so that it has no fingers; a hand needs joints of the type revolute, "
            "continuous or prismatic.",
            file=str(hand.file),
        )
    if not only:
        ends = _long_ones(ends, model)
    is_jaw = len(ends) == 1
    if is_jaw:  # the body that carries the one moving jaw is the other one
        ends = [*ends, _facing(hand, model, fingers, ends[0])]
    motors = _amid(fingers)
    plain = [TipOnBody(_joint(model, end.link), *_placed(end), end.points) for end in ends]
    tips, wide = fingers.at(motors, plain), _open(fingers, plain)
    arm = arm_motors(fingers, plain)
    found = []
    for i, end in enumerate(ends):
        closing = _closing(tips.centre_slopes[i][:, ~arm], wide.centre_slopes[i][:, ~arm], wide.centres, i)
        if is_jaw and closing is None:
            closing = _away(tips.centres, i)
        rotation = _rotation(fingers, motors, plain[i].joint)
        found.append(_tip(hand, end, plain[i], None if closing is None else rotation.T @ closing))
    return found


def arm_motors(fingers: Fingers, tips: Sequence[TipOnBody]) -> np.ndarray:
    """Which motors move all tips together, as those of an arm or a wrist do, shape (n,)."""
    chains = [set(list(fingers.model.supports[tip.joint])[1:]) for tip in tips]
    shared = set.intersection(*chains) if len(chains) > 1 else set()
    rest = [index - 1 for index in range(1, fingers.model.njoints) if index not in shared]
    return np.asarray(~np.any(fingers.S[rest] != 0.0, axis=0)) if shared else np.zeros(fingers.n, bool)


def _chosen(hand: Urdf, model: pin.Model, only: Sequence[str]) -> list[FingerEnd]:
    leaders = {name: leader for leader, members in hand.tree.bodies().items() for name in members}
    for name in only:
        if name not in leaders:
            ends = ", ".join(end.link for end in find_ends(hand, model))
            raise ModelError(
                f"{hand.file}: no link is called '{name}'; links at the end of a finger are: {ends}.",
                file=str(hand.file),
            )
    return [end_of(hand, model, leader) for leader in dict.fromkeys(leaders[name] for name in only)]


def _long_ones(ends: list[FingerEnd], model: pin.Model) -> list[FingerEnd]:
    """Without bars and the like, whose ends are much nearer to the palm than those of the fingers."""
    data = model.createData()
    pin.forwardKinematics(model, data, pin.neutral(model))
    chains = [list(model.supports[_joint(model, end.link)])[1:] for end in ends]
    shared = set.intersection(*map(set, chains)) if len(ends) > 1 else set()
    first = [next((joint for joint in chain if joint not in shared), chain[-1]) for chain in chains]
    middle = np.mean([data.oMi[joint].translation for joint in first], axis=0)
    reach = [
        float(np.linalg.norm(data.oMi[chain[-1]].act(end.fitted()[0]) - middle))
        for end, chain in zip(ends, chains, strict=True)
    ]
    return [end for end, length in zip(ends, reach, strict=True) if length > _SHORT * max(reach)]


def _facing(hand: Urdf, model: pin.Model, fingers: Fingers, end: FingerEnd) -> FingerEnd:
    """The body on which the only moving one sits."""
    carrier = next(joint.parent for joint in hand.tree.joints if joint.child == end.link)
    leader = next(leader for leader, members in hand.tree.bodies().items() if carrier in members)
    return end_of(hand, model, leader)


def _joint(model: pin.Model, link: str) -> int:
    return int(model.frames[model.getFrameId(link, pin.FrameType.BODY)].parentJoint)


def _placed(end: FingerEnd) -> tuple[Array, Array, float]:
    centre, radius = end.fitted()
    return centre, end.out, radius


def _amid(fingers: Fingers) -> Array:
    return 0.5 * (fingers.low + fingers.high)


def _rotation(fingers: Fingers, motors: Array, joint: int) -> Array:
    data = fingers.model.createData()
    pin.forwardKinematics(fingers.model, data, fingers.configuration(motors))
    return np.array(data.oMi[joint].rotation)


def _open(fingers: Fingers, tips: Sequence[TipOnBody]) -> Tips:
    """The tips where they are farthest apart, of some postures."""
    postures = (fingers.low, fingers.rest, _amid(fingers), fingers.high)
    found = [fingers.at(motors, tips) for motors in postures]
    return max(found, key=lambda one: float(np.sum((one.centres - one.centres.mean(axis=0)) ** 2)))


def _closing(slopes: Array, when_open: Array, centres: Array, i: int) -> Array | None:
    """Where a tip goes that can go one way only, as the hand closes; None for one that can go several ways.

    Args:
        slopes: of its centre by the motors, amid their ranges, shape (3, motors).
        when_open: the same where the hand is open; fingers may cross in the middle of their ranges.
        centres: of all tips there [m], shape (tips, 3).
        i: which tip.
    """
    U, sizes, V = np.linalg.svd(when_open, full_matrices=False)
    if not len(sizes) or sizes[0] < 1e-9 or (len(sizes) > 1 and sizes[1] > _ONE_WAY * sizes[0]):
        return None
    others = np.delete(centres, i, axis=0).mean(axis=0) - centres[i]
    way = slopes @ V[0] * (1.0 if U[:, 0] @ others >= 0.0 else -1.0)
    size = float(np.linalg.norm(way))
    return np.asarray(way / size) if size > 1e-9 else None


def _away(centres: Array, i: int) -> Array:
    way = np.delete(centres, i, axis=0).mean(axis=0) - centres[i]
    return np.asarray(way / np.linalg.norm(way))


def _tip(hand: Urdf, end: FingerEnd, plain: TipOnBody, closing: Array | None) -> FoundTip:
    taken = set(hand.tree.links)
    name = f"{end.link}_tip"
    while name in taken:
        name += "_soft"
    own = end.own_frame(closing)
    if own is not None:
        label, position, x = own
        return FoundTip(
            label, label, plain._replace(centre=position, out=x), (0.0, 0.0, 0.0), True,
            "x of this frame points out of the end of the finger",
        )  # fmt: skip
    if closing is None:
        out, why = end.out, "x along the last link"
        centre, radius = plain.centre, plain.radius
    else:
        across = closing - (closing @ end.out) * end.out
        size = float(np.linalg.norm(across))
        if size < 0.2:
            out, why, centre, radius = end.out, "x along the last link", plain.centre, plain.radius
        else:
            out = closing
            why = "the finger can close one way only, and x goes there"
            centre, radius = end.fitted(across / size)
    if not end.is_known:
        why = "NOTHING TELLS WHERE THIS LINK ENDS: no shape and no frame; write the position of the tip"
    elif len(end.points):
        why += ", at the end of its shapes"
    else:
        why += ", at its last frame"
    centre = np.round(centre, 5) + 0.0
    radius = round(radius, 4)
    rpy = rpy_to(out)
    return FoundTip(name, end.link, plain._replace(centre=centre, out=_x_of(rpy), radius=radius), rpy, False, why)


def _x_of(rpy: tuple[float, float, float]) -> Array:
    _, pitch, yaw = rpy
    return np.array([math.cos(yaw) * math.cos(pitch), math.sin(yaw) * math.cos(pitch), -math.sin(pitch)])
