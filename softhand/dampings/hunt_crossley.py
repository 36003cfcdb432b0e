"""Damping that grows with the force."""

from __future__ import annotations

from softhand.dampings.damping import Channels, Damping
from softhand.settings.settings import NonNegative


class HuntCrossley(Damping):
    """Hunt-Crossley: F (1 + lambda d'), damping in proportion to the normal force [F].

    No jump at the first touch. The original has the normal direction only; here the tangential directions and the
    torsion get lambda F_n times their own velocity, ours.
    """

    radial: NonNegative = 0.2
    """Damping lambda along the normal, over the normal force [s/m]."""
    tangential: NonNegative = 0.2
    """The same in the two tangential directions [s/m]."""
    torsional: NonNegative = 2e-5
    """The same of the torsion [m s/rad]."""

    def viscosity_per_force(self) -> Channels:
        """The three lambda."""
        return self.radial, self.tangential, self.torsional
