"""Variations of a scenario: values by key for each run, checked before anything runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from softhand.assembly.parts import read_controller, read_reference, read_stepper, read_tip
from softhand.errors import ScenarioError, SofthandError
from softhand.scenario.keywords import full_keys
from softhand.scenario.scenario import Scenario
from softhand.settings.settings import frozen

Columns: TypeAlias = Mapping[str, Sequence[Any] | np.ndarray[Any, Any]] | Sequence[Mapping[str, Any]]
"""A column of values for each key, or a table of values for each run. Keys as in `Scenario.with_values`, or their last
part where there is only one such key."""


def tables_of(scenario: Scenario, variations: Columns) -> list[dict[str, Any]]:
    """The values of each run by dotted key.

    Raises:
        ScenarioError: columns differ in length, there is no run, or a key is unknown.
    """
    if isinstance(variations, Mapping):
        columns = {key: list(frozen(column)) for key, column in variations.items() if _is_column(key, column)}
        lengths = {key: len(column) for key, column in columns.items()}
        if len(set(lengths.values())) > 1:
            told = ", ".join(f"{key} has {length}" for key, length in lengths.items())
            raise ScenarioError(f"variations: {told}; give as many values of each, one a run.", key="variations")
        rows = [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
    else:
        rows = [frozen(row) for row in variations]
    if not rows:
        raise ScenarioError("variations: there is no run; give at least one value.", key="variations")
    table = scenario.model_dump(exclude_none=True)
    known: dict[str, str] = {}
    for key in {key for row in rows for key in row}:
        known[key] = key if "." in key or key in table else next(iter(full_keys({key: None}, table, Scenario)))
    return [{known[key]: value for key, value in row.items()} for row in rows]


def _is_column(key: str, column: Any) -> bool:
    if isinstance(column, str) or not hasattr(column, "__len__"):
        raise ScenarioError(
            f"variations: {key} is {column!r}; give a list of values, one a run. What all runs share goes into the "
            "scenario.",
            key=key, value=column,
        )  # fmt: skip
    return True


def varied(scenario: Scenario, values: Mapping[str, Any], index: int) -> Scenario:
    """The scenario of one run, its plugins with it checked.

    Raises:
        ScenarioError: a value is wrong; names the run and its values.
    """
    try:
        changed = scenario.with_values(values)
        touched = {key.split(".")[0] for key in values}
        for section, read in _READERS:
            if section in touched:
                read(changed)
        return changed
    except SofthandError as error:
        told = ", ".join(f"{key} = {value!r}" for key, value in values.items())
        raise ScenarioError(f"run {index} ({told}): {error}", key=next(iter(values), ""), value=values) from error


_READERS: tuple[tuple[str, Callable[[Scenario], Any]], ...] = (
    ("controller", read_controller),
    ("stepper", read_stepper),
    ("reference", read_reference),
    ("fingertip", read_tip),
)
