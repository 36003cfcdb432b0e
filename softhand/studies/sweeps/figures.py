"""Figures of a sweep: which there are, and over which keys."""

from __future__ import annotations

import json

import numpy as np
from matplotlib.figure import Figure

from softhand.plots.sweep import Bars, Map, draw_map, draw_rates, draw_sensitivity
from softhand.plots.sweep_scatter import draw_scatter
from softhand.plots.varied import Varied
from softhand.scenario.values import unit_at
from softhand.studies.keys import split_key
from softhand.studies.sweeps.result import Sweep
from softhand.studies.sweeps.sensitivity import Sensitivity

_FEW = 12  # values of a key that count as a grid
_MOST_KEYS, _MOST_OUTCOMES = 9, 4


def draw_all(sweep: Sweep, worst: int = 5) -> dict[str, Figure]:
    """The figures that a sweep has enough for, by the names of their files: success, map, scatter, sensitivity.

    Args:
        sweep: which is done.
        worst: how many of the worst runs have their number.
    """
    title = sweep.study.description or f"Sweep of {sweep.study.scenario}"
    found = {name: key for name, key in keys_of(sweep).items() if len(np.unique(key.places)) > 1}
    figures: dict[str, Figure] = {}
    if not found:
        return figures
    told = [one for name in ("success", *sweep.study.outcomes) if (one := sweep.sensitivity(name)) is not None]
    order = _by_weight(list(found), told)

    def interval(which: np.ndarray) -> tuple[float, float, float]:
        rate = sweep.rate(which)
        return rate.value, rate.low, rate.high

    figures["success"] = draw_rates([found[name] for name in order[:_MOST_KEYS]], interval, title)
    if len(order) > 1:
        x, y = found[order[0]], found[order[1]]
        first, outcome = next(iter(sweep.study.outcomes.items()))
        maps = [
            Map("share of successes", sweep.success.astype(float), True),
            Map(f"{first}{_unit(outcome.units)}", sweep.numbers[first], False),
        ]
        figures["map"] = draw_map(x, y, maps, title)
        figures["scatter"] = draw_scatter(x, y, sweep.success, sweep.outcome != "finished", sweep.worst(worst), title)
    if told:
        figures["sensitivity"] = draw_sensitivity([_bars(one) for one in told[:_MOST_OUTCOMES]], title)
    return figures


def keys_of(sweep: Sweep) -> dict[str, Varied]:
    """What varies, as axes."""
    found = {}
    for key, column in sweep.values.items():
        entry, label = sweep.study.vary[key], f"{key}{_unit(unit_at(sweep.base, split_key(key)[0]))}"
        if column.dtype == object:
            texts = [value if isinstance(value, str) else json.dumps(value) for value in column]
            names = tuple(dict.fromkeys(texts))
            found[key] = Varied(label, np.array([float(names.index(text)) for text in texts]), names, True)
        else:
            few = len(np.unique(column)) <= _FEW and (entry.is_grid or entry.choice is not None)
            found[key] = Varied(label, column.astype(float), (), few, entry.scale == "log")
    return found


def _unit(unit: str) -> str:
    return f" [{unit}]" if unit and unit != "1" else ""


def _by_weight(keys: list[str], told: list[Sensitivity]) -> list[str]:
    """Keys by what they do to any outcome, the most first."""
    weight = dict.fromkeys(keys, 0.0)
    for one in told:
        sizes = one.total if one.kind == "sobol" else np.abs(one.first)
        for key, size in zip(one.keys, sizes, strict=True):
            weight[key] = max(weight.get(key, 0.0), float(size))
    return sorted(keys, key=lambda key: -weight[key])


def _bars(one: Sensitivity) -> Bars:
    left = f", {one.left_out} left out" if one.left_out else ""
    title = f"{one.outcome}  ({one.used} {'base samples' if one.kind == 'sobol' else 'runs'}{left})"
    series = [("first order" if one.kind == "sobol" else "correlation", one.first, one.first_low, one.first_high)]
    if one.kind == "sobol":
        series.append(("total", one.total, one.total_low, one.total_high))
    return Bars(title, one.keys, series)
