"""Damping that grows with the force."""

from __future__ import annotations

from softhand.dampings.damping import Channels, Damping
from softhand.settings.settings import NonNegative


class HuntCrossley(Damping):
    """Hunt-Crossley: F (1 + lambda d'), damping in proportion to the normal force [F].

    No jump at the first touch. The original has the normal direction only; here the tangential directions and the
    torsion get lambda F_n times their own velocity, ours.

    Attributes:
        radial: lambda of the normal direction [s/m].
        tangential: of the two tangential directions [s/m].
        torsional: of the torsion [m s/rad].
    """

    radial: NonNegative = 0.2
    tangential: NonNegative = 0.2
    torsional: NonNegative = 2e-5

    def viscosity_per_force(self) -> Channels:
        """The three lambda."""
        return self.radial, self.tangential, self.torsional
