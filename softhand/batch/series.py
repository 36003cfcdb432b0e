"""Runs of one scenario one after another: what they share is prepared once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from threading import Event, local
from typing import Any, NamedTuple

from softhand.assembly.build import assemble
from softhand.assembly.resolve import Setup, resolve
from softhand.assembly.variations import Variations
from softhand.batch.asked import Asked
from softhand.batch.run import FINISHED, CompiledRun, Outcome, is_compiled
from softhand.controllers.controller import Controller
from softhand.errors import GraspError, LawError, ModelError, SimulationStopped, SofthandError
from softhand.laws.law import Law
from softhand.numerics.arrays import AnyArray
from softhand.scenario.scenario import Scenario
from softhand.simulation.keep import Keep
from softhand.simulation.samples import labels_of


class Done(NamedTuple):
    """A run that is over."""

    outcome: Outcome
    variables: Mapping[str, AnyArray]
    labels: Mapping[str, tuple[str, ...]]
    compiled: bool


NOT_BEGUN = Done(Outcome("interrupted", 0.0, "not begun"), {}, {}, False)


class Series:
    """Runs of one scenario with other values, in as many threads as ask for them.

    A run is the same in any series and after any other run, to the last bit.

    Args:
        base: that all others differ from in something.
        controller: in place of those of the scenarios.
        law: at all tips in place of those of the scenarios.
    """

    def __init__(self, base: Scenario, controller: Controller | None = None, law: Law | None = None) -> None:
        self._resolved, self._seat = _resolver(base, controller, law), _Seat(Asked())

    def run(self, scenario: Scenario, keep: Keep, stop: Event) -> Done:
        """One run from its scenario to what is kept of it, in this thread.

        Args:
            scenario: of the run.
            keep: what is kept.
            stop: ends it, with the outcome `interrupted`.
        """
        return _run(lambda: self._resolved(scenario), keep, self._seat, stop)


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


def _resolver(base: Scenario, controller: Controller | None, law: Law | None) -> Callable[[Scenario], Setup]:
    """What makes the setup of a run."""
    try:
        return Variations(base, controller, law).to
    except SofthandError:  # the base has no start of its own, which does not matter
        return lambda scenario: resolve(scenario, controller, law)


def _run(resolved: Callable[[], Setup], keep: Keep, seat: _Seat, stop: Event) -> Done:
    """One run from its scenario to what is kept of it."""
    if stop.is_set():
        return NOT_BEGUN
    try:
        setup = resolved()
        if is_compiled(setup):
            run = seat.run(setup, keep)
            if run.law is not None:
                return Done(*run.go(stop.is_set), labels_of(run.plant, is_pushed=True), True)
        return _run_in_python(setup, keep, stop)
    except SofthandError as error:
        return Done(Outcome(_reason(error), 0.0, str(error)), {}, {}, False)


def _reason(error: SofthandError) -> str:
    """One word for why a run could not begin."""
    if isinstance(error, SimulationStopped):
        return error.reason
    return next((name for kind, name in _REASONS.items() if isinstance(error, kind)), "scenario")


_REASONS: dict[type[SofthandError], str] = {GraspError: "grasp", LawError: "law", ModelError: "model"}


def _run_in_python(setup: Setup, keep: Keep, stop: Event) -> Done:
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
    return Done(outcome, variables, labels_of(simulation.plant, is_pushed=True), False)
