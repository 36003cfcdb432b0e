"""Only a radial spring; rolling holds the rest."""

from __future__ import annotations

from math import pi

from softhand.laws.law import Law
from softhand.settings.settings import NonNegative, Positive


class Radial(Law):
    """Radial (Arimoto): f = K dr^2 along the surface normal; rolling is a constraint, here stiff springs [F].

        f_n = K dr^2   (dr > 0),   U = K dr^3 / 3

    K = pi k_r equals (4). The law has no tangential or torsional force: in the original, pure rolling holds these
    directions. softhand has springs in place of constraints, so `k_tangential` and `k_torsional` stand in for it while
    the tip touches. The original's xi(dr) dr' is a damping: `hunt-crossley` or `kelvin-voigt`.
    """

    coordinates = "surface"

    K: Positive = pi * 0.377e6
    """Coefficient of dr^2 [N/m^2]."""
    k_tangential: NonNegative = 2500.0
    """Tangential stiffness, a stand-in for the rolling constraint [N/m]."""
    k_torsional: NonNegative = 0.025
    """Torsional stiffness, a stand-in for the spin of the tip being held [N m/rad]."""

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius, K, k_tangential, k_torsional):
        """(f_n, f_1, f_2, tau); see the class."""
        if dr <= 0.0:
            return 0.0, 0.0, 0.0, 0.0
        return K * dr * dr, k_tangential * s1, k_tangential * s2, k_torsional * psi

    @staticmethod
    def energy(dr, s1, s2, psi, lean1, lean2, radius, K, k_tangential, k_torsional):
        """U [J] of a tip that touches, the stand-ins included."""
        if dr <= 0.0:
            return 0.0
        return K * dr**3 / 3.0 + 0.5 * k_tangential * (s1 * s1 + s2 * s2) + 0.5 * k_torsional * psi * psi
