"""A fingertip law as a function of its coefficients, at the settings of some measurements."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from softhand.errors import MeasurementError
from softhand.identification.measurements import Measurements
from softhand.identification.polar import polar_force
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.settings.wording import unit_of

_BAD = 1e30  # stands in for a force that is no number
_MOST_STARTS = 512
_STRAIGHT = 1e-9  # second differences below this share of the forces are rounding


@dataclass(frozen=True)
class Coefficient:
    """A field of a law that can be fitted.

    Attributes:
        name: of the field.
        default: of the field, None without one.
        lower: lowest value that the law takes.
        upper: highest.
        closed: whether it takes `lower` and `upper` themselves.
        unit: from the description of the field, "" if it says none.
    """

    name: str
    default: float | None
    lower: float
    upper: float
    closed: tuple[bool, bool]
    unit: str


def coefficients_of(law_class: type[Law]) -> list[Coefficient]:
    """The fields of a law that are numbers, without the radius."""
    found = []
    for name, field in law_class.model_fields.items():
        if name == "radius" or field.annotation is not float:
            continue
        limits = [(getattr(entry, sign, None), sign) for entry in field.metadata for sign in ("gt", "ge", "lt", "le")]
        lower = max((float(value) for value, sign in limits if value is not None and sign[0] == "g"), default=-math.inf)
        upper = min((float(value) for value, sign in limits if value is not None and sign[0] == "l"), default=math.inf)
        default = None if field.is_required() else float(field.default)
        signs = [sign for value, sign in limits if value is not None]
        closed = ("gt" not in signs, "lt" not in signs)
        found.append(Coefficient(name, default, lower, upper, closed, unit_of(field.description)))
    return found


class Model:
    """Forces of a law at the settings of some measurements, as a function of the coefficients that are fitted.

    Attributes:
        law_class: the law.
        radius: of the tip [m].
        fixed: fields that are not fitted, by name.
        free: those that are.
        measured: measured numbers, one after the other, shape (m,).
        component: 0 to 3 for Fr, Ftheta, Fphi, Fpsi of each of them, shape (m,).
        linear: which of `free` the forces are affine in, all together, shape (p,).

    Raises:
        MeasurementError: a fixed field is none of the law, or a field that cannot be fitted has no value.
    """

    def __init__(
        self, measurements: Measurements, law_class: type[Law], radius: float, fixed: Mapping[str, float] | None = None
    ) -> None:
        self.law_class, self.radius, self.fixed = law_class, radius, dict(fixed or {})
        fields = law_class.model_fields
        known = coefficients_of(law_class)
        for name in self.fixed:
            if name not in fields or name == "radius":
                names = ", ".join(coefficient.name for coefficient in known)
                raise MeasurementError(
                    f'{law_class.__name__} has no coefficient "{name}"; it has {names}.', column=name, value=name
                )
        for name, field in fields.items():
            if name != "radius" and field.annotation is not float and name not in self.fixed:
                if field.is_required():
                    raise MeasurementError(
                        f'{law_class.__name__}: "{name}" is not a number to be fitted; fix its value.',
                        column=name, value=None,
                    )  # fmt: skip
                self.fixed[name] = field.default
        self.free = [coefficient for coefficient in known if coefficient.name not in self.fixed]
        imposed = np.column_stack([measurements.deformation, measurements.phi])
        self._settings, number = np.unique(imposed, axis=0, return_inverse=True)
        row, self.component = np.nonzero(np.isfinite(measurements.force))
        self._row = number.ravel()[row]
        self.measured = measurements.force[row, self.component]
        self.lower = np.array([coefficient.lower for coefficient in self.free])
        self.upper = np.array([coefficient.upper for coefficient in self.free])
        self.linear = self._find_linear()
        self._slope: Array | None = None

    def forces(self, values: Array) -> Array:
        """Forces of the law where they were measured, shape (m,)."""
        return self.at(values, self._settings)[self._row, self.component]

    def at(self, values: Array, settings: Array) -> Array:
        """Forces of the law.

        Args:
            values: of the free coefficients, shape (p,).
            settings: dr, dtheta, dphi, dpsi, phi, shape (n, 5).

        Returns:
            Fr [N], Ftheta, Fphi, Fpsi [N m]; huge where the law gives no number, shape (n, 4).
        """
        by_name = {**self.fixed, **dict(zip((c.name for c in self.free), map(float, values), strict=True))}
        arguments = [self.radius, *(float(by_name[name]) for name in self.law_class.model_fields if name != "radius")]
        result = np.empty((len(settings), 4))
        for k, setting in enumerate(settings.tolist()):
            try:
                result[k] = polar_force(self.law_class, arguments, setting)
            except (ArithmeticError, ValueError):  # outside of what the formula can take
                result[k] = math.nan
        return np.where(np.isfinite(result), result, _BAD)

    def slope(self, values: Array) -> Array:
        """Derivatives of `forces`, exact for linear coefficients, else by central differences, shape (m, p)."""
        if self._slope is not None:
            return self._slope
        columns = []
        for k, value in enumerate(values):
            size = max(abs(value), 1e-6)
            step = size if self.linear[k] else 6e-6 * size
            upper, lower = values.copy(), values.copy()
            upper[k] += step
            lower[k] -= 0.0 if self.linear[k] else step
            columns.append((self.forces(upper) - self.forces(lower)) / (upper[k] - lower[k]))
        slope = np.column_stack(columns) if columns else np.zeros((len(self.measured), 0))
        if self.linear.all():
            self._slope = slope  # the same for all values
        return slope

    def starts(self) -> list[Array]:
        """Values to begin from: defaults where there are some, else a net; linear coefficients are 1."""
        nets = [
            [1.0] if is_linear else _net(coefficient)
            for coefficient, is_linear in zip(self.free, self.linear, strict=True)
        ]
        points = [np.array(point) for point in product(*nets)]
        if len(points) > _MOST_STARTS:
            chosen = np.random.default_rng(0).choice(len(points), _MOST_STARTS, replace=False)
            points = [points[k] for k in chosen]
        return points

    def _find_linear(self) -> NDArray[np.bool_]:
        """Coefficients in which the forces are affine together: second differences vanish wherever one looks."""
        linear = np.zeros(len(self.free), dtype=bool)
        for k in range(len(self.free)):
            linear[k] = all(self._is_straight(base, k, linear) for base in self._bases())
        return linear

    def _bases(self) -> list[Array]:
        """Values near 1, and some from all over the limits."""
        rng = np.random.default_rng(0)
        nets = [_net(coefficient) for coefficient in self.free]
        middle = np.array([min(net, key=lambda value: abs(value - 1.0)) for net in nets])
        return [middle, 2.0 * middle, *(np.array([rng.choice(net) for net in nets]) for _ in range(4))]

    def _is_straight(self, base: Array, k: int, linear: NDArray[np.bool_]) -> bool:
        moves = np.diag(0.5 * np.abs(base))
        at_base, moved = self.forces(base), self.forces(base + moves[k])
        size = max(float(np.max(np.abs(values), initial=0.0)) for values in (at_base, moved))
        for other in [*moves[linear], moves[k]]:
            bend = self.forces(base + moves[k] + other) - moved - self.forces(base + other) + at_base
            if np.max(np.abs(bend), initial=0.0) > _STRAIGHT * size:
                return False
        return True


def _net(coefficient: Coefficient) -> list[float]:
    lower, upper, default = coefficient.lower, coefficient.upper, coefficient.default
    if default is not None and lower < default < upper and default != 0.0:
        return [default, *(value for share in (0.3, 3.0) if lower < (value := share * default) < upper)]
    if math.isfinite(lower) and math.isfinite(upper):
        return [lower + share * (upper - lower) for share in (0.1, 0.37, 0.63, 0.9)]
    powers = [10.0**power for power in range(-6, 10)]
    if math.isfinite(lower):
        return [lower + value for value in powers]
    if math.isfinite(upper):
        return [upper - value for value in powers]
    return [*powers, *(-value for value in powers)]
