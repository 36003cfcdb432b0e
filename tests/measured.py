"""Experiments on fingertips whose law is known: exact forces, and errors of every kind that a laboratory makes."""

from __future__ import annotations

import importlib.util
from itertools import product
from math import sqrt

import numpy as np
from hands import REPOSITORY

from softhand.identification.measurements import Measurements
from softhand.identification.polar import polar_force
from softhand.laws.law import Law
from softhand.settings.settings import Positive

RADIUS = 0.010  # [m]
OFFSET = 5e-5  # [m]

ALL = [(c, phi, dr, turn) for c, phi, dr, turn in product(range(4), (80, 55), (1.5, 3.0), (6.0, -15.0))]
"""Component, phi [deg], dr [mm], angle [deg]."""


class Exponent(Law):
    """A power of the compression, linear springs for the rest."""

    c: Positive
    zeta: Positive
    k: Positive

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius, c, zeta, k):
        """See the class."""
        return c * (max(dr, 0.0) / radius) ** zeta, k * dtheta, k * dphi, k * dpsi


class Sphere(Law):
    """Sphere on a plane: the same two coefficients in all directions."""

    E: Positive
    """Modulus of elasticity [N/m^2]."""
    nu: float = 0.5
    """Poisson's ratio [1]."""

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius, E, nu):
        """See the class."""
        depth = max(dr, 0.0)
        G, a = E / (2.0 * (1.0 + nu)), sqrt(radius * depth)
        tangential = 8.0 * a * G / (2.0 - nu) * radius**2
        normal = 4.0 / 3.0 * E / (1.0 - nu * nu) * sqrt(radius) * depth**1.5
        return normal, tangential * dtheta, tangential * dphi, 16.0 / 3.0 * G * a**3 * dpsi


class Pair(Law):
    """One coefficient in two components."""

    k: Positive

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius, k):
        """See the class."""
        return k * dr, k * radius**2 * dtheta, 0.0, 0.0


def measure(law: Law, settings, noise=(0, 0, 0, 0), rng=None) -> Measurements:
    """Forces of a law: (component, phi [deg], dr [mm], angle [deg]) a row; only that component is measured."""
    rows = np.zeros((len(settings), 6))
    for row, (component, phi, dr, turn) in zip(rows, settings, strict=True):
        row[:3] = component, np.radians(phi), 1e-3 * dr
        if component:
            row[2 + component] = np.radians(turn)
    values = exact(law, rows)
    if rng is not None:
        values = values + np.array(noise)[rows[:, 0].astype(int)] * rng.normal(size=len(rows))
    return measured(rows, values)


def exact(law: Law, rows, offset=0.0):
    """The measured component of a law at rows of component, phi, dr, dtheta, dphi, dpsi in SI, shape (n,)."""
    offset = np.broadcast_to(offset, len(rows))
    return np.array([
        polar_force(type(law), law.parameters().tolist(), (dr + more, dtheta, dphi, dpsi, phi))[int(c)]
        for (c, phi, dr, dtheta, dphi, dpsi), more in zip(rows.tolist(), offset, strict=True)
    ])  # fmt: skip


def measured(rows, values, **more) -> Measurements:
    """The values as measurements."""
    force = np.full((len(rows), 4), np.nan)
    force[np.arange(len(rows)), rows[:, 0].astype(int)] = values
    return Measurements(rows[:, 1], rows[:, 2:], force, RADIUS, **more)


def script():
    """scripts/make_identification_data.py as a module."""
    spec = importlib.util.spec_from_file_location("make", REPOSITORY / "scripts/make_identification_data.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Laboratory:
    """Settings like those of Figs. 9-12 of the paper, one row each, measured again and again.

    Attributes:
        rows: component, phi, dr, dtheta, dphi, dpsi of each, SI.
        series: of each row.
    """

    def __init__(self, law: Law, noise: float = 0.02) -> None:
        names = {"Fr": 0, "Ftheta": 1, "Fphi": 2, "Fpsi": 3}
        self.rows = np.array([
            (names[name], np.radians(phi), 1e-3 * dr, *np.radians(angles))
            for name, phi, dr, *angles in script().settings()
        ])  # fmt: skip
        component, phi, dr = self.rows[:, :3].T
        turned = (component == 3) & (np.abs(dr - 0.004) < 1e-9)  # the torsion is measured in two series
        self.series = np.unique(np.column_stack([component, phi, turned]), axis=0, return_inverse=True)[1].ravel()
        self.exact, self.displaced = exact(law, self.rows), exact(law, self.rows, OFFSET)
        size = [np.sqrt(np.mean(self.exact[component == c] ** 2)) for c in range(4)]
        self.deviation = noise * np.array(size)[component.astype(int)]

    def measure(self, kind: str, rng) -> Measurements:
        """One experiment.

        Args:
            kind: `constant` noise; `proportional`, of 5 % of the force; `offset`, dr 0.05 mm short; `gains`, each
                series with a gain of its own, of 5 %; `drift`, neighbours in a series that err alike.
            rng: where the errors come from.
        """
        values, noise = self.displaced if kind == "offset" else self.exact, rng.normal(size=len(self.rows))
        if kind == "gains":
            values = values * (1.0 + 0.05 * rng.normal(size=self.series.max() + 1))[self.series]
        if kind == "drift":
            for k in np.flatnonzero(self.series[1:] == self.series[:-1]) + 1:
                noise[k] = 0.7 * noise[k - 1] + sqrt(1.0 - 0.7**2) * noise[k]
        return measured(self.rows, values + noise * (0.05 * values if kind == "proportional" else self.deviation))
