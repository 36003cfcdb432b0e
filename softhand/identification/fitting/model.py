"""A fingertip law as a function of its coefficients, at the settings of some measurements."""

from __future__ import annotations

import math
from collections.abc import Mapping
from copy import copy
from functools import partial

import numpy as np
from numpy.typing import NDArray

from softhand.errors import LawError
from softhand.identification.fitting.coefficients import OFFSET, check_fixed, coefficients_of, offset_of
from softhand.identification.polar import polar_force
from softhand.identification.record import Measurements
from softhand.laws.first_call import check_formulas_end
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.settings.failures import failure

BAD = 1e30
"""Stands in for a force that is no number, or none of this world."""

_OUTSIDE = (ArithmeticError, ValueError, TypeError)  # of what a formula can take; a complex number is a TypeError
_KEPT = 64  # values whose forces are remembered; a solver asks for the same ones again
_STEP = 6e-6  # of central differences, the cube root of the rounding


def spread_over(count: int, most: int) -> NDArray[np.int64]:
    """At most so many of the numbers 0 to count - 1, evenly spread."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(np.int64))


class Model:
    """Forces of a law at the settings of some measurements, as a function of the coefficients that are fitted.

    Attributes:
        law_class: the law.
        radius: of the tip [m].
        fixed: fields that are not fitted, by name.
        free: those that are.
        settings: the different dr, dtheta, dphi, dpsi, phi, shape (k, 5).
        setting: of each measured number, shape (m,).
        component: 0 to 3 for Fr, Ftheta, Fphi, Fpsi of each of them, shape (m,).
        row: of the measurements of each of them, shape (m,).
        measured: the numbers, shape (m,).
        number: of each of them in the model that this one was thinned from, shape (m,).
        lower: limits of `free`, shape (p,).
        upper: likewise.

    Raises:
        MeasurementError: a fixed field is none of the law, or a field that cannot be fitted has no value.
        LawError: the formula does not give four numbers.
    """

    def __init__(
        self,
        measurements: Measurements,
        law_class: type[Law],
        radius: float,
        fixed: Mapping[str, object] | None = None,
        with_offset: bool = False,
    ) -> None:
        self.law_class, self.radius = law_class, radius
        self.fixed = check_fixed(law_class, fixed or {})
        self.free = [coefficient for coefficient in coefficients_of(law_class) if coefficient.name not in self.fixed]
        if with_offset:
            self.free.append(offset_of(radius))
        self.settings, number = np.unique(measurements.imposed, axis=0, return_inverse=True)
        self.row, self.component = np.nonzero(np.isfinite(measurements.force))
        self.setting = number.ravel()[self.row]
        self.measured = measurements.force[self.row, self.component]
        self.number = np.arange(len(self.measured))
        self.lower = np.array([coefficient.lower for coefficient in self.free])
        self.upper = np.array([coefficient.upper for coefficient in self.free])
        self._known: dict[bytes, Array] = {}
        self._try()

    def thinned(self, most: int) -> Model:
        """The same with at most so many numbers of each component, evenly spread."""
        some = np.sort(np.concatenate([
            numbers[spread_over(len(numbers), most)]
            for numbers in (np.flatnonzero(self.component == c) for c in np.unique(self.component))
        ]))  # fmt: skip
        other = copy(self)
        other.number = self.number[some]
        kept, other.setting = np.unique(self.setting[some], return_inverse=True)
        other.settings, other._known = self.settings[kept], {}
        other.row, other.component, other.measured = self.row[some], self.component[some], self.measured[some]
        return other

    def forces(self, values: Array) -> Array:
        """Forces of the law where they were measured, shape (m,)."""
        key = values.tobytes()
        if key not in self._known:
            if len(self._known) == _KEPT:
                self._known.clear()
            self._known[key] = self.at(values, self.settings)[self.setting, self.component]
        return self._known[key]

    def at(self, values: Array, settings: Array) -> Array:
        """Forces of the law.

        Args:
            values: of the free coefficients, shape (p,).
            settings: dr, dtheta, dphi, dpsi, phi as measured, shape (n, 5).

        Returns:
            Fr [N], Ftheta, Fphi, Fpsi [N m]; huge where the law gives no number, shape (n, 4).
        """
        by_name = {**self.fixed, **dict(zip((c.name for c in self.free), map(float, values), strict=True))}
        names = [name for name in self.law_class.model_fields if name != "radius"]
        arguments = [self.radius, *(float(by_name[name]) for name in names)]  # type: ignore[arg-type]
        imposed = (settings + float(by_name.get(OFFSET, 0.0)) * np.eye(5)[0]).tolist()  # type: ignore[arg-type]

        def force(setting: list[float]) -> tuple[float, ...]:
            try:
                return tuple(map(float, polar_force(self.law_class, arguments, setting)))
            except _OUTSIDE:
                return (math.nan,) * 4

        try:
            result = np.array([polar_force(self.law_class, arguments, setting) for setting in imposed], dtype=float)
        except _OUTSIDE:
            result = np.array([force(setting) for setting in imposed])
        return np.where(np.abs(result) < BAD, result, BAD)

    def slope(self, values: Array, linear: NDArray[np.bool_]) -> Array:
        """Derivatives of `forces`, exact for linear coefficients, else by central differences, shape (m, p).

        Args:
            values: of the free coefficients, shape (p,).
            linear: in which of them the forces are affine, shape (p,).
        """
        columns, here = [], self.forces(values)
        for k, value in enumerate(values):
            upper, lower = values.copy(), values.copy()
            if linear[k]:
                upper[k] += max(abs(value), 1e-6)
                columns.append((self.forces(upper) - here) / (upper[k] - value))
                continue
            step = _STEP * (self.radius if self.free[k].name == OFFSET else max(abs(value), 1e-6))
            upper[k] += step
            lower[k] -= step
            columns.append((self.forces(upper) - self.forces(lower)) / (upper[k] - lower[k]))
        return np.column_stack(columns) if columns else np.zeros((len(self.measured), 0))

    def _try(self) -> None:
        """The formula gives four numbers, or fails in a way that other coefficients can mend."""
        name, arguments = self.law_class.__name__, [self.radius, *(1.0 for _ in self.law_class.model_fields)][:-1]
        check_formulas_end(name, [partial(polar_force, self.law_class)], [(arguments, self.settings[0].tolist())])
        code = getattr(getattr(self.law_class, "force", None), "__code__", None)
        file, line = ("", 0) if code is None else (code.co_filename, code.co_firstlineno)
        where = f" ({file}, line {line})" if file else ""
        try:
            found = polar_force(self.law_class, arguments, self.settings[0].tolist())
        except (ArithmeticError, ValueError) as error:
            if "unpack" not in str(error):
                return
            message = f"law '{name}': its force must return four numbers: {error}{where}."
            raise LawError(message, law=name, file=file, line=line) from error
        except Exception as error:
            message = f"law '{name}': its force cannot be computed: {failure(error, file, line)}; mend the formula."
            raise LawError(message, law=name, file=file, line=line) from error
        if np.shape(found) != (4,) or not all(isinstance(number, int | float) for number in found):
            message = f"law '{name}': its force must return four numbers, got {found!r}"[:300] + f"{where}."
            raise LawError(message, law=name, file=file, line=line)
