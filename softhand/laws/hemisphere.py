"""One material: a bonded elastic hemisphere of a shear modulus and Poisson's ratio, the slope of one energy."""

from __future__ import annotations

from math import exp, pi, sqrt
from typing import Annotated

from pydantic import Field

from softhand.laws.law import Law
from softhand.settings.settings import Positive

PRESSED, TWISTED, SQUEEZED = 0.9, -0.65, 4.0
"""Numbers of finite elements, see `Hemisphere`."""
LEANING, LEANING_SQUEEZED = 1.15, 20.0
"""Likewise, of elements in three dimensions."""
_THIN = 0.025  # of the radius, below which the shear lets go


class Hemisphere(Law):
    """A hemisphere of shear modulus G and Poisson's ratio nu, bonded at its flat face; no other coefficient.

        U       = (16 / 15) G / (1 - nu) sqrt(r) d^2.5 e^(b d / r) + (1/2) k_t(d) |t|^2 + (1/2) K_psi(d) psi^2
        1 / k_t = (2 - nu) / (8 G sqrt(r d)) + R^2 / (pi G r^3),   R = r - d
        K_psi   = (16 / 3) G (r d)^1.5 e^(c d / r),   b = 0.9 + 4 nu^2,   c = 4 nu^2 - 0.65
        t       = s + beta l,   beta = (1.15 + 20 nu^3) d^2 / r,   l the lean, of length cos Phi

    and the force is its slope: f_t = k_t t, tau = K_psi psi, f_n = dU/dd; rolling costs the moment of the slope
    dU/dl = beta f_t. As d goes to 0 it is Hertz's ball, and the disc of radius sqrt(r d) of Mindlin and of Reissner and
    Sagoci on a half-space [F]. The second part of 1 / k_t is the tip behind the disc: slices in series, which have no
    pole at the apex [Q]. b and c are those of finite elements of a neo-Hookean body, nu from 0.1 to 0.5, d up to 0.4 r:
    the base keeps the sides from giving way [Q]. A tip that leans gives way sideways as it is pressed; sticking keeps
    it from that by the force k_t beta l towards the apex. beta is that of finite elements of a tip that leans by up to
    45 deg, d up to 0.3 r [Q]; one that is pressed and then rolled has more. Below d = 0.05 r the shear fades, so that
    it vanishes with the contact (ours). The default G gives the reference tip's force at d = 2.3 mm.
    """

    coordinates = "surface"
    torsion_share = 3.0 * pi / 16.0  # Hertz's pressure
    deepest = 0.4
    Phi_range = (45.0, 90.0)

    G: Positive = 58.6e3
    """Shear modulus of the tip [N/m^2]."""
    nu: Annotated[float, Field(ge=0, le=0.5)] = 0.5
    """Poisson's ratio of the tip [1]; 0.5 is incompressible, as rubber nearly is."""

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius, G, nu):
        """(f_n, f_1, f_2, tau); see the class."""
        if dr <= 0.0:
            return 0.0, 0.0, 0.0, 0.0
        _, press, _ = _pressing(dr, radius, G, nu)
        k_t, k_t_rate, _ = _shearing(dr, radius, G, nu)
        K, K_rate, _ = _twisting(dr, radius, G, nu)
        beta, beta_rate, _ = _leaning(dr, radius, nu)
        t1, t2 = s1 + beta * lean1, s2 + beta * lean2
        normal = press + 0.5 * k_t_rate * (t1 * t1 + t2 * t2) + 0.5 * K_rate * psi * psi
        return normal + k_t * beta_rate * (t1 * lean1 + t2 * lean2), k_t * t1, k_t * t2, K * psi

    @staticmethod
    def stiffness(dr, s1, s2, psi, lean1, lean2, radius, G, nu):
        """Second derivatives of the energy, row by row."""
        # fmt: off
        if dr <= 0.0:
            return (
                0.0, 0.0, 0.0, 0.0,
                0.0, 0.0, 0.0, 0.0,
                0.0, 0.0, 0.0, 0.0,
                0.0, 0.0, 0.0, 0.0,
            )
        _, _, press_rate = _pressing(dr, radius, G, nu)
        k_t, k_t_rate, k_t_bend = _shearing(dr, radius, G, nu)
        K, K_rate, K_bend = _twisting(dr, radius, G, nu)
        beta, beta_rate, beta_bend = _leaning(dr, radius, nu)
        t1, t2 = s1 + beta * lean1, s2 + beta * lean2
        normal = press_rate + 0.5 * k_t_bend * (t1 * t1 + t2 * t2) + 0.5 * K_bend * psi * psi
        normal += (2.0 * k_t_rate * beta_rate + k_t * beta_bend) * (t1 * lean1 + t2 * lean2)
        normal += k_t * beta_rate * beta_rate * (lean1 * lean1 + lean2 * lean2)
        first, second = k_t_rate * t1 + k_t * beta_rate * lean1, k_t_rate * t2 + k_t * beta_rate * lean2
        return (
            normal, first, second, K_rate * psi,
            first, k_t, 0.0, 0.0,
            second, 0.0, k_t, 0.0,
            K_rate * psi, 0.0, 0.0, K,
        )
        # fmt: on

    @staticmethod
    def moment(dr, s1, s2, psi, lean1, lean2, radius, G, nu):
        """(m_1, m_2) of the slope beta f_t of the energy by the lean."""
        if dr <= 0.0:
            return 0.0, 0.0
        k_t, _, _ = _shearing(dr, radius, G, nu)
        beta, _, _ = _leaning(dr, radius, nu)
        slope = beta * k_t * sqrt(1.0 - lean1 * lean1 - lean2 * lean2)
        return -slope * (s2 + beta * lean2), slope * (s1 + beta * lean1)

    @staticmethod
    def energy(dr, s1, s2, psi, lean1, lean2, radius, G, nu):
        """U [J]."""
        if dr <= 0.0:
            return 0.0
        press, _, _ = _pressing(dr, radius, G, nu)
        k_t, _, _ = _shearing(dr, radius, G, nu)
        K, _, _ = _twisting(dr, radius, G, nu)
        beta, _, _ = _leaning(dr, radius, nu)
        t1, t2 = s1 + beta * lean1, s2 + beta * lean2
        return press + 0.5 * k_t * (t1 * t1 + t2 * t2) + 0.5 * K * psi * psi


def _pressing(d, radius, G, nu):
    """Energy of pressing alone, and its first and second derivative by d > 0."""
    b = (PRESSED + SQUEEZED * nu * nu) / radius
    U = 16.0 / 15.0 * G / (1.0 - nu) * sqrt(radius) * d * d * sqrt(d) * exp(b * d)
    return U, U * (2.5 / d + b), U * (3.75 / (d * d) + 5.0 * b / d + b * b)


def _shearing(d, radius, G, nu):
    """k_t and its first and second derivative by d > 0."""
    R, disc, slices = radius - d, (2.0 - nu) / (8.0 * G * sqrt(radius * d)), 1.0 / (pi * G * radius**3)
    give = disc + slices * R * R
    give_rate = -0.5 * disc / d - 2.0 * slices * R
    give_bend = 0.75 * disc / (d * d) + 2.0 * slices
    k, k_rate = 1.0 / give, -give_rate / give**2
    k_bend = 2.0 * give_rate**2 / give**3 - give_bend / give**2
    thin = _THIN * radius
    x = d / thin
    left = exp(-x * x)
    g, g_rate, g_bend = 1.0 - left, 2.0 * x / thin * left, 2.0 / thin**2 * (1.0 - 2.0 * x * x) * left
    return k * g, k_rate * g + k * g_rate, k_bend * g + 2.0 * k_rate * g_rate + k * g_bend


def _twisting(d, radius, G, nu):
    """K_psi and its first and second derivative by d > 0."""
    rd = radius * d
    c = (TWISTED + SQUEEZED * nu * nu) / radius
    K = 16.0 / 3.0 * G * rd * sqrt(rd) * exp(c * d)
    slope = 1.5 / d + c
    return K, K * slope, K * (slope * slope - 1.5 / (d * d))


def _leaning(d, radius, nu):
    """beta and its first and second derivative by d > 0."""
    bend = (LEANING + LEANING_SQUEEZED * nu * nu * nu) / radius
    return bend * d * d, 2.0 * bend * d, 2.0 * bend
