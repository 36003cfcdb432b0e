"""The values of the smallest weighted sum of squares, within the limits of the law."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softhand.identification.fitting.model import Model
from softhand.identification.fitting.starts import find_starts
from softhand.numerics.arrays import Array

SINGULAR = 1e-7
"""Singular values of the scaled slope below this share of the largest count as zero."""

PRECISE, QUICK = 1e-15, 1e-8
"""Tolerances: to the rounding; and far below any interval."""

ENOUGH = 0.5
"""Numbers to spare that tell the scatter of a component."""

_REWEIGHTINGS = 8
_SETTLED = 1e-6  # change of the weights, as a share, at which they are taken
_FEW = 200  # numbers of a component, among which it is found where to begin
_STEPS = 200  # of a solver
_POLISHED = 5  # of the starts
_NOISELESS = 1e-13  # residuals below this share of the forces are rounding


@dataclass(frozen=True, eq=False)
class Solution:
    """Values of the smallest sum of squares.

    Attributes:
        model: whose coefficients they are.
        linear: which coefficients the forces are affine in, shape (p,).
        values: of the free coefficients, shape (p,).
        weight: of each measured number, one over its standard deviation, shape (m,).
        slope: derivatives of the forces, shape (m, p).
        freedom: numbers of each component less the coefficients that they were spent on, shape (4,).
    """

    model: Model
    linear: NDArray[np.bool_]
    values: Array
    weight: Array
    slope: Array
    freedom: Array

    @property
    def noise(self) -> Array:
        """Standard deviation of the residuals of each component, NaN where none was measured, shape (4,)."""
        squares = (self.model.measured - self.model.forces(self.values)) ** 2
        there = np.isin(np.arange(4), self.model.component) & (self.freedom >= ENOUGH)
        scatter = np.sqrt(np.bincount(self.model.component, squares, 4) / np.where(there, self.freedom, 1.0))
        return np.where(there, scatter, np.nan)

    @property
    def residual(self) -> Array:
        """Measured less fitted numbers over their standard deviations, shape (m,)."""
        return self.weight * (self.model.measured - self.model.forces(self.values))

    @property
    def weighted_slope(self) -> Array:
        """`slope` over the standard deviations of the numbers, shape (m, p)."""
        return self.weight[:, None] * self.slope


def solve(
    model: Model,
    linear: NDArray[np.bool_],
    spread: Array | None = None,
    start: Array | None = None,
    tolerance: float = PRECISE,
) -> Solution:
    """Fit, with the weights that the residuals ask for.

    A component weighs as the inverse square of the scatter of its own residuals, so that forces in N and moments in
    N m stand beside each other; a coefficient that acts on one component only has the value of the paper's J.

    Args:
        model: what is fitted.
        linear: coefficients in which its forces are affine, see `find_linear`, shape (p,).
        spread: standard deviation of each number beside others of its component; all alike if None, shape (m,).
        start: values to begin from; a net of them if None, shape (p,).
        tolerance: of the values, as a share, where the law is not linear.
    """
    spread = np.ones(len(model.measured)) if spread is None else spread
    there = np.isin(np.arange(4), model.component)
    size = np.array([np.sqrt(np.mean((model.measured / spread)[model.component == c] ** 2)) if there[c] else 1.0
                     for c in range(4)])  # fmt: skip
    scatter = size = np.where(size > 0.0, size, 1.0)
    begin = start
    for _ in range(_REWEIGHTINGS):
        weight = 1.0 / (scatter[model.component] * spread)
        begin = values = _minimise(model, linear, weight, begin, tolerance)
        slope = model.slope(values, linear)
        freedom = _freedom(model, weight[:, None] * slope)
        squares = _by_component(model, ((model.measured - model.forces(values)) / spread) ** 2)
        before, scatter = scatter, np.maximum(_scatter(squares, freedom, size), _NOISELESS * size)
        if np.allclose(before[there], scatter[there], rtol=max(_SETTLED, np.sqrt(tolerance))):
            break
    return Solution(model, linear, values, 1.0 / (scatter[model.component] * spread), slope, freedom)


def stay(model: Model, linear: NDArray[np.bool_], values: Array, weight: Array) -> Solution:
    """Values and weights as they are, made a solution of a model."""
    slope = model.slope(values, linear)
    return Solution(model, linear, values, weight, slope, _freedom(model, weight[:, None] * slope))


def _scatter(squares: Array, freedom: Array, size: Array) -> Array:
    """Standard deviation of each component; of one with no number to spare, that of the others beside their forces."""
    common = size * np.sqrt(np.sum(squares / size**2) / max(float(np.sum(freedom)), 1e-9))
    return np.where(freedom >= ENOUGH, np.sqrt(squares / np.maximum(freedom, ENOUGH)), common)


def _by_component(model: Model, values: Array) -> Array:
    """Sums over the numbers of each component, shape (4,)."""
    return np.bincount(model.component, values, 4).astype(float)


def scaled(slope: Array) -> tuple[Array, Array]:
    """Columns of length 1, and their lengths before; a column of zeros stays."""
    length = np.linalg.norm(slope, axis=0)
    length = np.where(length > 0.0, length, 1.0)
    return slope / length, length


def span(columns: Array) -> Array:
    """An orthonormal base of the space of the columns, shape (m, rank)."""
    if not columns.shape[1]:
        return columns
    left, singular, _ = np.linalg.svd(scaled(columns)[0], full_matrices=False)
    return left[:, singular > SINGULAR * max(singular.max(initial=0.0), 1e-300)]


def _freedom(model: Model, weighted_slope: Array) -> Array:
    spent = np.sum(span(weighted_slope) ** 2, axis=1)
    return _by_component(model, 1.0 - spent)


def _minimise(model: Model, linear: NDArray[np.bool_], weight: Array, start: Array | None, tolerance: float) -> Array:
    if linear.all():
        return _solve_linear(model, linear, weight, np.ones(len(model.free)))

    def cost(point: Array) -> float:
        return float(np.sum((weight * (model.measured - model.forces(point))) ** 2))

    if start is not None:
        return _polish(model, linear, weight, start, tolerance)
    few = model.thinned(_FEW)
    if len(few.measured) < len(model.measured):
        point = _minimise(few, linear, weight[few.number], None, tolerance)
        return _polish(model, linear, weight, point, tolerance)
    begun = [_solve_linear(model, linear, weight, point) for point in find_starts(model, linear)]
    begun.sort(key=cost)
    return min((_polish(model, linear, weight, point, tolerance) for point in begun[:_POLISHED]), key=cost)


def _solve_linear(model: Model, linear: NDArray[np.bool_], weight: Array, point: Array) -> Array:
    """The linear coefficients of the smallest residual, the others as they are."""
    from scipy.optimize import lsq_linear

    values = point.copy()
    if not linear.any():
        return values
    unit = point.copy()
    values[linear], unit[linear] = 0.0, 1.0
    still = model.forces(values)
    A, scale = scaled(weight[:, None] * model.slope(unit, linear)[:, linear])
    b = weight * (model.measured - still)
    solution = np.linalg.lstsq(A, b, rcond=SINGULAR)[0] / scale
    lower, upper = model.lower[linear], model.upper[linear]
    if np.any(solution < lower) or np.any(solution > upper):
        with np.errstate(invalid="ignore"):  # scipy multiplies infinite bounds by zero
            found = lsq_linear(A, b, (lower * scale, upper * scale), tol=1e-14)
        solution = found.x / scale
        solution = np.where(found.active_mask < 0, lower, np.where(found.active_mask > 0, upper, solution))
    values[linear] = solution
    return values


def _polish(model: Model, linear: NDArray[np.bool_], weight: Array, point: Array, tolerance: float) -> Array:
    """scipy's trust region over all coefficients, from a point."""
    from scipy.optimize import least_squares

    width = model.upper - model.lower
    width = np.where(np.isfinite(width), width, np.abs(point) + 1e-9)
    start = np.clip(point, model.lower + 1e-9 * width, model.upper - 1e-9 * width)
    with np.errstate(over="ignore"):  # a step may go far before it is taken back
        found = least_squares(
            lambda values: weight * (model.forces(values) - model.measured),
            start,
            lambda values: weight[:, None] * model.slope(values, linear),
            bounds=(model.lower, model.upper),
            x_scale="jac", ftol=tolerance, xtol=tolerance, gtol=tolerance, max_nfev=_STEPS,
        )  # fmt: skip
    return found.x
