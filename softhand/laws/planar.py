"""The paper's law in a plane."""

from __future__ import annotations

from math import cos, pi

from softhand.laws.law import Law
from softhand.settings.settings import NonNegative, Positive


class Planar(Law):
    """Planar, in the manner of Nagase: (4) and (6) of the paper only, motion kept in a plane [U].

        Fr = pi k_r dr^2,   Fphi = (2 / 3) k_phi r^3 (1 / phi + 1 / (pi - phi)) dphi

    The original moves in the plane of dr and dphi. A hand in space needs something to hold the tip across it:
    `k_tangential` and `k_torsional` stand in for the plane. With both 0 the law is the original's, and only a grasp
    without forces across the plane has a start.
    """

    Phi_range = (0.0, 85.0)

    k_r: Positive = 0.377e6
    """Radial stiffness coefficient of (4) [N/m^2]."""
    k_phi: Positive = 0.166e6
    """Coefficient of the compressive angle, (6) [N/m^2]."""
    k_tangential: NonNegative = 2500.0
    """Stiffness across the plane, along growing Theta, a stand-in for the plane [N/m]."""
    k_torsional: NonNegative = 0.025
    """Torsional stiffness, a stand-in for the plane [N m/rad]."""

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius, k_r, k_phi, k_tangential, k_torsional):
        """(Fr, Ftheta, Fphi, Fpsi); see the class."""
        depth = max(dr, 0.0)
        lever = (radius - depth) * cos(phi - dphi)
        return (
            pi * k_r * depth * depth,
            k_tangential * lever * lever * dtheta,
            2.0 / 3.0 * k_phi * radius**3 * pi / (phi * (pi - phi)) * dphi,
            k_torsional * dpsi if dr > 0.0 else 0.0,
        )
