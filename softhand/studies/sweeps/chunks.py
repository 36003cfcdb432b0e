"""The runs of a chunk, from their samples to the store: the same in any thread and on any machine."""

from __future__ import annotations

import time
from collections import Counter
from functools import cached_property, lru_cache
from pathlib import Path
from threading import Event, Lock

import numpy as np

from softhand.batch.run import FINISHED, Outcome
from softhand.batch.runs import together
from softhand.batch.series import Done, Series
from softhand.batch.variations import varied
from softhand.errors import SofthandError, StudyError
from softhand.numerics.arrays import AnyArray
from softhand.plugins import load_plugin_files, plugin_files
from softhand.recording.variables import COMPONENTS, VARIABLES
from softhand.scenario.scenario import Scenario
from softhand.simulation.keep import Keep
from softhand.studies.keys import values_at
from softhand.studies.samples import seed_keys
from softhand.studies.sweeps.numbers import numbers_of, variables_of
from softhand.studies.sweeps.store import Entry, Store, cut, find_store, made_with

_FAILED = "scenario"


class Work:
    """What a process does for a store; threads may share one.

    Attributes:
        store: where the chunks go.
    """

    def __init__(self, store: Store) -> None:
        self.store = store
        self._lock = Lock()
        study = store.study
        self._names = tuple(dict.fromkeys([*variables_of(study.outcomes.values()), *study.keep.variables]))

    def run(self, chunk: int, stop: Event) -> Entry | None:
        """Make the runs of a chunk and write them; None if `stop` came before the end.

        Raises:
            RecordingError: the chunk cannot be written.
        """
        begun = time.thread_time()
        done = []
        for run in self.store.runs_of(chunk):
            done.append(self.one(run, stop))
            if stop.is_set():
                return None
        ends = Counter(each.outcome.reason for each in done)
        return self.store.write(chunk, self._arrays(done), time.thread_time() - begun, ends)

    def one(self, run: int, stop: Event) -> Done:
        """One run, by its number."""
        try:
            scenario = self.scenario(run)
            keep = Keep.of(self._names, self.store.study.keep.every, scenario.control_period)
        except SofthandError as error:  # values that the scenario does not take together
            return Done(Outcome(_FAILED, 0.0, str(error)), {}, {}, False)
        return self._series.run(scenario, keep, stop)

    def scenario(self, run: int) -> Scenario:
        """The scenario of a run.

        Raises:
            ScenarioError: its values cannot be used together.
        """
        return varied(self.store.base, scenario_values(self.store, run), run)

    @cached_property
    def _made(self) -> Series:
        return Series(self.store.base)

    @property
    def _series(self) -> Series:
        with self._lock:  # made once, by whichever thread is first
            return self._made

    def _arrays(self, done: list[Done]) -> dict[str, AnyArray]:
        """What is written of some runs."""
        study = self.store.study
        numbers = [
            numbers_of(study.outcomes, each.variables) if each.outcome.reason == FINISHED else {} for each in done
        ]
        arrays = {
            "outcome": np.array([each.outcome.reason for each in done]),
            "stop_time": np.array([each.outcome.time for each in done]),
            "message": np.array([cut(each.outcome.message) for each in done]),
            "success": np.array([bool(own) and self._is_success(own) for own in numbers]),
            **{name: np.array([own.get(name, np.nan) for own in numbers]) for name in study.outcomes},
        }  # fmt: skip
        return {**arrays, **self._kept(done)}

    def _is_success(self, numbers: dict[str, float]) -> bool:
        """Whether all limits are kept; a number that there is none of keeps none."""
        return all(
            (limit.below is None or numbers[name] <= limit.below)
            and (limit.above is None or numbers[name] >= limit.above)
            for name, limit in self.store.study.success.items()
        )

    def _kept(self, done: list[Done]) -> dict[str, AnyArray]:
        """The variables that are kept, by the labels of the store."""
        names, layouts = self.store.study.keep.variables, self.store.layouts
        if not names:
            return {}
        known = {name: tuple(self.store.read(name)) for name in layouts if layouts[name].dims == (name,) != ("run",)}
        time_of = np.array(known.pop("time"))
        none = Done(Outcome("", 0.0, ""), {}, known, False)
        found, every = together(
            [each.variables for each in (none, *done)], [each.labels for each in (none, *done)], names, time_of
        )
        for name in names:
            for dim in VARIABLES[name].dims[1:]:
                if dim not in COMPONENTS and every[dim] != known[dim]:
                    new = ", ".join(sorted(set(every[dim]) - set(known[dim])))
                    raise StudyError(
                        f"keep: {name} of some runs has a {dim} {new}, which the scenario of the study has not; "
                        "vary what leaves the hand as it is, or keep other variables.",
                        key="keep.variables",
                    )
        return {name: found[name][1:] for name in names}


def scenario_values(store: Store, run: int) -> dict[str, object]:
    """What a run puts over the base, by keys of a scenario."""
    pairs = []
    for key, value in store.samples.row(run).items():
        pairs += [(each, value) for each in (key, *store.study.vary[key].also)]
    if store.samples.seeds is not None:
        pairs += [(key, int(store.samples.seeds[run])) for key in seed_keys(store.base)]
    return values_at(sorted(pairs, key=lambda pair: "[" in pair[0]), store.table)


@lru_cache(maxsize=2)
def work_in(folder: str, digest: str) -> Work:
    """The work for a store, opened once by each process that is not the driver.

    Raises:
        StudyError: this process does not see the store, or has other versions than it was made with.
    """
    store = find_store(Path(folder))
    if store is None or store.digest != digest:
        raise StudyError(f"{folder}: a worker does not see this store; it must be on a disk that all machines share.")
    own = made_with()
    if own != store.made_with:
        told = ", ".join(f"{name} {store.made_with.get(name)} and {own[name]}" for name in own
                         if own[name] != store.made_with.get(name))  # fmt: skip
        raise StudyError(f"{folder}: the driver and a worker have different versions: {told}; install the same.")
    known = {file.absolute() for file in plugin_files()}
    load_plugin_files([file for file in map(Path, store.plugins) if file not in known])
    return Work(store)
