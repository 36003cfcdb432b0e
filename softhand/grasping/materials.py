"""What counts of a fingertip before it touches: its law, friction and torsion."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from softhand.assembly.parts import read_law
from softhand.contact.limit import set_limit
from softhand.contact.pads import Limit, choose_limit
from softhand.contact.records import CONTACT, PAD
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.scenario.scenario import Scenario
from softhand.start.press import plain_depth

_USUAL_PHI = math.radians(60.0)  # where a tip is taken to press whose angle is not known
_LEAST_FORCE = 1.0  # [N] with which a tip is taken to press whose force is not known


class Torsion(NamedTuple):
    """How a pressed tip holds against a spin, see `contact.limit.set_limit`."""

    length: float
    """l = tau_max / (mu f_z) [m], about 0 for a hard finger."""
    curve: Array
    """c_i of the limit surface of force and torsion, zeros for the ellipse, shape (5,)."""


class Material(NamedTuple):
    """One fingertip."""

    law: Law
    friction: float
    """mu where the face has none of its own."""
    given_length: float
    """tau_max / (mu f_z) [m] where the scenario gives it, or 0."""
    limit: Limit
    """Kind of the limit surface."""

    def depth(self, pressing: float) -> float:
        """dr [m] under a normal force [N] without shear; that of 1 N if the force is not known or pulls."""
        return plain_depth(self.law, _USUAL_PHI, 0.0, pressing if pressing > _LEAST_FORCE else _LEAST_FORCE)

    def torsion(self, depth: float) -> Torsion:
        """What it holds with at a depth [m]."""
        pad, contact = np.zeros(1, PAD)[0], np.zeros(1, CONTACT)[0]
        pad["radius"], pad["torsion_share"] = self.law.radius, self.law.torsion_share or 0.0
        pad["torsion_length"] = self.given_length
        choose_limit(pad, self.limit, self.law.torsion_share)
        contact["distance"] = self.law.radius - depth
        set_limit(pad, contact)
        return Torsion(float(contact["lever"]), contact["curve"].copy())


def read_materials(scenario: Scenario) -> tuple[Material, ...]:
    """That of each fingertip of a scenario."""
    tips = [(name, scenario.fingertip.at(name)) for name in scenario.hand.names]
    return tuple(
        Material(read_law(scenario, name), tip.friction, tip.torsion_length or 0.0, tip.limit) for name, tip in tips
    )
