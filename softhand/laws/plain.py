"""The plainest compliant contact, for what is no fingertip: the corner of an object, a palm, two tips in series."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from softhand.laws.law import Law
from softhand.settings.settings import NonNegative, Positive


class Plain(Law):
    """A spring in each direction, the normal one a power of the depth.

        f_n = c d^zeta,   f_t = k_tangential s,   tau = k_torsional psi   (d > 0)

    The radius is not used.
    """

    coordinates = "surface"

    c: Positive
    """Coefficient of the normal force [N/m^zeta]."""
    zeta: Annotated[float, Field(ge=1)] = 1.0
    """Exponent of the depth [1]; 1 is a linear spring."""
    k_tangential: NonNegative
    """Tangential stiffness [N/m]."""
    k_torsional: NonNegative = 0.0
    """Torsional stiffness [N m/rad]."""

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius, c, zeta, k_tangential, k_torsional):
        """(f_n, f_1, f_2, tau); see the class."""
        if dr <= 0.0:
            return 0.0, 0.0, 0.0, 0.0
        return c * dr**zeta, k_tangential * s1, k_tangential * s2, k_torsional * psi

    @staticmethod
    def stiffness(dr, s1, s2, psi, lean1, lean2, radius, c, zeta, k_tangential, k_torsional):
        """Derivatives of (f_n, f_1, f_2, tau), row by row."""
        normal, touching = (c * zeta * dr ** (zeta - 1.0), 1.0) if dr > 0.0 else (0.0, 0.0)
        # fmt: off
        return (
            normal, 0.0, 0.0, 0.0,
            0.0, touching * k_tangential, 0.0, 0.0,
            0.0, 0.0, touching * k_tangential, 0.0,
            0.0, 0.0, 0.0, touching * k_torsional,
        )
        # fmt: on

    @staticmethod
    def energy(dr, s1, s2, psi, lean1, lean2, radius, c, zeta, k_tangential, k_torsional):
        """U [J]."""
        if dr <= 0.0:
            return 0.0
        shear = 0.5 * k_tangential * (s1 * s1 + s2 * s2)
        return c * dr ** (zeta + 1.0) / (zeta + 1.0) + shear + 0.5 * k_torsional * psi * psi
