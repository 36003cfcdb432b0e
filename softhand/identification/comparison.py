"""Which law explains the measurements: errors at settings that a law was not fitted to."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from softhand.errors import LawError, MeasurementError
from softhand.identification.fitting.settling import settle
from softhand.identification.record import Measurements
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record

FOLDS = 5
_APART = 2.0  # standard errors of the difference from which two laws count as different


@dataclass(frozen=True, eq=False)
class Score(Record):
    """How well a law foretells what it was not fitted to.

    Attributes:
        name: of the law.
        fitted: number of coefficients fitted to all data.
        error: root mean square of the held-out errors of each component [N, N m], NaN where none was measured,
            shape (4,).
        total: root of the mean over the measured components of (error / root mean square of the measured values)^2:
            0 for a perfect law, 1 for one that always says zero.
        squares: mean of the squared shares of each fold, what `total` is the root of the mean of, shape (folds,).
        failure: why the law could not be fitted; "" if it could.
        is_best: whether no law is clearly better.
    """

    units: ClassVar = {"fitted": "1", "error": "N, N m, N m, N m", "total": "1"}
    unreported: ClassVar = frozenset({"squares"})

    name: str
    fitted: int
    error: Array
    total: float
    squares: Array
    failure: str = ""
    is_best: bool = False


def compare_laws(
    measurements: Measurements,
    laws: Mapping[str, type[Law]],
    radius: float,
    fixed: Mapping[str, Mapping[str, float]] | None = None,
    folds: int = FOLDS,
    progress: Callable[[float], None] | None = None,
) -> list[Score]:
    """Cross-validate laws against each other, the best first.

    The settings (not the rows: repeats of one setting stay together) are dealt into folds by a seeded shuffle; each
    law is fitted without one fold and tested on it. A law is marked as best unless the mean of the difference of its
    squared errors to those of the first, fold by fold, is above twice its standard error.

    Args:
        measurements: with at least as many settings as folds.
        laws: classes by name.
        radius: of the tip [m].
        fixed: coefficients of a law that are not fitted, by the name of the law.
        folds: number of parts.
        progress: called with the number of laws done, a fraction for the one going on.

    Raises:
        MeasurementError: fewer settings than folds.
    """
    parts = _deal(measurements, folds)
    scores = []
    for done, (name, law_class) in enumerate(laws.items()):
        report = None if progress is None else _part(progress, done, folds)
        scores.append(_score(measurements, name, law_class, radius, (fixed or {}).get(name, {}), parts, report))
    scores.sort(key=lambda score: score.total)
    return [_marked(score, scores[0]) for score in scores]


def _part(progress: Callable[[float], None], done: int, folds: int) -> Callable[[int], None]:
    return lambda fold: progress(done + fold / folds)


def _deal(measurements: Measurements, folds: int) -> NDArray[np.int64]:
    """Fold of each row: the settings of each measured component are spread evenly, shape (n,)."""
    settings = measurements.settings
    count = int(settings.max(initial=-1)) + 1
    if count < folds:
        raise MeasurementError(
            f"{count} different settings are too few to compare laws by {folds} folds; measure more settings.",
            column="", value=count,
        )  # fmt: skip
    order = np.random.default_rng(0).permutation(count)
    kind = np.zeros(count, dtype=np.int64)  # which components were measured at a setting
    np.bitwise_or.at(kind, settings, np.isfinite(measurements.force) @ np.array([1, 2, 4, 8]))
    order = order[np.argsort(kind[order], kind="stable")]
    fold = np.empty(count, dtype=np.int64)
    fold[order] = np.arange(count) % folds
    return fold[settings]


def _score(
    measurements: Measurements,
    name: str,
    law_class: type[Law],
    radius: float,
    fixed: Mapping[str, float],
    parts: NDArray[np.int64],
    report: Callable[[int], None] | None,
) -> Score:
    folds = int(parts.max()) + 1
    held_out = np.full_like(measurements.force, np.nan)
    there = np.isfinite(measurements.force)
    size = _rms(measurements.force, there)
    try:
        whole = settle(measurements, law_class, radius, fixed)
        fitted = len(whole.solution.model.free) - len(whole.lost)
        for fold in range(folds):
            out = parts == fold
            found = settle(measurements.select(~out), law_class, radius, fixed).solution
            held_out[out] = measurements.force[out] - found.model.at(found.values, measurements.imposed[out])
            if report is not None:
                report(fold + 1)
    except (MeasurementError, LawError) as error:
        nothing = np.full(4, np.nan)
        return Score(name, 0, nothing, math.inf, np.full(folds, math.inf), str(error))
    share = (held_out / size) ** 2
    measured = there.any(axis=0)
    weight = np.where(there, 1.0 / (measured.sum() * np.maximum(there.sum(axis=0), 1)), 0.0)
    squares = np.array([np.nansum((weight * share)[parts == fold]) for fold in range(folds)])
    return Score(name, fitted, _rms(held_out, there), math.sqrt(squares.sum()), folds * squares)


def _rms(values: Array, there: NDArray[np.bool_]) -> Array:
    """Root mean square of each column where it is there; NaN where it is not, shape (4,)."""
    squares = np.where(there, values, 0.0) ** 2
    count = there.sum(axis=0)
    return np.where(count > 0, np.sqrt(squares.sum(axis=0) / np.maximum(count, 1)), np.nan)


def _marked(score: Score, best: Score) -> Score:
    if score.failure:
        return score
    difference = score.squares - best.squares
    doubt = float(np.std(difference, ddof=1)) / math.sqrt(len(difference)) if len(difference) > 1 else 0.0
    is_best = score is best or float(np.mean(difference)) <= _APART * doubt
    return replace(score, is_best=is_best)
