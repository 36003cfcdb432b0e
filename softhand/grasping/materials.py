"""What counts of a fingertip before it touches: its law, friction and torsion."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from softhand.assembly.parts import read_law
from softhand.contact.limit import spin_length
from softhand.contact.records import PAD
from softhand.laws.law import Law
from softhand.scenario.scenario import Scenario
from softhand.start.press import plain_depth

_USUAL_PHI = math.radians(60.0)  # where a tip is taken to press whose angle is not known
_LEAST_FORCE = 1.0  # [N] with which a tip is taken to press whose force is not known


class Material(NamedTuple):
    """One fingertip."""

    law: Law
    friction: float
    """mu where the face has none of its own."""
    given_length: float
    """tau_max / (mu f_z) [m] where the scenario gives it, or 0."""

    def depth(self, pressing: float) -> float:
        """dr [m] under a normal force [N] without shear; that of 1 N if the force is not known or pulls."""
        return plain_depth(self.law, _USUAL_PHI, 0.0, pressing if pressing > _LEAST_FORCE else _LEAST_FORCE)

    def torsion_length(self, depth: float) -> float:
        """tau_max / (mu f_z) at a depth [m]."""
        pad = np.zeros(1, PAD)[0]
        pad["radius"], pad["torsion_share"] = self.law.radius, self.law.torsion_share or 0.0
        pad["torsion_length"] = self.given_length
        return float(spin_length(pad, self.law.radius - depth))


def read_materials(scenario: Scenario) -> tuple[Material, ...]:
    """That of each fingertip of a scenario."""
    tips = [(name, scenario.fingertip.at(name)) for name in scenario.hand.names]
    return tuple(Material(read_law(scenario, name), tip.friction, tip.torsion_length or 0.0) for name, tip in tips)
