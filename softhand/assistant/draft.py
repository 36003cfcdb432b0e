"""A scenario as text with the reason of each line, from what was found for a hand."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from softhand.assistant.block import Block
from softhand.assistant.tips import FoundTip
from softhand.contact.pairs import contact_pairs
from softhand.numerics.arrays import Array

_TEXT = """\
# {title} holds a box: made by softhand new, from the URDF alone. All of it can be changed; docs/scenario.md lists all
# keys, softhand check {name} explains these.
description = "{title} holds a box with {count} soft tips"

duration = 2.0               # [s]
control_period = {period}{period_pad} # [s], the torque is held for so long{period_why}
gravity = [0.0, 0.0, -9.81]  # [m/s^2], base frame

[hand]
urdf = {urdf}
position = [0.0, 0.0, 0.0]  # [m], of the root in the base frame
rpy = {hand_rpy}  # [rad]{hand_why}{remedies}
# One tip a finger. Its frame has its origin in the middle of the flat face of a soft hemisphere, and x out of it.
tips = [
{tips}
]
{unused}
[object]
urdf = {object}  # {size} mm, {mass:g} kg: what fits between these tips
position = {position}  # [m], base frame: where all tips above reach it, searched over the postures of the hand
rpy = {rpy}  # [rad], roll, pitch, yaw: the tips press on its faces +x and -x

[fingertip]
law = "conservative"  # works up to the apex of the tip; softhand list laws
contact = "coulomb"   # tips slip where friction is used up
friction = {friction:g}        # [-], of rubber on wood or plastic: measure yours
radius = {radius:g}{radius_pad}# [m]{radius_why}
k_r = 0.377e6         # [N/m^2], of silicone as in the paper; softhand identify fits it to measurements
k_phi = 0.166e6       # [N/m^2]
k_psi = 0.0488e9      # [N/m^3]
{tip_radii}
[fingertip.damping]
name = "hunt-crossley"  # soft rubber damps; with its usual coefficients
{margin}
[grasp]
contact_points = [  # [m], object frame, one a tip in the order of hand.tips
{points}
]
# One number a pair of tips, {pairs}; positive squeezes. The least with which each tip presses
# with {pressing:g} N and uses half of its friction.
internal_force = {squeeze}  # [N]
# One number a {motor}, as read: {motors}
joint_guess = {guess}  # [rad or m], where the search of the start begins

[controller]
name = "regulation"  # of the paper; softhand list controllers
{gains}
[reference]
kind = "hold"  # the start is kept; "minimum-jerk" goes to object_position, object_rpy, internal_force

[stepper]
name = "midpoint"
step = {period}  # [s]
"""


@dataclass(frozen=True, eq=False)
class Draft:
    """All numbers of a scenario.

    Attributes:
        hand: URDF of the hand.
        remedies: lines that the hand needs.
        tips: those that touch.
        unused: why others do not, by name.
        block: the object.
        friction: mu.
        pressing: least normal force of a tip [N].
        squeeze: internal forces [N], shape (pairs,).
        motors: names of all motors, or joints.
        is_coupled: whether joints are coupled to motors.
        guess: where they are [rad or m], shape (n,).
        period: control period and step [s].
        gains: settings of the controller with their reasons.
        margin: force-closure margin [N/N]; NaN if not known yet.
    """

    hand: Path
    remedies: tuple[str, ...]
    tips: tuple[FoundTip, ...]
    unused: tuple[tuple[str, str], ...]
    block: Block
    friction: float
    pressing: float
    squeeze: Array
    motors: tuple[str, ...]
    is_coupled: bool
    guess: Array
    period: float = 1e-3
    gains: tuple[tuple[str, Any, str], ...] = ()
    margin: float = math.nan

    def with_gains(self, period: float, gains: Sequence[tuple[str, Any, str]]) -> Draft:
        """With another controller."""
        return replace(self, period=period, gains=tuple(gains))

    def text(self, file: Path, block: Path) -> str:
        """The scenario.

        Args:
            file: that it is for.
            block: file of the object.
        """
        radii = [tip.on_body.radius for tip in self.tips]
        usual = max(set(radii), key=radii.count)
        own = {tip.name: tip.on_body.radius for tip in self.tips if tip.on_body.radius != usual}
        pairs = [(i + 1, j + 1) for i, j in contact_pairs(len(radii))]
        usual_period = self.period == 1e-3
        return _TEXT.format(
            title=json.dumps(self.hand.stem, ensure_ascii=False)[1:-1],
            name=file.name,
            count=len(self.tips),
            urdf=_relative(self.hand, file),
            object=_relative(block, file),
            period=repr(self.period),
            period_pad=" " * max(0, 12 - len(repr(self.period))),
            period_why="" if usual_period else "; at 0.001 s small motions of this hand grow: softhand stability",
            hand_rpy=_listed(self.block.hand_rpy),
            hand_why=", turned so that two tips hold the box level" if any(self.block.hand_rpy) else "",
            remedies="".join(f"\n{line}" for line in self.remedies),
            tips="\n".join(f"    {_tip(tip)}" for tip in self.tips),
            unused="".join(f"# {name} is left out: {why}.\n" for name, why in self.unused),
            size=" x ".join(f"{1e3 * value:.4g}" for value in self.block.size),
            mass=self.block.mass,
            position=_listed(self.block.position),
            rpy=_listed(self.block.rpy),
            friction=self.friction,
            radius=usual,
            radius_pad=" " * max(1, 13 - len(f"{usual:g}")),
            radius_why=", as wide as the last links are there" if any(len(t.why) for t in self.tips) else "",
            tip_radii="".join(
                f"\n[fingertip.tips.{json.dumps(name)}]\nradius = {radius:g}  # [m], of this tip\n"
                for name, radius in own.items()
            ),
            margin=""
            if math.isnan(self.margin)
            else f"\n# Force-closure margin {self.margin:.3f} N for one newton of normal force in all; docs/grasp.md",
            points="\n".join(f"    {_listed(point)}," for point in self.block.points),
            pairs=", ".join(f"{i}-{j}" for i, j in pairs),
            pressing=self.pressing,
            squeeze=_listed(self.squeeze),
            motor="motor" if self.is_coupled else "joint",
            motors=", ".join(self.motors),
            guess=_listed(self.guess),
            gains="".join(f"{key} = {_value(value)}  # {why}\n" for key, value, why in self.gains),
        )


def _tip(tip: FoundTip) -> str:
    link = json.dumps(tip.link, ensure_ascii=False)
    if tip.is_frame:
        return f"{link},  # {tip.why}"
    name = json.dumps(tip.name, ensure_ascii=False)
    x, y, z = tip.on_body.centre
    return (
        f"# {tip.why}\n    {{ name = {name}, frame = {link}, position = [{x:g}, {y:g}, {z:g}], "
        f"rpy = {_listed(tip.rpy)} }},"
    )


def _relative(file: Path, scenario: Path) -> str:
    try:
        name = os.path.relpath(file.absolute(), scenario.absolute().parent)
    except ValueError:  # on another drive
        name = str(file.absolute())
    return json.dumps(Path(name).as_posix(), ensure_ascii=False)


def _value(value: Any) -> str:
    if isinstance(value, list | tuple | np.ndarray):
        return _listed(value)
    return json.dumps(value) if isinstance(value, bool | str) else repr(float(f"{value:.4g}"))


def _listed(values: Any) -> str:
    return "[" + ", ".join(repr(round(float(value), 6) + 0.0) for value in values) + "]"
