"""A soft finger as a whole: one stiffness along its axis, another across."""

from __future__ import annotations

from math import sqrt

from softhand.laws.law import Law
from softhand.settings.settings import NonNegative, Positive


class Bulk(Law):
    """Bulk stiffness of a soft finger, linear, in the manner of Jang et al. [U]; slip by the whole force alone.

        U = (1/2) u^T K u + (1/2) k_torsional psi^2,   K = k_across I + (k_along - k_across) x_F x_F^T
        f = K u + ...,   u = (s1, s2, d) along x_C, y_C, z_C,   x_F = (lean1, lean2, sin Phi)

    What gives way is the finger behind the contact, not the patch: a finger that presses along its axis is stiff, one
    that is bent is soft, and where it leans a pressed finger pushes sideways, as in `parallel-distributed`. With
    `contact = "coulomb"` it slips by the ratio of the whole tangential to the whole normal force, as Jang, Petrichenko,
    Bae and Haninger, arXiv 2310.04846, find it for soft fingers. Their finding is planar; the stiffness in space as one
    matrix is ours, and so are the torsion spring and the moment, by which a finger resists being leant. A force along
    the normal that pulls, under much shear against the lean, ends a run.
    The default k_along gives the reference tip's force at d = 2.3 mm.
    """

    coordinates = "surface"
    deepest = 0.4
    Phi_range = (45.0, 90.0)

    k_along: Positive = 2724.0
    """Stiffness along the axis of the finger [N/m]."""
    k_across: Positive = 1800.0
    """Stiffness across it [N/m]."""
    k_torsional: NonNegative = 0.025
    """Torsional stiffness about the normal of the contact [N m/rad]."""

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius, k_along, k_across, k_torsional):
        """(f_n, f_1, f_2, tau); see the class."""
        if dr <= 0.0:
            return 0.0, 0.0, 0.0, 0.0
        upright = sqrt(1.0 - lean1 * lean1 - lean2 * lean2)
        along = (k_along - k_across) * (s1 * lean1 + s2 * lean2 + dr * upright)
        return (
            k_across * dr + along * upright,
            k_across * s1 + along * lean1,
            k_across * s2 + along * lean2,
            k_torsional * psi,
        )

    @staticmethod
    def stiffness(dr, s1, s2, psi, lean1, lean2, radius, k_along, k_across, k_torsional):
        """K in the order of the deformation, row by row."""
        # fmt: off
        if dr <= 0.0:
            return (
                0.0, 0.0, 0.0, 0.0,
                0.0, 0.0, 0.0, 0.0,
                0.0, 0.0, 0.0, 0.0,
                0.0, 0.0, 0.0, 0.0,
            )
        upright = sqrt(1.0 - lean1 * lean1 - lean2 * lean2)
        more = k_along - k_across
        return (
            k_across + more * upright * upright, more * upright * lean1, more * upright * lean2, 0.0,
            more * upright * lean1, k_across + more * lean1 * lean1, more * lean1 * lean2, 0.0,
            more * upright * lean2, more * lean1 * lean2, k_across + more * lean2 * lean2, 0.0,
            0.0, 0.0, 0.0, k_torsional,
        )
        # fmt: on

    @staticmethod
    def energy(dr, s1, s2, psi, lean1, lean2, radius, k_along, k_across, k_torsional):
        """U [J]."""
        if dr <= 0.0:
            return 0.0
        upright = sqrt(1.0 - lean1 * lean1 - lean2 * lean2)
        along = s1 * lean1 + s2 * lean2 + dr * upright
        linear = k_across * (dr * dr + s1 * s1 + s2 * s2) + (k_along - k_across) * along * along
        return 0.5 * linear + 0.5 * k_torsional * psi * psi

    @staticmethod
    def moment(dr, s1, s2, psi, lean1, lean2, radius, k_along, k_across, k_torsional):
        """(m_1, m_2) [N m]: the slope of U as the finger is leant."""
        if dr <= 0.0:
            return 0.0, 0.0
        upright = sqrt(1.0 - lean1 * lean1 - lean2 * lean2)
        along = (k_along - k_across) * (s1 * lean1 + s2 * lean2 + dr * upright)
        return -along * (s2 * upright - dr * lean2), along * (s1 * upright - dr * lean1)
