"""A hard fingertip: one point, as stiff as the integration bears."""

from __future__ import annotations

from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.laws.law import Law
from softhand.settings.settings import Positive


class Point(Law):
    """Rigid point contact with friction (Yokokohji), as a penalty: stiff in all four directions [F].

        f_n = k d,   f_t = k_tangential s,   tau = k_torsional psi, within +- gamma f_n

    The original is rigid; the stiffness stands in for that, and the higher it is, the smaller the step must be for
    all steppers but `midpoint`. A controller that feeds forces back once a millisecond makes an undamped penalty ring
    until it breaks, so this law brings a `kelvin-voigt` damping, 10 N s/m, where a scenario has none. The limit of the
    torsion is elastic: psi goes on and comes back.
    """

    coordinates = "surface"
    damping = KelvinVoigt(radial=10.0, tangential=10.0, torsional=1e-3)
    deepest = 0.1

    k: Positive = 5e4
    """Stiffness along the normal, a penalty [N/m]."""
    k_tangential: Positive = 5e4
    """Tangential stiffness, likewise [N/m]."""
    k_torsional: Positive = 0.5
    """Torsional stiffness, likewise [N m/rad]."""
    gamma: Positive = 1.5e-3
    """Largest torsion moment over the normal force [m]."""

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius, k, k_tangential, k_torsional, gamma):
        """(f_n, f_1, f_2, tau); see the class."""
        if dr <= 0.0:
            return 0.0, 0.0, 0.0, 0.0
        limit = gamma * k * dr
        return k * dr, k_tangential * s1, k_tangential * s2, min(max(k_torsional * psi, -limit), limit)
