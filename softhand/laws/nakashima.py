"""The law of the paper: four uncoupled springs whose stiffness depends on where the tip touches."""

from __future__ import annotations

from math import cos, pi, sin

from softhand.laws.law import Law
from softhand.settings.settings import Positive


class Nakashima(Law):
    """Deformation force of [Nakashima] Eqs. (4), (6), (9) and (12).

        Fr     = pi k_r dr^2                                                        (4)
        Ftheta = (pi / 10) k_theta r^4 {1 + c (1 + c) (1 + c^2)} dtheta,  c = |cos phi|      (9)
        Fphi   = (2 / 3) k_phi r^3 (1 / phi + 1 / (pi - phi)) dphi                  (6)
        Fpsi   = (pi / 10) k_psi {r^2 - (r - dr)^2}^2 dpsi                          (12)

    Fr is zero for dr <= 0. The paper has cos phi in (9), which holds up to phi = 90 deg; its integral needs the
    absolute value beyond. The field is not conservative: dFpsi/d(dr) is not zero while dFr/d(dpsi) is.
    """

    Phi_range = (0.0, 85.0)

    k_r: Positive
    """Radial stiffness coefficient of (4) [N/m^2]."""
    k_phi: Positive
    """Coefficient of the compressive angle, (6) [N/m^2]."""
    k_theta: Positive
    """Coefficient of the shearing angle, (9) [N/m^3]."""
    k_psi: Positive
    """Coefficient of the torsion, (12) [N/m^3]."""

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius, k_r, k_phi, k_theta, k_psi):
        """(Fr, Ftheta, Fphi, Fpsi); see the class."""
        c = abs(cos(phi))
        depth = max(dr, 0.0)
        disc = depth * (2.0 * radius - depth)
        return (
            pi * k_r * depth**2,
            pi / 10.0 * k_theta * radius**4 * (1.0 + c * (1.0 + c) * (1.0 + c * c)) * dtheta,
            2.0 / 3.0 * k_phi * radius**3 * pi / (phi * (pi - phi)) * dphi,
            pi / 10.0 * k_psi * disc * disc * dpsi,
        )

    @staticmethod
    def stiffness(dr, dtheta, dphi, dpsi, phi, radius, k_r, k_phi, k_theta, k_psi):
        """Derivatives of (Fr, Ftheta, Fphi, Fpsi) with respect to (dr, dtheta, dphi, dpsi), row by row."""
        cosine = cos(phi)
        c = abs(cosine)
        c_rate = -sin(phi) if cosine >= 0.0 else sin(phi)
        k_shear = pi / 10.0 * k_theta * radius**4
        k_bend = 2.0 / 3.0 * k_phi * radius**3
        k_twist = pi / 10.0 * k_psi
        spread = pi / (phi * (pi - phi))
        spread_rate = -spread * spread * (pi - 2.0 * phi) / pi
        depth = max(dr, 0.0)
        disc = depth * (2.0 * radius - depth)
        disc_rate = 2.0 * (radius - depth) if dr > 0.0 else 0.0
        shear = k_shear * (1.0 + c * (1.0 + c) * (1.0 + c * c))
        shear_by_phi = k_shear * (1.0 + c * (2.0 + c * (3.0 + 4.0 * c))) * c_rate * dtheta
        bend = k_bend * (spread + spread_rate * dphi)
        twist_by_depth = 2.0 * k_twist * disc * disc_rate * dpsi
        # fmt: off
        return (
            2.0 * pi * k_r * depth, 0.0, 0.0, 0.0,
            0.0, shear, shear_by_phi, 0.0,
            0.0, 0.0, bend, 0.0,
            twist_by_depth, 0.0, 0.0, k_twist * disc * disc,
        )
        # fmt: on
