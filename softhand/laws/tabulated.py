"""A law from a table of what was computed or measured: force, shear and torsion by the depth."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import exp

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from softhand.laws.law import Law
from softhand.laws.smooth_table import COEFFICIENTS, fit, spline, work
from softhand.settings.settings import Vector
from softhand.settings.wording import show

_CELLS = COEFFICIENTS - 3
_DEEPEST = 0.95  # dr / r


class Tabulated(Law):
    """A table of a tip: normal force, shear stiffness and torsion stiffness by the depth, as the slope of one energy.

        U = int F dd + (1/2) k_t(d) |s|^2 + (1/2) K_psi(d) psi^2
        f_n = F + (1/2) k_t' |s|^2 + (1/2) K_psi' psi^2,   f_t = k_t s,   tau = K_psi psi

    F, k_t and K_psi are cubic splines through the columns, twice differentiable, 0 at d = 0; F grows as its column
    does. Beyond the last depth F goes on straight, and the stiffnesses at their relative rate. `softhand material`
    makes such tables by finite elements and from files. The default is a tip of r = 10 mm, G = 59.7 kPa, nu = 0.5 by
    finite elements, which has the reference tip's force at d = 2.3 mm.
    """

    coordinates = "surface"

    depths: Vector = (0.0005, 0.001, 0.0015, 0.002, 0.0025, 0.003, 0.0035, 0.004)
    """Depths of the rows [m], growing."""
    normal: Vector = (0.4243, 1.339, 2.738, 4.724, 7.463, 11.2, 16.24, 22.94)
    """Normal force F without shear and torsion at these [N], growing."""
    shear: Vector = (497.9, 684.0, 820.7, 946.5, 1054.0, 1141.0, 1189.0, 1168.0)
    """Tangential stiffness k_t at these [N/m]."""
    torsion: Vector = (0.00361, 0.01059, 0.01916, 0.03016, 0.04331, 0.05887, 0.0767, 0.0957)
    """Torsional stiffness K_psi at these [N m/rad]."""

    @model_validator(mode="after")
    def _be_a_table(self) -> Tabulated:
        for name in ("normal", "shear", "torsion"):
            if len(getattr(self, name)) != len(self.depths):
                raise ValueError(
                    f"{name} has {len(getattr(self, name))} rows and depths has {len(self.depths)}; give one for each."
                )
        if len(self.depths) < 3:
            raise ValueError(f"depths = {show(self.depths)} are {len(self.depths)} rows; a table needs 3 or more.")
        if self.depths[0] < 0.0 or self.depths[-1] > _DEEPEST * self.radius:
            raise ValueError(
                f"depths go from {self.depths[0]:g} to {self.depths[-1]:g} m; they must be within 0 and "
                f"{_DEEPEST:g} of the radius, {self.radius:g} m."
            )
        for name, unit in (("depths", "m"), ("normal", "N")):
            _check_growth(name, unit, getattr(self, name), self.depths)
        for name, unit in (("normal", "N"), ("shear", "N/m"), ("torsion", "N m/rad")):
            _check_sign(name, unit, getattr(self, name), self.depths)
        return self

    def parameters(self) -> NDArray[np.float64]:
        """Radius, last depth, and the coefficients of the three curves."""
        curves = [
            fit(self.depths, values, name == "normal")
            for name, values in (("normal", self.normal), ("shear", self.shear), ("torsion", self.torsion))
        ]
        return np.array([self.radius, self.depths[-1], *(value for curve in curves for value in curve)])

    def stiffer(self, times: float) -> Tabulated:
        """The same rows, so many times as stiff."""
        columns = {
            name: tuple(times * value for value in getattr(self, name)) for name in ("normal", "shear", "torsion")
        }
        return self.model_copy(update=columns)

    @classmethod
    def parameter_names(cls) -> tuple[str, ...]:
        """Of what `parameters` gives."""
        curves = (f"{name}_{k}" for name in ("normal", "shear", "torsion") for k in range(COEFFICIENTS))
        return ("radius", "deepest", *curves)

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius, deepest, *curves):
        """(f_n, f_1, f_2, tau); see the class."""
        if dr <= 0.0:
            return 0.0, 0.0, 0.0, 0.0
        F, _ = _pressing(dr, deepest, curves)
        k_t, k_t_rate, _ = _stiffness(dr, deepest, curves, COEFFICIENTS)
        K, K_rate, _ = _stiffness(dr, deepest, curves, 2 * COEFFICIENTS)
        return F + 0.5 * k_t_rate * (s1 * s1 + s2 * s2) + 0.5 * K_rate * psi * psi, k_t * s1, k_t * s2, K * psi

    @staticmethod
    def stiffness(dr, s1, s2, psi, lean1, lean2, radius, deepest, *curves):
        """Second derivatives of the energy, row by row."""
        # fmt: off
        if dr <= 0.0:
            return (
                0.0, 0.0, 0.0, 0.0,
                0.0, 0.0, 0.0, 0.0,
                0.0, 0.0, 0.0, 0.0,
                0.0, 0.0, 0.0, 0.0,
            )
        _, F_rate = _pressing(dr, deepest, curves)
        k_t, k_t_rate, k_t_bend = _stiffness(dr, deepest, curves, COEFFICIENTS)
        K, K_rate, K_bend = _stiffness(dr, deepest, curves, 2 * COEFFICIENTS)
        return (
            F_rate + 0.5 * k_t_bend * (s1 * s1 + s2 * s2) + 0.5 * K_bend * psi * psi,
            k_t_rate * s1, k_t_rate * s2, K_rate * psi,
            k_t_rate * s1, k_t, 0.0, 0.0,
            k_t_rate * s2, 0.0, k_t, 0.0,
            K_rate * psi, 0.0, 0.0, K,
        )
        # fmt: on

    @staticmethod
    def energy(dr, s1, s2, psi, lean1, lean2, radius, deepest, *curves):
        """U [J]."""
        if dr <= 0.0:
            return 0.0
        size, beyond = deepest / _CELLS, max(dr - deepest, 0.0)
        x = min(dr, deepest) / size
        pressed = 0.0
        for cell in range(min(int(x), _CELLS - 1) + 1):
            t = min(x - cell, 1.0)
            pressed += size * work(t, curves[cell], curves[cell + 1], curves[cell + 2], curves[cell + 3])
        if beyond > 0.0:
            F, F_rate = _pressing(deepest, deepest, curves)
            pressed += F * beyond + 0.5 * F_rate * beyond * beyond
        k_t, _, _ = _stiffness(dr, deepest, curves, COEFFICIENTS)
        K, _, _ = _stiffness(dr, deepest, curves, 2 * COEFFICIENTS)
        return pressed + 0.5 * k_t * (s1 * s1 + s2 * s2) + 0.5 * K * psi * psi


def _along(d, deepest, curves, first):
    """A curve and its first and second derivative within the table."""
    x = d / deepest * _CELLS
    cell = min(int(x), _CELLS - 1)
    k = first + cell
    value, slope, bend = spline(x - cell, curves[k], curves[k + 1], curves[k + 2], curves[k + 3])
    per = _CELLS / deepest
    return value, slope * per, bend * per * per


def _pressing(d, deepest, curves):
    """F and its slope; beyond the table it goes on straight."""
    F, rate, _ = _along(min(d, deepest), deepest, curves, 0)
    return F + rate * max(d - deepest, 0.0), rate


def _stiffness(d, deepest, curves, first):
    """A stiffness and its first and second derivative; beyond the table it goes on at its relative rate."""
    value, rate, bend = _along(min(d, deepest), deepest, curves, first)
    if d > deepest:
        share = rate / value
        value *= exp(share * (d - deepest))
        rate, bend = share * value, share * share * value
    return value, rate, bend


def _check_growth(name: str, unit: str, values: Sequence[float], depths: Sequence[float]) -> None:
    for row, (one, other) in enumerate(pairwise(values)):
        if not other > one:
            raise ValueError(
                f"{name} does not grow from row {row + 1} to row {row + 2}: {one:g}, {other:g} {unit}; "
                + ("give the rows in the order of their depths, each once." if name == "depths" else
                   f"a tip that is pressed deeper, {depths[row]:g} to {depths[row + 1]:g} m, answers with more force; "
                   "leave out or mend the row.")
            )  # fmt: skip


def _check_sign(name: str, unit: str, values: Sequence[float], depths: Sequence[float]) -> None:
    for row, (depth, value) in enumerate(zip(depths, values, strict=True)):
        if depth > 0.0 and not value > 0.0:
            raise ValueError(f"{name} is {value:g} {unit} in row {row + 1}; where the tip is pressed it must be > 0.")
        if depth == 0.0 and value != 0.0:
            raise ValueError(f"{name} is {value:g} {unit} at depth 0; a tip that is not pressed answers with 0.")
