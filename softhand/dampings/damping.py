"""What a damping is: numbers for the one formula of `contact.damping`."""

from __future__ import annotations

from softhand.settings.settings import Settings

Channels = tuple[float, float, float]
"""Radial, tangential, torsional."""


class Damping(Settings):
    """Damping of a tip, whatever its law. A subclass overrides what it needs.

        F <- F - sum_k c_k w_k,   w_k' = nu_k (F - w_k)             in the coordinates of the law
        f <- f + (c + lambda f_n) velocity                          in the contact frame, each channel by itself

    The total normal force is never tensile; a tip that does not touch is not damped.
    """

    def viscosity(self) -> Channels:
        """c: radial and tangential [N s/m], torsional [N m s/rad]."""
        return 0.0, 0.0, 0.0

    def viscosity_per_force(self) -> Channels:
        """lambda: radial and tangential [s/m], torsional [m s/rad]."""
        return 0.0, 0.0, 0.0

    def relaxation(self) -> tuple[tuple[float, float], ...]:
        """(c_k, nu_k [1/s]) of each relaxation; the c_k are positive and their sum is below 1."""
        return ()

    def relaxed(self) -> float:
        """Share of the law's force that is left at rest, c_0 = 1 - sum c_k."""
        return 1.0 - sum(share for share, _ in self.relaxation())
