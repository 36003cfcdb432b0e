"""The paper's law made a spring: the force is the slope of an energy, and nothing is singular at the apex."""

from __future__ import annotations

from math import exp, pi

from softhand.laws.law import Law
from softhand.settings.settings import NonNegative, Positive


class Conservative(Law):
    """Energy-consistent: (4), (6) at the apex and (12) as the slope of one energy, no pole.

        U   = (pi / 3) k_r d^3 + (1/2) k_t(d) |s|^2 + (1/2) K_tau(d) psi^2
        f_n = pi k_r d^2 + (1/2) k_t' |s|^2 + (1/2) K_tau' psi^2,   f_t = k_t s,   tau = K_tau psi
        k_t = 8 / (3 pi) k_phi r^3 / (r - d)^2  exp(growth (d / r - 0.3))  {1 - exp(-(d / (0.05 r))^2)}
        K_tau = (pi / 10) k_psi (2 r d - d^2)^2

    with d = dr. It gives (4) without shear and torsion, the stiffness of (6) at phi = 90 deg and d = 0.3 r, and (12);
    by design it does not give (9): it is isotropic. Finite elements of a bonded hemisphere have growth = 5.1 for
    d / r = 0.1 to 0.4 [Q]. The default is 0, as in (6): with 5.1 a tip under much shear softens so fast as it is
    relieved that it peels off inside the friction cone. The last factor, ours, lets k_t vanish with the contact.
    """

    coordinates = "surface"
    deepest = 0.4

    k_r: Positive = 0.377e6
    """Radial stiffness coefficient of (4) [N/m^2]."""
    k_phi: Positive = 0.166e6
    """Coefficient of the tangential stiffness, as in (6) [N/m^2]."""
    k_psi: Positive = 0.0488e9
    """Coefficient of the torsion, as in (12) [N/m^3]."""
    growth: NonNegative = 0.0
    """Growth of the logarithm of the tangential stiffness with dr / r [1]."""

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius, k_r, k_phi, k_psi, growth):
        """(f_n, f_1, f_2, tau); see the class."""
        d = max(dr, 0.0)
        k_t, k_t_rate, _ = _tangential(d, radius, k_phi, growth)
        disc, twist = d * (2.0 * radius - d), pi / 10.0 * k_psi
        normal = pi * k_r * d * d + 0.5 * k_t_rate * (s1 * s1 + s2 * s2)
        return (
            normal + 2.0 * twist * disc * (radius - d) * psi * psi,
            k_t * s1,
            k_t * s2,
            twist * disc * disc * psi,
        )

    @staticmethod
    def stiffness(dr, s1, s2, psi, lean1, lean2, radius, k_r, k_phi, k_psi, growth):
        """Second derivatives of the energy, row by row."""
        d = max(dr, 0.0)
        pressed = 1.0 if dr > 0.0 else 0.0
        k_t, k_t_rate, k_t_bend = _tangential(d, radius, k_phi, growth)
        disc, R, twist = d * (2.0 * radius - d), radius - d, pi / 10.0 * k_psi
        normal = 2.0 * pi * k_r * d + 0.5 * k_t_bend * (s1 * s1 + s2 * s2)
        normal += 2.0 * twist * (2.0 * R * R - disc) * psi * psi
        first, second = pressed * k_t_rate * s1, pressed * k_t_rate * s2
        torsion = 4.0 * twist * disc * R * psi
        # fmt: off
        return (
            pressed * normal, first, second, torsion,
            first, k_t, 0.0, 0.0,
            second, 0.0, k_t, 0.0,
            torsion, 0.0, 0.0, twist * disc * disc,
        )
        # fmt: on

    @staticmethod
    def energy(dr, s1, s2, psi, lean1, lean2, radius, k_r, k_phi, k_psi, growth):
        """U [J]."""
        d = max(dr, 0.0)
        k_t, _, _ = _tangential(d, radius, k_phi, growth)
        disc = d * (2.0 * radius - d)
        shear = 0.5 * k_t * (s1 * s1 + s2 * s2)
        return pi / 3.0 * k_r * d**3 + shear + pi / 20.0 * k_psi * disc * disc * psi * psi


def _tangential(d, radius, k_phi, growth):
    """k_t(d) and its first and second derivative."""
    R, thin = radius - d, 0.05 * radius
    x = d / thin
    fade = exp(-x * x)
    g, g_rate, g_bend = 1.0 - fade, 2.0 * x / thin * fade, 2.0 / thin**2 * (1.0 - 2.0 * x * x) * fade
    A = 8.0 / (3.0 * pi) * k_phi * radius**3 / R**2 * exp(growth * (d / radius - 0.3))
    slope = 2.0 / R + growth / radius
    A_rate, A_bend = A * slope, A * (slope * slope + 2.0 / R**2)
    return A * g, A_rate * g + A * g_rate, A_bend * g + 2.0 * A_rate * g_rate + A * g_bend
