"""Many runs of a scenario at once, in threads."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path
from threading import Event, local
from typing import Any, NamedTuple

import numpy as np

from softhand.assembly.build import assemble
from softhand.assembly.resolve import Setup, resolve
from softhand.assembly.variations import Variations
from softhand.batch.asked import Asked
from softhand.batch.memory import must_fit
from softhand.batch.run import FINISHED, CompiledRun, Outcome, is_compiled
from softhand.batch.runs import Runs, together
from softhand.batch.variations import Columns, tables_of, varied
from softhand.controllers.controller import Controller
from softhand.errors import (
    GraspError,
    LawError,
    ModelError,
    RolloutStopped,
    ScenarioError,
    SimulationStopped,
    SofthandError,
)
from softhand.laws.law import Law
from softhand.numerics.arrays import AnyArray
from softhand.recording.variables import VARIABLES
from softhand.scenario.instruments import check_variables
from softhand.scenario.scenario import Scenario, as_scenario
from softhand.simulation.keep import Keep
from softhand.simulation.samples import labels_of
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
        check_variables("variables", names, each.sensing, each.actuation, each.tactile)
    count = thread_count(threads)
    must_fit(scenarios, keeps)
    resolved, seat, stop = _resolver(base, controller, law), _Seat(Asked()), Event()
    done: dict[int, _Done] = {}

    def one(index: int) -> _Done:
        return _run(lambda: resolved(scenarios[index]), keeps[index], seat, stop)

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


class _Seat(local):
    """What a thread keeps from one run for the next; runs that differ in numbers alone use one memory in turn."""

    last: CompiledRun | None = None

    def __init__(self, asked: Asked) -> None:
        self._asked = asked

    def run(self, setup: Setup, keep: Keep) -> CompiledRun:
        """Ready to go."""
        last, self.last = self.last, None
        if last is None or not last.become(setup, keep):
            last = CompiledRun(setup, keep, self._asked)
        self.last = last
        return last


class _Done(NamedTuple):
    """A run that is over."""

    outcome: Outcome
    variables: Mapping[str, AnyArray]
    labels: Mapping[str, tuple[str, ...]]
    compiled: bool


_NOT_BEGUN = _Done(Outcome("interrupted", 0.0, "not begun"), {}, {}, False)


def thread_count(threads: int | None) -> int:
    """Threads that work at the same time: as many as there are processors if not given."""
    if threads is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if isinstance(threads, bool) or not isinstance(threads, int) or threads < 1:
        raise ScenarioError(f"threads: got {threads!r}; give a whole number, at least 1.", key="threads", value=threads)
    return threads


def _collect(futures: Mapping[Future[_Done], int], done: dict[int, _Done], progress: Progress | None) -> None:
    """Results as they come; the wait ends now and then, so that Ctrl-C is heard."""
    waiting = set(futures)
    while waiting:
        ready, waiting = wait(waiting, timeout=0.5, return_when=FIRST_COMPLETED)
        for future in ready:
            done[futures[future]] = future.result()
            if progress is not None:
                progress(len(done), len(futures))


def _resolver(base: Scenario, controller: Controller | None, law: Law | None) -> Callable[[Scenario], Setup]:
    """What makes the setup of a run."""
    try:
        return Variations(base, controller, law).to
    except SofthandError:  # the base has no start of its own, which does not matter
        return lambda scenario: resolve(scenario, controller, law)


def _run(resolved: Callable[[], Setup], keep: Keep, seat: _Seat, stop: Event) -> _Done:
    """One run from its scenario to what is kept of it."""
    if stop.is_set():
        return _NOT_BEGUN
    try:
        setup = resolved()
        if is_compiled(setup):
            run = seat.run(setup, keep)
            if run.law is not None:
                return _Done(*run.go(stop.is_set), labels_of(run.plant, is_pushed=True), True)
        return _run_in_python(setup, keep, stop)
    except SofthandError as error:
        return _Done(Outcome(_reason(error), 0.0, str(error)), {}, {}, False)


def _reason(error: SofthandError) -> str:
    """One word for why a run could not begin."""
    if isinstance(error, SimulationStopped):
        return error.reason
    return next((name for kind, name in _REASONS.items() if isinstance(error, kind)), "scenario")


_REASONS: dict[type[SofthandError], str] = {GraspError: "grasp", LawError: "law", ModelError: "model"}


def _run_in_python(setup: Setup, keep: Keep, stop: Event) -> _Done:
    """The same through `Simulation.run`."""

    def watch(_: Any) -> None:
        if stop.is_set():
            raise KeyboardInterrupt

    simulation = assemble(setup)
    try:
        recording = simulation.run(watch=watch)
        outcome = Outcome(FINISHED, recording.stop_time, "")
    except SimulationStopped as error:
        recording, outcome = error.recording, Outcome(error.reason, error.time, str(error))
    names = ("time", *keep.variables)
    variables = {name: recording.variables[name][:: keep.every] for name in names if name in recording.variables}
    return _Done(outcome, variables, labels_of(simulation.plant, is_pushed=True), False)


def _gathered(
    base: Scenario, tables: list[dict[str, Any]], done: Mapping[int, _Done], names: tuple[str, ...], every: float
) -> Runs:
    """All runs in one record; those that are not there have not begun."""
    runs = [done.get(index, _NOT_BEGUN) for index in range(len(tables))]
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
