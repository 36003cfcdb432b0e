"""The pad of a human finger: its stiffness grows with the force that it carries."""

from __future__ import annotations

from math import exp, expm1

from softhand.laws.law import Law
from softhand.settings.settings import Positive

_THIN = 0.025  # of the radius, below which the shear lets go, as of `Hemisphere`


class Fingerpad(Law):
    """Human fingerpad (Pawluk, Howe): F = (b / m) (e^(m d) - 1); shear stiffness linear in the normal force [F][U].

        U = int F dd + (1/2) k_t |s|^2 + (1/2) K_psi psi^2,   k_t = c F' {1 - e^(-(d / 0.025 r)^2)},   K_psi = k_t r d

    and the force is its slope: f_n = dU/dd, f_t = k_t s, tau = K_psi psi. F is the instantaneous elastic response of a
    pad against a plate for 0 to 2 N, Pawluk and Howe, J. Biomech. Eng. 121 (1999) 178: F' = b + m F [F]. That k_t is
    linear in F is from Pataky, Latash and Zatsiorsky, J. Biomech. 38 (2005) 1441; the default c = 2/3 is Mindlin's
    ratio 2 (1 - nu) / (2 - nu) of both stiffnesses for an incompressible half-space, whatever its profile, and
    K_psi / k_t is its a^2, with a^2 = r d [U]. The last factor lets k_t vanish with the contact, ours. The pressure is
    an inverted paraboloid, as Pawluk and Howe measured (the same volume, 605), so the largest torsion is
    (8/15) mu f_n a: of the models of torsional friction of fingertips of Barbagli et al. 2004 the one of this pad. A
    pad relaxes: `fung` with the rates 250, 14 and 0.7 1/s has the times 4 ms, 70 ms and 1.4 s of Pawluk and Howe.
    Persons differ: b and m are fitted by `softhand identify`; the defaults are no person's but give the reference tip's
    force at d = 2.3 mm.

    As one energy holds all of it, a pad under much shear peels off, from f_t = sqrt(c / 2) (f_n + b / m) on: 0.58 of
    the pressing force and a little more. Where the friction is above that take c = 2 mu^2 or more.
    """

    coordinates = "surface"
    torsion_share = 8.0 / 15.0  # mean distance of an inverted paraboloid from its middle, over a
    deepest = 0.4
    Phi_range = (45.0, 90.0)

    b: Positive = 946.0
    """Stiffness of a light touch [N/m]."""
    m: Positive = 800.0
    """Growth of the stiffness with the depth, and with the force [1/m]."""
    c: Positive = 2.0 / 3.0
    """Tangential over normal stiffness [1]."""

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius, b, m, c):
        """(f_n, f_1, f_2, tau); see the class."""
        if dr <= 0.0:
            return 0.0, 0.0, 0.0, 0.0
        k, k_rate, _ = _shearing(dr, radius, b, m, c)
        stored = 0.5 * (s1 * s1 + s2 * s2 + radius * dr * psi * psi)
        normal = b / m * expm1(m * dr) + k_rate * stored + 0.5 * k * radius * psi * psi
        return normal, k * s1, k * s2, k * radius * dr * psi

    @staticmethod
    def stiffness(dr, s1, s2, psi, lean1, lean2, radius, b, m, c):
        """Second derivatives of the energy, row by row."""
        # fmt: off
        if dr <= 0.0:
            return (
                0.0, 0.0, 0.0, 0.0,
                0.0, 0.0, 0.0, 0.0,
                0.0, 0.0, 0.0, 0.0,
                0.0, 0.0, 0.0, 0.0,
            )
        k, k_rate, k_bend = _shearing(dr, radius, b, m, c)
        stored = 0.5 * (s1 * s1 + s2 * s2 + radius * dr * psi * psi)
        normal = b * exp(m * dr) + k_bend * stored + k_rate * radius * psi * psi
        twist = radius * (k + k_rate * dr) * psi
        return (
            normal, k_rate * s1, k_rate * s2, twist,
            k_rate * s1, k, 0.0, 0.0,
            k_rate * s2, 0.0, k, 0.0,
            twist, 0.0, 0.0, k * radius * dr,
        )
        # fmt: on

    @staticmethod
    def energy(dr, s1, s2, psi, lean1, lean2, radius, b, m, c):
        """U [J]."""
        if dr <= 0.0:
            return 0.0
        k, _, _ = _shearing(dr, radius, b, m, c)
        pressed = (b / m * expm1(m * dr) - b * dr) / m
        return pressed + 0.5 * k * (s1 * s1 + s2 * s2 + radius * dr * psi * psi)


def _shearing(d, radius, b, m, c):
    """k_t and its first and second derivative by d > 0."""
    thin = _THIN * radius
    x = d / thin
    left = exp(-x * x)
    g, g_rate, g_bend = 1.0 - left, 2.0 * x / thin * left, 2.0 / thin**2 * (1.0 - 2.0 * x * x) * left
    k = c * b * exp(m * d)
    return k * g, k * (m * g + g_rate), k * (m * m * g + 2.0 * m * g_rate + g_bend)
