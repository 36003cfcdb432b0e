"""A held grasp that is pushed, again and again: each run until the push is survived or lost."""

from __future__ import annotations

from collections.abc import Callable
from math import prod
from typing import Any, NamedTuple

import numpy as np

from softhand.assembly.resolve import resolve
from softhand.batch.asked import PERIODS, Asked
from softhand.batch.loop import SAMPLES
from softhand.batch.rollout import rollout
from softhand.batch.run import FINISHED, CompiledRun, Outcome, is_compiled
from softhand.errors import RolloutStopped
from softhand.numerics.arrays import AnyArray, Array
from softhand.scenario.scenario import Scenario
from softhand.sensing.fields import shapes
from softhand.simulation.keep import Keep

_KEPT = ("limit_surface_use", "contact_force", "is_slipping")
_EVERY = 0.005  # [s] between samples
_LOOKS = 0.1  # [s] between two looks at whether a run is lost already
_SLIPS = 0.999  # use of the limit surface; a tip that slips is on it


class Course(NamedTuple):
    """How a push grows: in stairs to all of it, which then stays."""

    begins: Array
    """Of each stair [s]."""
    shares: Array
    """Of the push that each is, the last 1."""
    end: float
    """[s]"""

    @classmethod
    def of(cls, quiet: float, rise: float, stairs: int, rest: float) -> Course:
        """After a quiet time [s], without a jerk in so many stairs, 10 s^3 - 15 s^4 + 6 s^5, and a rest of it [s]."""
        s = np.arange(1.0, stairs + 1.0, dtype=np.float64) / stairs
        begins = quiet + rise / stairs * np.arange(stairs, dtype=np.float64)
        return cls(begins, s**3 * (10.0 - 15.0 * s + 6.0 * s**2), quiet + rise + rest)

    def before(self, time: float) -> float:
        """Share of the stair before the one of a time [s]."""
        k = int(np.searchsorted(self.begins, time, side="right")) - 2
        return float(self.shares[k]) if k >= 0 else 0.0


class Trial(NamedTuple):
    """What a push did."""

    end: str
    """What ended it; "" if it was survived."""
    share: float
    """Of the push that the tips had borne by then."""
    use: float
    """The largest of the limit surfaces."""
    time: float
    """When it was lost, or the run was over [s]."""


class PushedRun:
    """One start under many pushes, in the same memory of the compiled loop, as if each run were new.

    Args:
        scenario: which stays at its start.
        kind: "force" or "moment".
        course: of every push.
        point: where it acts, in the frame of the object [m].
        tips: names.
        is_stopped: asked now and then.

    Attributes:
        count: of runs.
    """

    def __init__(
        self,
        scenario: Scenario,
        kind: str,
        course: Course,
        point: Array,
        tips: tuple[str, ...],
        is_stopped: Callable[[], bool] = lambda: False,
    ) -> None:
        period = scenario.control_period
        duration = float(np.ceil(course.end / period - 1e-9) * period)
        self._course, self._kind, self._point, self._tips = course, kind, point.tolist(), tips
        self._scenario = scenario.replace({"duration": duration})
        self._every = max(round(_EVERY / period), 1) * period
        self._looks = min(max(round(_LOOKS / period), 1), PERIODS)
        self._is_stopped, self.count = is_stopped, 0
        self._setup = resolve(self._scenario.replace({"push": self._schedule(np.zeros(3))}))
        self._keep = Keep.of(_KEPT, self._every, period)
        run = CompiledRun(self._setup, self._keep, Asked()) if is_compiled(self._setup) else None
        self._run = None if run is None or run.law is None else run

    def push(self, push: Array) -> Trial:
        """Run from the start under a push that grows to this one [N or N m], shape (3,)."""
        self.count += 1
        if self._run is None or not self._run.become(self._setup, self._keep):
            return self._push_in_python(push)
        run, rows = self._run, self._run.plan.rows
        run.plan.pushes.rows[self._kind] = self._course.shares[:, None] * push
        columns, seen = self._columns(), 0

        def is_over() -> bool:
            nonlocal seen
            first, seen = seen, int(run.plan.progress[SAMPLES])
            use, force, slip = (rows[first:seen, begin:end] for begin, end in columns)
            return self._is_stopped() or bool(np.any(_gone(use, force[:, 2::4], slip)))

        outcome, found = run.go(is_over, self._looks)
        return self._judged(found, outcome)

    def _columns(self) -> list[tuple[int, int]]:
        """Of the rows, those of what is kept."""
        assert self._run is not None
        sizes, end, found = shapes(self._run.sizes), 1, {}
        for name in self._keep.fields:
            found[name] = (end, end + prod(sizes[name]))
            end = found[name][1]
        return [found[name] for name in _KEPT]

    def _push_in_python(self, push: Array) -> Trial:
        """The same for controllers and steppers without compiled code."""
        runs = rollout(self._scenario, [{"push": self._schedule(push)}], variables=_KEPT, every=self._every, threads=1)
        found = {"time": runs.time, **{name: runs[name][0] for name in runs.variables}}
        return self._judged(found, runs.outcomes[0])

    def _schedule(self, push: Array) -> list[dict[str, Any]]:
        begins, shares = self._course.begins, self._course.shares
        ends = [*begins[1:], self._course.end + 1.0]
        return [
            {self._kind: [float(value) for value in share * push], "point": self._point, "start": float(begin),
             "duration": float(end - begin)}
            for begin, end, share in zip(begins, ends, shares, strict=True)
        ]  # fmt: skip

    def _judged(self, found: dict[str, AnyArray], outcome: Outcome) -> Trial:
        """What the samples of a run tell."""
        if not len(found.get("time", ())):
            return Trial(f"the run does not begin: {outcome.message}", 0.0, np.inf, 0.0)
        within = found["time"] <= outcome.time + 1e-9
        time, use, slip = found["time"][within], found["limit_surface_use"][within], found["is_slipping"][within]
        pressing = found["contact_force"][within][:, :, 2]
        gone = np.flatnonzero(np.any(_gone(use, pressing, slip), axis=1))
        if len(gone):
            row = int(gone[0])
            tip = int(np.argmax(_gone(use[row], pressing[row], slip[row])))
            how = "lifts off" if pressing[row, tip] <= 0.0 else "slips"
            return self._trial(f"{self._tips[tip]} {how}", float(time[row]), use[: row + 1])
        if outcome.reason == FINISHED:
            return Trial("", 1.0, float(np.max(use)), float(time[-1]))
        if outcome.reason == "interrupted":
            raise RolloutStopped(outcome.message)
        return self._trial(f"the run ends: {outcome.reason}", outcome.time, use)

    def _trial(self, end: str, time: float, use: Array) -> Trial:
        return Trial(end, self._course.before(time - self._every), float(np.max(use)), time)


def _gone(use: AnyArray, pressing: AnyArray, slipping: AnyArray) -> AnyArray:
    """Which tips slip, or do not press any more."""
    gone: AnyArray = (use >= _SLIPS) | (slipping > 0) | (pressing <= 0.0)
    return gone
