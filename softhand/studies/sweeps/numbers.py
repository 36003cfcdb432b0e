"""The numbers of a run that a study asks for, from what was kept of it."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from softhand.analysis.performance import measure
from softhand.numerics.arrays import AnyArray, Array
from softhand.studies.outcome_settings import Outcome

_OF_FIGURES = (
    "object_position", "object_position_desired", "object_rpy", "object_rpy_desired", "internal_force",
    "internal_force_desired", "friction_use", "joint_torque",
)  # fmt: skip
"""Variables that `measure` reads."""

_OF: dict[str, Callable[..., Array]] = {
    "max": np.nanmax,
    "min": np.nanmin,
    "mean": np.nanmean,
    "norm": lambda rows, axis: np.sqrt(np.nansum(rows**2, axis=axis)),
}
_OVER: dict[str, Callable[[Array], Any]] = {
    "last": lambda values: values[-1],
    "first": lambda values: values[0],
    "max": np.nanmax,
    "min": np.nanmin,
    "mean": np.nanmean,
    "rms": lambda values: np.sqrt(np.nanmean(values**2)),
}


def variables_of(outcomes: Iterable[Outcome]) -> list[str]:
    """Variables of a recording that outcomes are computed from, each once."""
    names: list[str] = []
    for outcome in outcomes:
        names += _OF_FIGURES if outcome.figure else [outcome.variable or ""]
    return list(dict.fromkeys(names))


def numbers_of(outcomes: Mapping[str, Outcome], variables: Mapping[str, AnyArray]) -> dict[str, float]:
    """The outcomes of a run that has reached its end.

    Args:
        outcomes: by name.
        variables: `time` and those of `variables_of`, shape (samples, ...) each.
    """
    recorded: Any = SimpleNamespace(**variables)
    with warnings.catch_warnings(), np.errstate(invalid="ignore"):
        warnings.simplefilter("ignore", RuntimeWarning)  # of samples that are NaN throughout, which stay so
        figures = measure(recorded) if any(outcome.figure for outcome in outcomes.values()) else None
        return {
            name: float(getattr(figures, outcome.figure))
            if outcome.figure
            else _reduced(outcome, variables[outcome.variable or ""])
            for name, outcome in outcomes.items()
        }


def _reduced(outcome: Outcome, array: AnyArray) -> float:
    rows = np.asarray(array, dtype=float).reshape(len(array), -1)
    return float(_OVER[outcome.over](_OF[outcome.of](rows, axis=1)))
