"""Coefficients of a fingertip law by least squares, with intervals and with what the data cannot tell."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from softhand.errors import MeasurementError
from softhand.identification.measurements import FORCE, Measurements
from softhand.identification.model import Coefficient, Model, coefficients_of
from softhand.laws.law import Law
from softhand.numerics.arrays import Array

_REWEIGHTINGS = 8
_POLISHED = 5  # of the starts
_SILENT = 1e-10  # a coefficient that moves the forces less than this share of them is not seen
_SINGULAR = 1e-7  # singular values of the scaled slope below this share of the largest count as zero
_SHARE = 0.05  # of a direction that the data do not see, from which a coefficient belongs to it
_NOISELESS = 1e-13  # residuals below this share of the forces are rounding


@dataclass(frozen=True)
class Estimate:
    """One coefficient.

    Attributes:
        coefficient: which, with its unit and limits.
        value: in SI; NaN if the data do not tell it.
        low: lower end of the confidence interval.
        high: upper end.
        note: why it is not told, or not well; "" if all is well.
        is_fitted: False for one that was fixed or left at its default.
    """

    coefficient: Coefficient
    value: float
    low: float
    high: float
    note: str = ""
    is_fitted: bool = True


@dataclass(frozen=True, eq=False)
class Fit:
    """A law fitted to measurements.

    Attributes:
        law_class: the law.
        radius: of the tip [m].
        estimates: of all coefficients of the law.
        level: of the confidence intervals, such as 0.95.
        measurements: what was fitted.
        predicted: forces of the fitted law at the measured settings, shape (n, 4).
        noise: standard deviation of the residuals of each component, NaN where none was measured, shape (4,).
        repeats: the same of repeated settings about their own means, NaN without repeats, shape (4,).
    """

    law_class: type[Law]
    radius: float
    estimates: tuple[Estimate, ...]
    level: float
    measurements: Measurements
    predicted: Array
    noise: Array
    repeats: Array
    _model: Model
    _values: Array

    @property
    def residual(self) -> Array:
        """Measured less predicted force, NaN where not measured, shape (n, 4)."""
        return self.measurements.force - self.predicted

    def estimate(self, name: str) -> Estimate:
        """The estimate of that name."""
        return next(estimate for estimate in self.estimates if estimate.coefficient.name == name)

    def law(self) -> Law:
        """The fitted law.

        Raises:
            MeasurementError: a coefficient is not told by the data.
        """
        lost = [estimate.coefficient.name for estimate in self.estimates if not math.isfinite(estimate.value)]
        if lost:
            raise MeasurementError(
                f"{self.law_class.__name__}: the data do not tell {', '.join(lost)}; fix or measure them.",
                column=lost[0], value=None,
            )  # fmt: skip
        values = {estimate.coefficient.name: estimate.value for estimate in self.estimates}
        return self.law_class(radius=self.radius, **values, **self.others())

    def others(self) -> dict[str, object]:
        """Fields of the law that are no numbers, with the values that were used."""
        known = {estimate.coefficient.name for estimate in self.estimates}
        return {name: value for name, value in self._model.fixed.items() if name not in known}

    def force(self, settings: Array) -> Array:
        """Forces of the fitted law, those too whose coefficients are not all told.

        Args:
            settings: dr, dtheta, dphi, dpsi, phi, shape (n, 5).

        Returns:
            Fr [N], Ftheta, Fphi, Fpsi [N m], shape (n, 4).
        """
        return self._model.at(self._values, settings)


def fit_law(
    measurements: Measurements,
    law_class: type[Law],
    radius: float,
    fixed: Mapping[str, float] | None = None,
    level: float = 0.95,
) -> Fit:
    """Fit the coefficients of a law.

    Minimises the weighted sum of J = sum {measured - law}^2 of each component of dF, [Nakashima] section 2.3 with J_r
    for Fr. A component weighs as the inverse square of the scatter of its own residuals, so that forces in N and
    moments in N m stand beside each other; a coefficient that acts on one component only gets the value of the paper's
    J. Where the law is linear in all coefficients this is one linear solve, else scipy's least_squares from several
    starts. Intervals are those of linearised least squares with Student's t. Where several components tell of one
    coefficient, the degrees of freedom are those of Welch and Satterthwaite, and the variance is raised for the weights
    being estimates themselves [P. Meier, Variance of a weighted mean, Biometrics 9, 1953].

    Args:
        measurements: at least as many numbers as coefficients.
        law_class: any law; each field that is a number is fitted, except the radius.
        radius: of the tip [m].
        fixed: values of fields that are not to be fitted.
        level: of the confidence intervals.

    Raises:
        MeasurementError: nothing to fit, too few numbers, or the best value lies outside of what the law allows.
    """
    model = Model(measurements, law_class, radius, fixed)
    if not model.free:
        raise MeasurementError(f"{law_class.__name__}: all is fixed, nothing is left to fit.", column="", value=None)
    weight, values = _fit_reweighted(model)
    lost = _not_told(model, values, weight)
    limited = _at_limits(model, values, lost)
    told = len(model.free) - len(lost)
    if len(model.measured) <= told:
        raise MeasurementError(
            f"{len(model.measured)} measured numbers cannot tell {told} coefficients of {law_class.__name__} and their "
            "intervals; give more rows.",
            column="", value=len(model.measured),
        )  # fmt: skip
    if limited:
        fit = fit_law(measurements, law_class, radius, {**(fixed or {}), **limited}, level)
        return _with_notes(fit, {name: f"held at {value:g}, a limit of the law" for name, value in limited.items()})
    if any(coefficient.default is not None for coefficient in lost):
        kept = {c.name: c.default for c in lost if c.default is not None}
        fit = fit_law(measurements, law_class, radius, {**(fixed or {}), **kept}, level)
        return _with_notes(
            fit,
            {coefficient.name: f"default; {note}" for coefficient, note in lost.items() if coefficient.name in kept},
        )
    low, high = _intervals(model, values, weight, level)
    estimates = tuple(
        _estimate(model, coefficient, values, low, high, lost) for coefficient in coefficients_of(law_class)
    )
    imposed = np.column_stack([measurements.deformation, measurements.phi])
    noise = np.full(4, np.nan)
    for component in np.unique(model.component):
        noise[component] = 1.0 / weight[component]
    return Fit(law_class, radius, estimates, level, measurements, model.at(values, imposed), noise,
               scatter_of_repeats(measurements), model, values)  # fmt: skip


def scatter_of_repeats(measurements: Measurements) -> Array:
    """Standard deviation of each component about the mean of its setting, pooled; NaN without repeats, shape (4,)."""
    result = np.full(4, np.nan)
    settings = measurements.settings
    for component, values in enumerate(measurements.force.T):
        there = np.isfinite(values)
        _, number, count = np.unique(settings[there], return_inverse=True, return_counts=True)
        if there.sum() > len(count):
            means = np.bincount(number, values[there]) / count
            result[component] = math.sqrt(np.sum((values[there] - means[number]) ** 2) / (there.sum() - len(count)))
    return result


def _fit_reweighted(model: Model) -> tuple[Array, Array]:
    """Weight of each component (one over the scatter of its residuals), shape (4,), and the values of the best fit."""
    size = np.array([np.sqrt(np.mean(model.measured[model.component == c] ** 2)) if c in model.component else np.nan
                     for c in range(4)])  # fmt: skip
    size = np.where(size > 0.0, size, 1.0)
    weight, values = 1.0 / size, None
    for _ in range(_REWEIGHTINGS):
        values = _solve(model, weight, values)
        scatter = np.maximum(_scatter(model, values, weight), _NOISELESS * size)
        settled = np.allclose(weight * scatter, 1.0, rtol=1e-10)
        weight = 1.0 / scatter
        if settled:
            break
    assert values is not None
    return weight, values


def _scatter(model: Model, values: Array, weight: Array) -> Array:
    """Standard deviation of the residuals of each component; its degrees of freedom by the trace of the hat matrix."""
    residual = model.measured - model.forces(values)
    freedom = _freedom(model, values, weight)
    return np.array([np.sqrt(np.sum(residual[model.component == c] ** 2) / freedom[c]) for c in range(4)])


def _freedom(model: Model, values: Array, weight: Array) -> Array:
    """Numbers of each component less the coefficients that they were spent on, shape (4,)."""
    A = weight[model.component, None] * model.slope(values)
    left, singular, _ = np.linalg.svd(A / _length(A), full_matrices=False)
    seen = left[:, singular > _SINGULAR * max(singular.max(initial=0.0), 1e-300)]
    spent = np.sum(seen**2, axis=1)
    return np.array([max(np.sum(1.0 - spent[model.component == c]), 1e-9) for c in range(4)])


def _length(A: Array) -> Array:
    length = np.linalg.norm(A, axis=0)
    return np.where(length > 0.0, length, 1.0)


def _solve(model: Model, weight: Array, start: Array | None) -> Array:
    """Values of the smallest weighted residual within the limits of the law."""
    if model.linear.all():
        return _solve_linear(model, weight, np.ones(len(model.free)))
    starts = model.starts() if start is None else [start]
    with_linear = [_solve_linear(model, weight, point) for point in starts]
    with_linear.sort(key=lambda point: _cost(model, weight, point))
    polished = [_polish(model, weight, point) for point in with_linear[:_POLISHED]]
    return min(polished, key=lambda point: _cost(model, weight, point))


def _cost(model: Model, weight: Array, values: Array) -> float:
    return float(np.sum((weight[model.component] * (model.measured - model.forces(values))) ** 2))


def _solve_linear(model: Model, weight: Array, point: Array) -> Array:
    """The linear coefficients of the smallest residual, the others as they are."""
    from scipy.optimize import lsq_linear

    values, linear = point.copy(), model.linear
    if not linear.any():
        return values
    values[linear] = 0.0
    w = weight[model.component]
    unit = point.copy()
    unit[linear] = 1.0
    A = w[:, None] * model.slope(unit)[:, linear]
    b = w * (model.measured - model.forces(values))
    scale = _length(A)
    solution = np.linalg.lstsq(A / scale, b, rcond=_SINGULAR)[0] / scale
    lower, upper = model.lower[linear], model.upper[linear]
    if np.any(solution < lower) or np.any(solution > upper):
        with np.errstate(invalid="ignore"):  # scipy multiplies infinite bounds by zero
            solution = lsq_linear(A / scale, b, (lower * scale, upper * scale), tol=1e-14).x / scale
    values[linear] = solution
    return values


def _polish(model: Model, weight: Array, point: Array) -> Array:
    """scipy's trust region over all coefficients, from a point."""
    from scipy.optimize import least_squares

    w = weight[model.component]
    span = np.where(np.isfinite(model.upper - model.lower), model.upper - model.lower, np.abs(point) + 1e-9)
    start = np.clip(point, model.lower + 1e-9 * span, model.upper - 1e-9 * span)
    found = least_squares(
        lambda values: w * (model.forces(values) - model.measured),
        start,
        lambda values: w[:, None] * model.slope(values),
        bounds=(model.lower, model.upper),
        x_scale="jac", ftol=1e-15, xtol=1e-15, gtol=1e-15, max_nfev=200,
    )  # fmt: skip
    return found.x


def _not_told(model: Model, values: Array, weight: Array) -> dict[Coefficient, str]:
    """Coefficients that the data do not tell, with the reason."""
    slope = model.slope(values)
    A = weight[model.component, None] * slope
    largest = np.max(np.abs(slope * values) / np.max(np.abs(model.measured), initial=1e-300), axis=0, initial=0.0)
    # a linear coefficient that is not seen leaves exact zeros, the differences of another one leave rounding
    silent = np.where(model.linear, ~slope.any(axis=0), largest <= _SILENT)
    lost = {
        coefficient: "not told: no measured number depends on it"
        for coefficient, is_silent in zip(model.free, silent, strict=True)
        if is_silent
    }
    heard = np.flatnonzero(~silent)
    if heard.size:
        _, singular, right = np.linalg.svd(A[:, heard] / _length(A[:, heard]), full_matrices=False)
        for direction in right[singular <= _SINGULAR * singular[0]]:
            together = [model.free[heard[k]] for k in np.flatnonzero(np.abs(direction) > _SHARE)]
            names = " and ".join(coefficient.name for coefficient in together)
            for coefficient in together:
                lost[coefficient] = f"not told: the data depend on {names} only together"
    return lost


def _at_limits(model: Model, values: Array, lost: Mapping[Coefficient, str]) -> dict[str, float]:
    """Coefficients whose best value is a limit that the law takes, with that limit; an error if it does not take it."""
    found = {}
    for coefficient, value in zip(model.free, values, strict=True):
        margin = 1e-6 * max(abs(value), 1e-12)
        for limit, is_at, is_closed in (
            (coefficient.lower, value <= coefficient.lower + margin, coefficient.closed[0]),
            (coefficient.upper, value >= coefficient.upper - margin, coefficient.closed[1]),
        ):
            if not is_at or coefficient in lost:
                continue
            if not is_closed:
                raise MeasurementError(
                    f"{model.law_class.__name__}: the best {coefficient.name} is {value:.6g}, outside of what the law "
                    f"allows ({coefficient.lower:g} to {coefficient.upper:g}). Either the law does not fit the data, "
                    f"or a sign is wrong: positive dr, dtheta, dphi, dpsi give positive {', '.join(FORCE)}.",
                    column=coefficient.name, value=float(value),
                )  # fmt: skip
            found[coefficient.name] = limit
    return found


def _intervals(model: Model, values: Array, weight: Array, level: float) -> tuple[Array, Array]:
    """Ends of the confidence intervals of the free coefficients, each of shape (p,)."""
    from scipy.special import stdtrit

    A = weight[model.component, None] * model.slope(values)
    scale = _length(A)
    gain = np.linalg.pinv(A / scale, rcond=_SINGULAR) / scale[:, None]  # d values / d weighted numbers
    parts = np.array([np.sum(gain[:, model.component == c] ** 2, axis=1) for c in range(4)])
    variance = parts.sum(axis=0)
    freedom = _freedom(model, values, weight)
    share = np.sum(parts**2 / freedom[:, None], axis=0)
    effective = np.where(share > 0.0, variance**2 / np.where(share > 0.0, share, 1.0), 1.0)
    told_by = parts / np.where(variance > 0.0, variance, 1.0)
    variance = variance * (1.0 + 4.0 * np.sum(told_by * (1.0 - told_by) / freedom[:, None], axis=0))  # [Meier]
    half = stdtrit(effective, 0.5 + 0.5 * level) * np.sqrt(variance)
    return values - half, values + half


def _estimate(
    model: Model, coefficient: Coefficient, values: Array, low: Array, high: Array, lost: Mapping[Coefficient, str]
) -> Estimate:
    if coefficient.name in model.fixed:
        value = float(model.fixed[coefficient.name])
        return Estimate(coefficient, value, math.nan, math.nan, "fixed", is_fitted=False)
    if coefficient in lost:
        return Estimate(coefficient, math.nan, math.nan, math.nan, lost[coefficient], is_fitted=False)
    k = model.free.index(coefficient)
    wide = high[k] - low[k] > 2.0 * abs(values[k])
    note = "badly told: the interval is wider than the value" if wide else ""
    return Estimate(coefficient, float(values[k]), float(low[k]), float(high[k]), note)


def _with_notes(fit: Fit, notes: Mapping[str, str]) -> Fit:
    """The fit with what happened to coefficients that were left at their defaults."""
    noted = (
        replace(estimate, note=notes[name]) if (name := estimate.coefficient.name) in notes else estimate
        for estimate in fit.estimates
    )
    return replace(fit, estimates=tuple(noted))
