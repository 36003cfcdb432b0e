"""A scenario for a hand of which nothing is known but its URDF: the ends as fingertips, and what to fill in."""

from __future__ import annotations

import json
import math
import os
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from softhand.errors import ModelError, ScenarioError
from softhand.model.coupling import read_coupling
from softhand.model.urdf.bodies import NO_MASS
from softhand.model.urdf.document import read_text
from softhand.model.urdf.examination import HAND, examine
from softhand.model.urdf.inertias import IMPOSSIBLE
from softhand.model.urdf.joints import NO_EFFORT
from softhand.model.urdf.mimic_signs import LIMITS, MULTIPLIER, clashes
from softhand.model.urdf.mimics import read_mimics
from softhand.model.urdf.pinocchio_model import build_model
from softhand.model.urdf.repair import BALANCE
from softhand.model.urdf.urdf import Urdf

_AT_JOINT = 1e-3  # [m]
_QUARTER = math.pi / 2.0
_TO_X = (
    ((0.0, 0.0, 0.0), (0.0, 0.0, math.pi)),
    ((0.0, 0.0, _QUARTER), (0.0, 0.0, -_QUARTER)),
    ((0.0, -_QUARTER, 0.0), (0.0, _QUARTER, 0.0)),
)  # [rad], roll, pitch, yaw that bring x to an axis, and to what is opposite of it

_DENSITY = 1200.0  # [kg/m^3], of printed plastic
_REMEDIES = {
    NO_EFFORT: "effort_limit = 1.0          # [N m or N], as the URDF has efforts of 0: write that of the motors",
    IMPOSSIBLE: f'repair = "{BALANCE}"          # the URDF has inertias that no body has: the nearest possible ones',
    NO_MASS: f"density = {_DENSITY}            # [kg/m^3], as links have no mass: from their shapes, of plastic",
}

_TEXT = """\
# A hand of {count} fingers and a box. docs/scenario.md lists all keys; softhand check {name} explains these.
description = "{title} holds a box"

duration = 2.0               # [s]
control_period = 0.001       # [s], the torque is held for so long
gravity = [0.0, 0.0, -9.81]  # [m/s^2], base frame

[hand]
urdf = {urdf}
position = [0.0, 0.0, 0.0]  # [m], of the root in the base frame
rpy = [0.0, 0.0, 0.0]       # [rad]{remedies}
# Frames at the centre of each flat face, x out of the tip. These are the ends of the URDF, in its order; take out
# what is no fingertip. Where the axis that points away from the last joint is not x, the frame is turned:
# {{ name = "index", frame = "LINK", position = [0.0, 0.0, 0.0], rpy = [0.0, -1.5707963267948966, 0.0] }}
tips = [
{tips}
]

[object]
urdf = "package://softhand/urdf/box.urdf"  # 56 x 36 x 60 mm, 0.200 kg; or your own
position = [{position}]  # [m], base frame: amid the tips with all joints in the middle of their ranges
rpy = [0.0, 0.0, 0.0]  # [rad], roll, pitch, yaw, at the start

[fingertip]
law = "conservative"  # works up to the apex of the tip; softhand list laws
friction = 0.6        # [-]
radius = 0.010        # [m]
k_r = 0.377e6         # [N/m^2]
k_phi = 0.166e6       # [N/m^2]
k_psi = 0.0488e9      # [N/m^3]

{search}[grasp]

[controller]
name = "regulation"  # softhand list controllers
K_N = 1.0            # [-], feedback of the internal force; softhand stability says whether the loop bears it

[reference]
kind = "hold"  # the start is kept; "minimum-jerk" goes to object_position, object_rpy, internal_force

# Instruments through which the controller sees the grasp, and drives behind it: without them both are ideal.
# docs/sensing.md
# [sensing.joint_position]
# noise = 1e-4   # [rad]
# delay = 0.001  # [s]
# [actuation]
# lag = 0.001    # [s]

[stepper]
name = "midpoint"
step = 0.001  # [s]
"""


_SEARCH = """\
# Contact points, internal forces and joint angles: found by
#     softhand grasp {name} --place --propose
# which prints them, or with --write FILE keeps all of it as a scenario that can be run.
"""

_BY_HAND = """\
# Joints follow others by <mimic>; the motors are {motors}.
# softhand grasp --propose moves one joint at a time and does not search for such a hand. Write a point of the surface
# for each tip and an internal force [N] for each pair; softhand check {name} tells the nearest points that the motors
# reach.
# contact_points = [[-0.028, 0.0, 0.0], [0.028, 0.0, 0.0]]
# internal_force = [4.0]
"""


class Blank(NamedTuple):
    """A scenario to begin from.

    Attributes:
        text: of its file.
        remedies: lines of its hand without which the URDF would be refused, each with what to do about it.
    """

    text: str
    remedies: list[str]


def blank_scenario(urdf: Path, file: Path) -> Blank:
    """A scenario for a hand, without a grasp.

    Args:
        urdf: of the hand.
        file: that the text is for; the hand is named from its folder.

    Raises:
        ModelError: the URDF cannot be read as a hand, or it has fewer than two ends.
    """
    hand, remedies = read_hand(urdf)
    ends = _ends(hand)
    if len(ends) < 2:
        raise ModelError(
            f"{urdf}: got {len(ends)} end of the tree of links ({', '.join(ends)}); a hand that holds something "
            "needs two fingertips or more.",
            file=str(urdf),
        )
    model = build_model(hand)
    position = ", ".join(f"{value:.3f}" for value in _middle(hand, model, ends))
    text = _TEXT.format(
        count=len(ends),
        name=file.name,
        search=_search(hand, file.name),
        title=json.dumps(urdf.stem, ensure_ascii=False)[1:-1],
        urdf=json.dumps(os.path.relpath(urdf, file.absolute().parent), ensure_ascii=False),
        tips="\n".join(f"    {_tip(model, name)}" for name in ends),
        position=position,
        remedies="".join(f"\n{line}" for line in remedies),
    )
    return Blank(text, remedies)


def _search(hand: Urdf, name: str) -> str:
    """How contact points are found."""
    mimics = read_mimics(hand.tree)
    if not mimics:
        return _SEARCH.format(name=name)
    motors = [joint.name for joint in hand.moving_joints if joint.name not in mimics]
    return _BY_HAND.format(name=name, motors=", ".join(motors))


def read_hand(urdf: Path, wrong_sign: str = "") -> tuple[Urdf, list[str]]:
    """A hand, and the lines of a scenario without which its URDF would be refused.

    Args:
        urdf: of the hand.
        wrong_sign: what of followers by `<mimic>` has the wrong sign where both cannot be right, `LIMITS` or
            `MULTIPLIER`; "" if nobody knows.

    Raises:
        ModelError: it cannot be read as a hand with these either.
        ScenarioError: there is no such follower, or nothing else of one that could be wrong.
    """
    found = examine(read_text(urdf), urdf, HAND, urdf.parent)
    kinds = {finding.kind for finding in found.findings if finding.is_error} & set(_REMEDIES)
    role = replace(
        HAND,
        effort_counts=NO_EFFORT not in kinds,
        repair=BALANCE if IMPOSSIBLE in kinds else "",
        density=_DENSITY if NO_MASS in kinds else None,
    )
    hand, lines = Urdf.read(urdf, role), [line for kind, line in _REMEDIES.items() if kind in kinds]
    if not wrong_sign:
        return hand, lines
    if wrong_sign not in (LIMITS, MULTIPLIER):
        raise ScenarioError(
            f'wrong_sign: got {wrong_sign!r}; give "{LIMITS}" or "{MULTIPLIER}".', key="wrong_sign", value=wrong_sign
        )
    signs = tuple((clash.joint, wrong_sign) for clash in clashes(hand.tree))
    if not signs:
        raise ScenarioError(
            f"wrong_sign: got {wrong_sign!r}, but in {urdf} no joint follows another one beyond its own limits; leave "
            "it out.",
            key="wrong_sign", value=wrong_sign,
        )  # fmt: skip
    names = ", ".join(f'{json.dumps(name)} = "{what}"' for name, what in signs)
    lines.append(f"mimic_signs = {{ {names} }}  # which of these has the wrong sign, as it was said")
    return Urdf.read(urdf, replace(role, turned=signs)), lines


def _ends(hand: Urdf) -> list[str]:
    """Links that carry no other, on bodies that no joint moves on: not the frames of a base or a palm."""
    carrying = {joint.parent for joint in hand.moving_joints}
    bodies = hand.tree.bodies()
    outer = {
        name
        for leader, members in bodies.items()
        if leader != hand.tree.root and not carrying & set(members)
        for name in members
    }
    return [name for name in hand.ends if name in outer]


def _tip(model: pin.Model, name: str) -> str:
    """The entry of an end, turned so that of its axes the one away from the last joint becomes x."""
    frame, quoted = model.frames[model.getFrameId(name, pin.FrameType.BODY)], json.dumps(name, ensure_ascii=False)
    out = frame.placement.rotation.T @ frame.placement.translation
    if np.linalg.norm(out) < _AT_JOINT:
        return f"{quoted},  # its origin is that of its joint: give the position at the tip, and rpy"
    axis = int(np.argmax(np.abs(out)))
    rpy = _TO_X[axis][int(out[axis] < 0.0)]
    if not any(rpy):
        return f"{quoted},"
    label = json.dumps(f"{name}_soft", ensure_ascii=False)
    why = f"{'-' if out[axis] < 0.0 else ''}{'xyz'[axis]} of the link points away from its joint"
    return f"{{ name = {label}, frame = {quoted}, rpy = {list(rpy)} }},  # {why}"


def _middle(hand: Urdf, model: pin.Model, ends: list[str]) -> np.ndarray:
    """The mean of the ends, all joints, or their motors, in the middle of their ranges [m], shape (3,)."""
    coupling = read_coupling(hand, model, None, 1.0)
    lower, upper = model.lowerPositionLimit, model.upperPositionLimit
    middle = np.where(np.isfinite(lower + upper), 0.5 * (lower + upper), 0.0)
    q = pin.neutral(model)
    for k, joint in enumerate(list(model.joints)[1:]):
        if joint.nq == 1:  # a continuous joint stays where it is
            q[joint.idx_q] = middle[joint.idx_q]
            if coupling is not None:
                between = 0.5 * coupling.limits.sum(axis=0)
                q[joint.idx_q] = coupling.joint_positions(np.where(np.isfinite(between), between, 0.0))[k]
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return np.mean([data.oMf[model.getFrameId(name, pin.FrameType.BODY)].translation for name in ends], axis=0)
