"""A sweep that is done: its numbers, and what follows from them."""

from __future__ import annotations

from collections import Counter
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from softhand.errors import ScenarioError, StudyError
from softhand.numerics.arrays import AnyArray, Array
from softhand.scenario.scenario import Scenario
from softhand.studies.sweeps.chunks import Work
from softhand.studies.sweeps.rates import Rate, rate_of
from softhand.studies.sweeps.sensitivity import Sensitivity, rank, sobol
from softhand.studies.sweeps.store import Store, find_store


class Sweep:
    """The runs of a study, read from their store as they are asked for; `len` is how many there are.

    Attributes:
        folder: of the store.
        study: what they are runs of.
        base: the scenario that they share.
    """

    def __init__(self, store: Store) -> None:
        self._store, self.folder, self.study, self.base = store, store.folder, store.study, store.base

    def __len__(self) -> int:
        return self._store.runs

    def __repr__(self) -> str:
        ends = ", ".join(f"{count} {name}" for name, count in Counter(self.outcome.tolist()).most_common())
        return f"<Sweep: {len(self)} runs, {ends}; {', '.join(self.study.outcomes)}; {self.store}>"

    @property
    def store(self) -> Path:
        """What `xarray.open_zarr` opens."""
        return self._store.group

    @property
    def made_with(self) -> dict[str, str]:
        """Versions of softhand and of what the bits of its runs depend on."""
        return self._store.made_with

    @cached_property
    def values(self) -> dict[str, AnyArray]:
        """What was varied, numbers or objects, shape (runs,) each."""
        return self._store.samples.columns

    @cached_property
    def outcome(self) -> AnyArray:
        """How each run ended: `finished`, or why not; shape (runs,)."""
        return self._store.read("outcome")

    @cached_property
    def stop_time(self) -> Array:
        """Time of the last sample of each run [s], shape (runs,)."""
        return self._store.read("stop_time")

    @cached_property
    def message(self) -> AnyArray:
        """Why each run ended early, in words; shape (runs,)."""
        return self._store.read("message")

    @cached_property
    def success(self) -> AnyArray:
        """Which runs are a success: finished, and within all limits of `[success]`; shape (runs,)."""
        return self._store.read("success") == 1

    @cached_property
    def numbers(self) -> dict[str, Array]:
        """The outcomes, NaN of a run that was lost; shape (runs,) each."""
        return {name: self._store.read(name) for name in self.study.outcomes}

    @property
    def kept(self) -> dict[str, Array]:
        """The variables that were kept, read now, shape (runs, samples, ...) each; large ones better by xarray."""
        return {name: self._store.read(name) for name in self.study.keep.variables}

    def to_xarray(self) -> Any:
        """The store as a lazy `xarray.Dataset`.

        Raises:
            ImportError: xarray or zarr is not installed; they come with softhand[studies].
        """
        import xarray

        return xarray.open_zarr(self.store)

    def rate(self, where: AnyArray | None = None) -> Rate:
        """How often runs succeed.

        Args:
            where: which of them, shape (runs,); all if not given.
        """
        chosen = self.success if where is None else self.success[where]
        return rate_of(int(chosen.sum()), len(chosen))

    def sensitivity(self, outcome: str) -> Sensitivity | None:
        """What an outcome depends on: Sobol indices if the samples are a design for them, else rank correlations.

        Args:
            outcome: its name, or `success`.

        Returns:
            None where too few runs have a number, or all have the same.
        """
        values = self.success.astype(float) if outcome == "success" else self.numbers[outcome]
        if self._is_design:
            drawn = tuple(key for key, entry in self.study.vary.items() if not entry.is_grid)
            return sobol(outcome, drawn, values)
        columns = {key: column for key, column in self.values.items() if column.dtype != object}
        return rank(outcome, columns, values)

    @property
    def _is_design(self) -> bool:
        """Whether the runs are a design for Sobol indices, and nothing else."""
        alone = not any(entry.is_grid for entry in self.study.vary.values()) and self.study.sample.repeats == 1
        return self.study.sample.method == "saltelli" and alone

    def worst(self, most: int = 5) -> list[int]:
        """Numbers of the worst runs.

        First those that were lost on the way, the earliest first; then those that miss the limits by most, or, without
        limits, have the largest first outcome; last those that could not begin.
        """
        is_good = self.success & bool(self.study.success)
        rank = np.where(self._is_lost, np.where(self.stop_time > 0.0, 0, 2), np.where(is_good, 3, 1))
        return [int(run) for run in np.lexsort((-self._missed, rank))[:most]]

    @cached_property
    def _is_lost(self) -> AnyArray:
        return self.outcome != "finished"

    @cached_property
    def _missed(self) -> Array:
        """How bad each run is: of lost ones by how early, of others by how far it is beyond its limits."""
        first = next(iter(self.study.outcomes))
        bad = np.nan_to_num(self.numbers[first], nan=0.0, posinf=np.finfo(float).max)
        if self.study.success:
            bad = np.full(len(self), -np.inf)
            for name, limit in self.study.success.items():
                number = self.numbers[name]
                scale = max(abs(limit.below or 0.0), abs(limit.above or 0.0)) or 1.0
                for over in (number - limit.below if limit.below is not None else None,
                             limit.above - number if limit.above is not None else None):  # fmt: skip
                    if over is not None:
                        bad = np.fmax(bad, np.nan_to_num(over / scale, nan=np.inf))
        return np.where(self._is_lost, -self.stop_time, bad)

    def scenario(self, run: int) -> Scenario:
        """The scenario of a run, which repeats it.

        Raises:
            StudyError: there is no such run, or its values make no scenario.
        """
        if not 0 <= run < len(self):
            raise StudyError(f"run: got {run}; there are {len(self)} runs, counted from 0.", key="run", value=run)
        try:
            told = f"{self.base.description} (run {run} of {self.study.description or self.folder.name})".strip()
            return Work(self._store).scenario(run).with_values({"description": told})
        except ScenarioError as error:
            raise StudyError(str(error), key="run", value=run) from error


def load_sweep(folder: str | Path) -> Sweep:
    """A sweep from its folder, done or not.

    Raises:
        StudyError: there is none, or it cannot be read.
    """
    store = find_store(Path(folder))
    if store is None:
        raise StudyError(f"{folder}: holds no sweep; softhand sweep makes one.", file=folder)
    return Sweep(store)
