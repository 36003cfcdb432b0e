"""Springs that stand side by side on the flat face of the tip."""

from __future__ import annotations

from math import pi, sqrt

from softhand.laws.law import Law
from softhand.settings.settings import NonNegative, Positive


class ParallelDistributed(Law):
    """Parallel-distributed springs (Inoue, Hirai): stiffness E / L0 per area along the normal of the flat face [F][Q].

    With thp = pi/2 - Phi, the angle between that normal and the normal of the contact, and d_t the tangential
    displacement towards the apex:

        P   = pi E { d^3 / (3 cos^2 thp) + d^2 d_t tan thp + d d_t^2 }
        F_n = dP/dd   = pi E { d^2 / cos^2 thp + 2 d d_t tan thp + d_t^2 }
        F_t = dP/dd_t = pi E { d^2 tan thp + 2 d d_t }

    At thp = 0 and d_t = 0 this is (4) with k_r = E. The original is planar. In three dimensions, ours: d_t tan thp is
    taken along the lean of the tip, and d d_t^2 is isotropic; torsion has a spring that stands in for what the original
    does not have. Rolling pays for the energy that goes with thp by the moment M = dP/dthp. Reported
    E are 0.20 to 0.23 MPa [U]; the default is the reference tip's k_r.
    """

    coordinates = "surface"
    Phi_range = (45.0, 90.0)

    E: Positive = 0.377e6
    """Young's modulus of the tip [N/m^2]."""
    k_torsional: NonNegative = 0.025
    """Torsional stiffness, a stand-in for the spin of the tip being held [N m/rad]."""

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius, E, k_torsional):
        """(f_n, f_1, f_2, tau); see the class."""
        if dr <= 0.0:
            return 0.0, 0.0, 0.0, 0.0
        cosine = sqrt(1.0 - lean1 * lean1 - lean2 * lean2)  # of thp
        t1, t2 = lean1 / cosine, lean2 / cosine  # tan thp along the lean
        along = s1 * t1 + s2 * t2
        return (
            pi * E * (dr * dr / (cosine * cosine) + 2.0 * dr * along + s1 * s1 + s2 * s2),
            pi * E * (dr * dr * t1 + 2.0 * dr * s1),
            pi * E * (dr * dr * t2 + 2.0 * dr * s2),
            k_torsional * psi,
        )

    @staticmethod
    def energy(dr, s1, s2, psi, lean1, lean2, radius, E, k_torsional):
        """P [J], with that of the torsion spring."""
        if dr <= 0.0:
            return 0.0
        cosine = sqrt(1.0 - lean1 * lean1 - lean2 * lean2)
        along = (s1 * lean1 + s2 * lean2) / cosine
        P = pi * E * (dr**3 / (3.0 * cosine * cosine) + dr * dr * along + dr * (s1 * s1 + s2 * s2))
        return P + 0.5 * k_torsional * psi * psi

    @staticmethod
    def moment(dr, s1, s2, psi, lean1, lean2, radius, E, k_torsional):
        """(m_1, m_2) [N m]: M = dP/dthp along the lean, and what P asks for across it."""
        if dr <= 0.0:
            return 0.0, 0.0
        square = 1.0 - lean1 * lean1 - lean2 * lean2
        lever = 2.0 * dr**3 / (3.0 * square * sqrt(square)) + dr * dr * (s1 * lean1 + s2 * lean2) / square
        return -pi * E * (lever * lean2 + dr * dr * s2), pi * E * (lever * lean1 + dr * dr * s1)
