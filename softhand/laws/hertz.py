"""Elastic half-spaces: Hertz, with Mindlin's tangential and torsional stiffness."""

from __future__ import annotations

from math import pi, sqrt
from typing import Annotated

from pydantic import Field

from softhand.laws.law import Law
from softhand.settings.settings import Positive


class Hertz(Law):
    """Hertz: sphere on a plane, small strain; tangential and torsional stiffness of Mindlin without slip [F].

        f_n = (4 / 3) E / (1 - nu^2) sqrt(r) d^1.5,   a^2 = r d,   G = E / (2 (1 + nu))
        f_t = 8 a G / (2 - nu) s,   tau = (16 / 3) G a^3 psi

    f_n does not depend on s and psi, as these stiffnesses do on d: no energy, a grasp may gain or lose some. Meant for
    d << r; a grasp of the reference hand is beyond that, and the recording says so. The default E gives the reference
    tip's force at d = 2.3 mm.
    """

    coordinates = "surface"
    torsion_share = 3.0 * pi / 16.0  # of p = p_0 sqrt(1 - (rho / a)^2)
    deepest = 0.1

    E: Positive = 0.32e6
    """Young's modulus of the tip [N/m^2]; the object is rigid."""
    nu: Annotated[float, Field(ge=0, le=0.5)] = 0.5
    """Poisson's ratio of the tip [1]."""

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius, E, nu):
        """(f_n, f_1, f_2, tau); see the class."""
        d = max(dr, 0.0)
        a = sqrt(radius * d)
        G = E / (2.0 * (1.0 + nu))
        k_t = 8.0 * a * G / (2.0 - nu)
        return 4.0 / 3.0 * E / (1.0 - nu * nu) * a * d, k_t * s1, k_t * s2, 16.0 / 3.0 * G * a**3 * psi
