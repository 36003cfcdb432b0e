"""Many runs of a scenario at once, in threads."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np

from softhand.batch.memory import must_fit
from softhand.batch.runs import Runs, together
from softhand.batch.series import NOT_BEGUN, Done, Series
from softhand.batch.variations import Columns, tables_of, varied
from softhand.controllers.controller import Controller
from softhand.errors import RolloutStopped, ScenarioError
from softhand.laws.law import Law
from softhand.recording.variables import VARIABLES
from softhand.scenario.instruments import check_variables
from softhand.scenario.scenario import Scenario, as_scenario
from softhand.simulation.keep import Keep
from softhand.version import __version__

USUAL = ("object_position", "object_rpy", "internal_force", "contact_force", "limit_surface_use")
"""Variables that are kept if nobody says which."""

Progress = Callable[[int, int], None]
"""Called with the number of runs that are done, and of all."""


def rollout(
    scenario: Scenario | str | Path,
    variations: Columns,
    controller: Controller | None = None,
    law: Law | None = None,
    variables: Iterable[str] = USUAL,
    every: float = 0.01,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Runs:
    """Run a scenario many times, each time with other values, in the compiled loop without Python.

        rng = np.random.default_rng(0)
        runs = softhand.rollout("target-a", {"mass": rng.uniform(0.1, 0.3, 500), "k_r": rng.uniform(3e5, 4e5, 500)})
        runs.finished.mean(), runs.object_position[:, -1]

    A run is the same alone and in any company, to the last bit. Controllers that have compiled code, see
    `Controller.formula`, run without the lock of the interpreter; others work as well, one at a time and slower, and so
    do steppers other than those that ship with a fixed step.

    Args:
        scenario: what all runs share: from `load_scenario`, the name of one that ships, or the path of a TOML file.
        variations: `{key: values}`, a value a run, or `[{key: value}, ...]`, a table a run. Keys are dotted, or the
            last part of one; any of a scenario's will do.
        controller: in place of the scenario's.
        law: at all tips in place of the scenario's.
        variables: what is kept of each run, names of `recording.variables`.
        every: time between two samples that are kept [s].
        threads: at work at the same time; as many as there are processors if not given.
        progress: called after each run.

    Raises:
        ScenarioError: a key, a value, a variable or a number is wrong, before anything runs; or the samples would not
            fit into memory. Names the run.
        RolloutStopped: interrupted; carries `.runs` with what is done.
    """
    base = as_scenario(scenario)
    tables = tables_of(base, variations)
    scenarios = [varied(base, table, index) for index, table in enumerate(tables)]
    names = tuple(variables)
    keeps = [Keep.of(names, every, scenario.control_period) for scenario in scenarios]
    for each in scenarios:
        check_variables("variables", names, each.sensing, each.actuation, each.tactile, each.fingertip.has_elements)
    count = thread_count(threads)
    must_fit(scenarios, keeps)
    series, stop = Series(base, controller, law), Event()
    done: dict[int, Done] = {}

    def one(index: int) -> Done:
        return series.run(scenarios[index], keeps[index], stop)

    with ThreadPoolExecutor(count) as pool:
        futures = {pool.submit(one, index): index for index in range(len(tables))}
        try:
            _collect(futures, done, progress)
        except KeyboardInterrupt:
            stop.set()
            for future in futures:
                future.cancel()
            wait(futures)
            done.update({i: future.result() for future, i in futures.items() if not future.cancelled()})
            whole = sum(item.outcome.reason != "interrupted" for item in done.values())
            raise RolloutStopped(
                f"interrupted: {whole} of {len(tables)} runs are done; they are in .runs",
                runs=_gathered(base, tables, done, names, every),
            ) from None
    return _gathered(base, tables, done, names, every)


def thread_count(threads: int | None) -> int:
    """Threads that work at the same time: as many as there are processors if not given."""
    if threads is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if isinstance(threads, bool) or not isinstance(threads, int) or threads < 1:
        raise ScenarioError(f"threads: got {threads!r}; give a whole number, at least 1.", key="threads", value=threads)
    return threads


def _collect(futures: Mapping[Future[Done], int], done: dict[int, Done], progress: Progress | None) -> None:
    """Results as they come; the wait ends now and then, so that Ctrl-C is heard."""
    waiting = set(futures)
    while waiting:
        ready, waiting = wait(waiting, timeout=0.5, return_when=FIRST_COMPLETED)
        for future in ready:
            done[futures[future]] = future.result()
            if progress is not None:
                progress(len(done), len(futures))


def _gathered(
    base: Scenario, tables: list[dict[str, Any]], done: Mapping[int, Done], names: tuple[str, ...], every: float
) -> Runs:
    """All runs in one record; those that are not there have not begun."""
    runs = [done.get(index, NOT_BEGUN) for index in range(len(tables))]
    time = np.round(every * np.arange(max(len(run.variables.get("time", ())) for run in runs)), 12)
    variables, labels = together([run.variables for run in runs], [run.labels for run in runs], names, time)
    keys = dict.fromkeys(key for table in tables for key in table)
    used = {dim for name in variables for dim in VARIABLES[name].dims}
    return Runs(
        time=time,
        variables=variables,
        labels={dim: labels[dim] for dim in labels if dim in used},
        varied={key: tuple(table.get(key) for table in tables) for key in keys},
        outcomes=tuple(run.outcome for run in runs),
        compiled=np.array([run.compiled for run in runs]),
        scenario=base.to_toml(),
        version=__version__,
    )
