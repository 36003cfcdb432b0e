"""The samples of a study: which values each of its runs has, always the same for the same study."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from softhand.numerics.arrays import AnyArray, Array
from softhand.scenario.scenario import Scenario
from softhand.studies.study import Sample, Study, Varied

_EDGE = 2.0**-40
"""Numbers of a unit interval stay so far from its ends: a normal distribution has none there."""


@dataclass(frozen=True, eq=False)
class Samples:
    """The values of all runs; `len` is how many there are.

    Runs of one sample are side by side: its repeats, at each node of the grid in turn.

    Attributes:
        columns: values by what varies, numbers or objects, shape (runs,) each.
        point: which sample a run is of, counted from 0, shape (runs,).
        repeat: which repeat it is, shape (runs,).
        seeds: of the noise of each run, shape (runs,); None where there are no repeats.
    """

    columns: dict[str, AnyArray]
    point: AnyArray
    repeat: AnyArray
    seeds: AnyArray | None

    def __len__(self) -> int:
        return len(self.point)

    def row(self, run: int) -> dict[str, Any]:
        """The values of one run as plain numbers and objects, by what varies."""
        return {
            key: column[run].item() if isinstance(column[run], np.generic) else column[run]
            for key, column in self.columns.items()
        }


def draw(study: Study) -> Samples:
    """The samples of a study.

    Values of a grid are all taken, the last key's in the innermost loop; all else is drawn, and each sample goes to all
    nodes of the grid, so that these differ in nothing but the grid.
    """
    grids = {key: nodes(entry) for key, entry in study.vary.items() if entry.is_grid}
    drawn = {key: entry for key, entry in study.vary.items() if not entry.is_grid}
    units = unit_points(study.sample, len(drawn))
    points, repeats = len(units), study.sample.repeats
    node = list(product(*grids.values()))
    inner = len(node) * repeats
    columns: dict[str, AnyArray] = {}
    for key, entry in study.vary.items():
        if entry.is_grid:
            own = _column([values[list(grids).index(key)] for values in node])
            columns[key] = np.tile(np.repeat(own, repeats), points)
        else:
            columns[key] = np.repeat(at_unit(entry, units[:, list(drawn).index(key)]), inner)
    seeds = None
    if repeats > 1:
        rng = np.random.default_rng([study.sample.seed, repeats])
        seeds = np.tile(rng.integers(10**9, size=(points, 1, repeats)), (1, len(node), 1)).ravel()
    return Samples(
        columns, np.repeat(np.arange(points), inner), np.tile(np.arange(repeats), points * len(node)), seeds
    )  # fmt: skip


def nodes(entry: Varied) -> list[Any]:
    """The values of a grid."""
    if entry.grid is not None:
        return list(entry.grid)
    assert entry.range is not None and entry.points is not None
    spaced = np.geomspace if entry.scale == "log" else np.linspace
    values: list[Any] = spaced(*entry.range, entry.points).tolist()
    return [entry.range[0], *values[1:-1], entry.range[1]]


def at_unit(entry: Varied, u: Array) -> AnyArray:
    """What is drawn for numbers that are even in the unit interval: the inverse of the distribution.

    Args:
        entry: no grid.
        u: shape (n,).
    """
    if entry.choice is not None:
        places = np.minimum((u * len(entry.choice)).astype(int), len(entry.choice) - 1)
        return _column([entry.choice[place] for place in places])
    if entry.normal is not None:
        mean, deviation = entry.normal
        return mean + deviation * ndtri(np.clip(u, _EDGE, 1.0 - _EDGE))
    assert entry.range is not None
    low, high = entry.range
    values = low * (high / low) ** u if entry.scale == "log" else low + (high - low) * u
    return np.clip(values, low, high)


def unit_points(sample: Sample, keys: int) -> Array:
    """Points in the unit cube, shape (points, keys).

    Those of `saltelli` come in blocks of `keys + 2`: a point of A, one of B, and then A with one coordinate after the
    other from B [Saltelli et al. 2010, Comput. Phys. Commun. 181, 259-270].
    """
    rng, count = np.random.default_rng(sample.seed), sample.count
    if keys == 0:
        return np.zeros((1 if sample.method == "grid" else count, 0))
    if sample.method == "random":
        return rng.random((count, keys))
    if sample.method == "latin-hypercube":
        return np.asarray(qmc.LatinHypercube(keys, seed=rng).random(count))
    if sample.method == "sobol":
        return np.asarray(qmc.Sobol(keys, seed=rng).random(count))
    both = np.asarray(qmc.Sobol(2 * keys, seed=rng).random(count))
    blocks = np.repeat(both[:, None, :keys], keys + 2, axis=1)
    blocks[:, 1] = both[:, keys:]
    for key in range(keys):
        blocks[:, 2 + key, key] = both[:, keys + key]
    return blocks.reshape(-1, keys)


def seed_keys(base: Scenario) -> list[str]:
    """Keys of a scenario whose seeds differ between the repeats of a sample."""
    return [f"{name}.seed" for name in ("sensing", "actuation") if getattr(base, name) is not None]


def _column(values: list[Any]) -> AnyArray:
    """Numbers as an array of them, all else as objects."""
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        kind = int if all(isinstance(value, int) for value in values) else float
        return np.array(values, dtype=kind)
    column = np.empty(len(values), dtype=object)
    for place, value in enumerate(values):  # at once, lists of one length would become rows
        column[place] = value
    return column
