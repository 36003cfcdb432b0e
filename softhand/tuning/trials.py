"""Candidates in worlds: one run each, in threads, and what is found of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from softhand.batch.rollout import rollout
from softhand.batch.run import FINISHED
from softhand.numerics.arrays import Array
from softhand.scenario.scenario import Scenario
from softhand.tuning.figures import VARIABLES, figures_of

_AT_ONCE = 64  # runs whose samples are in memory together


class Tried(NamedTuple):
    """What candidates did in worlds.

    Attributes:
        figures: shape (candidates, worlds, names); NaN of a lost run.
        lost: 0 of a run that came to its end; 1 of one that was lost there, up to 2 at its begin, shape (candidates,
            worlds).
        why: words for each reason of a lost run, the first message of each.
    """

    figures: Array
    lost: Array
    why: dict[str, str]


class Trials:
    """Runs a scenario with values of candidates and worlds put over it.

    Args:
        base: the scenario.
        names: of the figures.
        threads: at work at the same time, as for `rollout`. They change nothing but the time.
        tell: called with the number of further runs that are done.
    """

    def __init__(
        self,
        base: Scenario,
        names: Sequence[str],
        threads: int | None = None,
        tell: Callable[[int], None] | None = None,
    ) -> None:
        self.base, self.names, self.threads = base, tuple(names), threads
        self.tell = tell or (lambda done: None)
        self.done = 0

    def run(
        self, candidates: Sequence[Mapping[str, Any]], worlds: Sequence[Mapping[str, Any]], longer: float = 1.0
    ) -> Tried:
        """Each candidate in each world.

        Args:
            candidates: values of the scenario by key.
            worlds: likewise.
            longer: times the duration of the scenario, for which they run.

        Raises:
            ScenarioError: the scenario does not take the values of a candidate.
            RolloutStopped: interrupted.
        """
        tables = [{**world, **candidate} for candidate in candidates for world in worlds]
        figures = np.full((len(tables), len(self.names)), np.nan)
        lost = np.zeros(len(tables))
        why: dict[str, str] = {}
        every = self.base.control_period
        duration = every * round(longer * self.base.duration / every)
        base = self.base.with_values({"duration": duration})
        at_once = max(int(_AT_ONCE / longer), 1)
        for begin in range(0, len(tables), at_once):
            some = tables[begin : begin + at_once]
            runs = rollout(base, some, variables=VARIABLES, every=every, threads=self.threads)
            for k, outcome in enumerate(runs.outcomes):
                if outcome.reason == FINISHED:
                    figures[begin + k] = figures_of(runs, k, self.names, duration)
                else:
                    lost[begin + k] = 2.0 - min(outcome.time / duration, 1.0)
                    why.setdefault(outcome.reason, outcome.message)
            self.count(len(some))
        shape = len(candidates), len(worlds)
        return Tried(figures.reshape(*shape, -1), lost.reshape(shape), why)

    def count(self, runs: int) -> None:
        """Further runs that are done."""
        self.done += runs
        self.tell(runs)
