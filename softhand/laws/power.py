"""Force as a power of the depth."""

from __future__ import annotations

from math import gamma, pi
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from softhand.laws.law import Law
from softhand.settings.settings import NonNegative, Positive


class Power(Law):
    """Power law (Xydas, Kao): N = c_d d^zeta; the contact radius grows as a = c N^gamma, zeta = 1 / (2 gamma) [F].

    gamma = n / (2 n + 1) lies in [0, 1/3], n the exponent of the material, so zeta >= 1.5: 1.5 is Hertz, 2 the paper's
    law (4) with c_d = pi k_r, the default. The law has no tangential or torsional force; `k_tangential` and
    `k_torsional` stand in for the rolling constraint while the tip touches.
    """

    coordinates = "surface"

    c_d: Positive = pi * 0.377e6
    """Coefficient of the normal force [N/m^zeta]."""
    zeta: Annotated[float, Field(ge=1.5)] = 2.0
    """Exponent of the depth [1]."""
    k_tangential: NonNegative = 2500.0
    """Tangential stiffness, a stand-in for the rolling constraint [N/m]."""
    k_torsional: NonNegative = 0.025
    """Torsional stiffness, a stand-in for the spin of the tip being held [N m/rad]."""

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius, c_d, zeta, k_tangential, k_torsional):
        """(f_n, f_1, f_2, tau); see the class."""
        if dr <= 0.0:
            return 0.0, 0.0, 0.0, 0.0
        return c_d * dr**zeta, k_tangential * s1, k_tangential * s2, k_torsional * psi

    @staticmethod
    def energy(dr, s1, s2, psi, lean1, lean2, radius, c_d, zeta, k_tangential, k_torsional):
        """U [J] of a tip that touches, the stand-ins included."""
        if dr <= 0.0:
            return 0.0
        shear = 0.5 * k_tangential * (s1 * s1 + s2 * s2)
        return c_d * dr ** (zeta + 1.0) / (zeta + 1.0) + shear + 0.5 * k_torsional * psi * psi


def pressure(rho: ArrayLike, a: float, N: float, k: float) -> NDArray[np.float64]:
    """Contact pressure p = C_k N / (pi a^2) [1 - (rho / a)^k]^(1/k) of the power law; its integral is N.

    Args:
        rho: distance from the middle of the contact [m].
        a: radius of the contact [m].
        N: normal force [N].
        k: shape: 2 is Hertz, larger is flatter.

    Returns:
        [N/m^2], zero outside, shape of rho.
    """
    # C_k int_0^1 2 x (1 - x^k)^(1/k) dx = 1, and the integral is (2 / k) B(2 / k, 1 + 1 / k)
    C_k = 0.5 * k * gamma(1.0 + 3.0 / k) / (gamma(2.0 / k) * gamma(1.0 + 1.0 / k))
    inside = np.clip(1.0 - (np.asarray(rho, dtype=float) / a) ** k, 0.0, None)
    return C_k * N / (pi * a * a) * inside ** (1.0 / k)
