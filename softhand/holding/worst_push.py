"""The worst push: the largest force or moment in any direction that a grasp survives, and which friction and mass."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from softhand.assembly.build import simulate
from softhand.batch.rollout import rollout
from softhand.batch.runs import Runs
from softhand.closed_loop.start import HeldStart
from softhand.errors import GraspError, ScenarioError, SimulationStopped
from softhand.holding.held import Held, held_there, look
from softhand.holding.loads import directions
from softhand.holding.push_record import Kind, Profile, WorstPush
from softhand.holding.response import linear_reach, response
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.scenario.scenario import Scenario, as_scenario
from softhand.settings.guesses import did_you_mean

_KINDS, _PROFILES = ("force", "moment"), ("ramp", "step")
_WAYS = {12: 0, 42: 1, 162: 2}
_PILOT = 2.0  # [s] without a push, after which the grasp is taken as at rest
_QUIET = 0.05  # [s] before a push
_RESTING = 0.01  # of the contact forces, within which the start is at rest
_RAMP, _STAIRS, _REST = 0.6, 30, 0.3  # [s] of a ramp, and its steps; [s] behind it
_STEP = 0.5  # [s] that a step lasts
_EVERY = 0.005  # [s] between samples
_FIRST = 1.5  # times the linear bound, up to which is pushed first
_WIDER = 2.0
_TRIES = 5
_OF_STEP = 0.7  # of that, from which steps come down
_LADDER = (1.0, 0.85, 0.7, 0.5, 0.3, 0.15)
_FEW, _HALVINGS = 6, 3  # of the worst directions, which are looked at closer
_ROUNDS = 4
_SLIPS = 0.999  # use of the limit surface; a tip that slips is on it
_NEAR = 0.2  # [rad] of the directions that are tried around the worst, first

Progress = Callable[[int, int], None]


def worst_push(
    scenario: Scenario | str | Path,
    kind: Kind = "force",
    profile: Profile = "ramp",
    count: int = 42,
    threads: int | None = None,
    progress: Progress | None = None,
) -> WorstPush:
    """The largest push in each direction that the start of a scenario survives under its controller.

    The reference is held at the start, or where the controller has come to rest. How the contact forces answer is
    linear near rest, `linear`; that tells how far to push. Then each direction is pushed in the compiled loop with all
    that is not linear: the object moves, tips roll and slip, torques end at their limits. Survived is what lets no tip
    slip or lift and does not end the run. What is lost comes down until it is survived, closer for the worst
    directions, and around the worst others are tried.

    A ramp grows without a jerk in 0.6 s and is held for 0.3 s: slow beside the motions of the loop, so that the answer
    is nearly that of rest. A step is worse, as the object overshoots.

    Args:
        scenario: with a grasp at its start, or its name or path.
        kind: "force" through the centre of mass, or "moment".
        profile: "ramp" or "step".
        count: of directions, 12, 42 or 162.
        threads: as in `rollout`.
        progress: called with the number of runs that are done, and of all, of each series.

    Raises:
        GraspError: the start does not hold, or no tip touches.
        ScenarioError: an argument cannot be used.
        ControllerError: the torque depends on a sum over time, which has no value at rest.
    """
    for key, value, allowed in (("kind", kind, _KINDS), ("profile", profile, _PROFILES), ("count", count, _WAYS)):
        if value not in allowed:
            raise ScenarioError(
                f"{key}: got {value!r}; allowed are {', '.join(map(repr, allowed))}"
                f"{did_you_mean(str(value), map(str, allowed))}",
                key=key, value=value,
            )  # fmt: skip
    scenario = as_scenario(scenario)
    start, quiet = _at_rest(scenario)
    held = held_there(start)
    _must_hold(held)
    linear_of = _linear(held, response(start), kind)
    pusher = _Pusher(scenario, held, kind, profile, quiet, threads, progress)
    ways = np.array(directions(_WAYS[count]))
    linear = linear_of(ways)
    sizes, ends = pusher.reach(ways, linear)
    k = int(np.argmin(sizes))
    way, size, end = pusher.below(ways[k], float(sizes[k]))
    if end:
        ways, sizes, ends = np.vstack([ways, way]), np.append(sizes, size), [*ends, end]
    linear, k = linear_of(ways), int(np.argmin(sizes))
    mass = np.full(2, np.nan)
    if kind == "force" and profile == "ramp" and np.any(held.gravity):
        size = float(np.linalg.norm(held.gravity))
        down = held.gravity / size
        (more, less), _ = pusher.reach(np.array([down, -down]), linear_of(np.array([down, -down])))
        mass = np.array([max(held.mass - less / size, 0.0), held.mass + more / size])
    use = float(np.max(held.limit_use))
    return WorstPush(
        kind=kind, profile=profile, directions=ways, sizes=sizes, ends=tuple(ends), linear=linear,
        worst=float(sizes[k]), worst_direction=ways[k], worst_end=ends[k],
        friction=np.column_stack([use * held.friction, held.friction]), mass=mass, mass_known=held.mass,
        contacts=held.tips, controller=scenario.controller.name, runs=pusher.runs,
    )  # fmt: skip


def _at_rest(scenario: Scenario) -> tuple[HeldStart, float]:
    """Where a grasp rests under its controller, and when [s]: at the start, or where the controller takes it."""
    held_there(look(scenario))
    try:
        run = simulate(held_scenario(scenario, _PILOT))
    except SimulationStopped as error:
        raise GraspError(f"the start does not hold without any push: {error}", finger=error.finger, quantity="run",
                         value=error.time) from error  # fmt: skip
    force, last = run.contact_force[:, :, :3], run.contact_force[-1, :, :3]
    away = np.max(np.linalg.norm(force - last, axis=2), axis=1) > _RESTING * np.max(np.abs(last))
    if not away[0]:
        return look(scenario), _QUIET
    return look(run, float(run.time[-1])), max(float(run.time[np.flatnonzero(away)[-1]]), _QUIET)


def _must_hold(held: Held) -> None:
    use = held.limit_use
    k = int(np.argmax(use))
    if use[k] >= 1.0:
        raise GraspError(
            f"{held.tips[k]} slips at the start without any push: it needs {use[k]:.3g} times its limit surface at "
            f"mu = {held.friction[k]:g}; mu = {np.ceil(1e3 * use[k] * held.friction[k]) / 1e3:g} would do, or a larger "
            "grasp.internal_force (softhand squeeze tells which).",
            finger=held.tips[k], quantity="limit surface", value=float(use[k]),
        )  # fmt: skip


def _linear(held: Held, by_wrench: tuple[Array, Array], kind: str) -> Callable[[Array], Array]:
    """The bound of the linear answer along ways of three numbers."""

    def reach(ways: Array) -> Array:
        wrenches = np.zeros((len(ways), 6))
        wrenches[:, :3] = ways if kind == "force" else 0.0
        wrenches[:, 3:] = ways if kind == "moment" else 0.0
        return linear_reach(held, by_wrench, wrenches)

    return reach


class _Pusher:
    """Pushes in the compiled loop."""

    def __init__(
        self,
        scenario: Scenario,
        held: Held,
        kind: str,
        profile: str,
        quiet: float,
        threads: int | None,
        progress: Progress | None,
    ) -> None:
        length = _RAMP + _REST if profile == "ramp" else _STEP
        period = scenario.control_period
        self._quiet = np.ceil(quiet / period) * period
        self._base = held_scenario(scenario, np.ceil((self._quiet + length) / period) * period)
        self._every = max(round(_EVERY / period), 1) * period
        self._point = [float(value) for value in _lever_of(held, scenario)]
        self._kind, self._profile, self._threads, self._progress = kind, profile, threads, progress
        self._tips = held.tips
        self.runs = 0

    def reach(self, ways: Array, linear: Array) -> tuple[Array, list[str]]:
        """Largest push that is survived along each way, and what ends it."""
        usual = np.median(linear[np.isfinite(linear)]) if np.any(np.isfinite(linear)) else 1.0
        top = _FIRST * np.where(np.isfinite(linear) & (linear > 0.0), linear, usual)
        high, ends = self._first(ways, top) if self._profile == "ramp" else (_OF_STEP * top, [""] * len(ways))
        return self._descend(ways, high, ends)

    def push(self, ways: Array, sizes: Array) -> Runs:
        """Runs with a push along each way, to these sizes."""
        tables = [{"push": self._schedule(way * size)} for way, size in zip(ways, sizes, strict=True)]
        self.runs += len(tables)
        names = ("limit_surface_use", "contact_force", "is_slipping")
        return rollout(
            self._base, tables, variables=names, every=self._every, threads=self._threads, progress=self._progress
        )

    def _schedule(self, push: Array) -> list[dict[str, Any]]:
        stairs = _STAIRS if self._profile == "ramp" else 1
        times, shares = self._quiet + _RAMP / _STAIRS * np.arange(stairs), _grown((np.arange(stairs) + 1.0) / stairs)
        return [
            {self._kind: [float(value) for value in push * share], "point": self._point, "start": float(time),
             "duration": _RAMP / _STAIRS if k + 1 < stairs else 100.0}
            for k, (time, share) in enumerate(zip(times, shares, strict=True))
        ]  # fmt: skip

    def _first(self, ways: Array, top: Array) -> tuple[Array, list[str]]:
        """Where a ramp to so large a push, or a larger one, makes a tip slip, and which; infinite where none does."""
        sizes, ends, waiting, top = np.full(len(ways), np.inf), [""] * len(ways), np.arange(len(ways)), top.copy()
        for _ in range(_TRIES):
            runs = self.push(ways[waiting], top[waiting])
            for row, k in enumerate(waiting):
                time, ends[k] = self._lost(runs, row)
                before = np.floor((time - self._every - self._quiet) * _STAIRS / _RAMP) / _STAIRS
                sizes[k] = top[k] * _grown(np.clip(before, 0.0, 1.0)) if ends[k] else np.inf
            waiting = np.array([k for k in waiting if not ends[k]], dtype=int)
            top[waiting] *= _WIDER
            if not len(waiting):
                break
        return np.where(np.isfinite(sizes), sizes, top / _WIDER), ends

    def survived(self, ways: Array, sizes: Array) -> list[str]:
        """What ends each push; "" if it was survived."""
        runs = self.push(ways, sizes)
        return [self._lost(runs, k)[1] for k in range(len(ways))]

    def _descend(self, ways: Array, high: Array, ends: list[str]) -> tuple[Array, list[str]]:
        """The first of less and less of these pushes that is survived; then halving, between it and the one before."""
        low, high, waiting = np.zeros(len(ways)), high.copy(), np.arange(len(ways))
        start = high.copy()
        for share in _LADDER:
            found = self.survived(ways[waiting], share * start[waiting])
            for k, end in zip(waiting, found, strict=True):
                if end:
                    ends[k], high[k] = end, share * start[k]
                else:
                    low[k] = share * start[k]
            waiting = np.array([k for k, end in zip(waiting, found, strict=True) if end], dtype=int)
            if not len(waiting):
                break
        worst = np.argsort(low)[:_FEW]
        worst = worst[(low[worst] > 0.0) & (low[worst] < high[worst])]
        for _ in range(_HALVINGS if len(worst) else 0):
            middle = 0.5 * (low[worst] + high[worst])
            for k, size, end in zip(worst, middle, self.survived(ways[worst], middle), strict=True):
                if end:
                    ends[k], high[k] = end, size
                else:
                    low[k] = size
        return low, [end or "nothing that was tried" for end in ends]

    def below(self, way: Array, size: float) -> tuple[Array, float, str]:
        """A push beside this one, of the same size or a smaller, that is lost; and how much of it is survived."""
        end, width = "", _NEAR
        for _ in range(_ROUNDS):
            around = _around(way, width)
            ends = self.survived(around, np.full(len(around), size))
            lost = [k for k, end in enumerate(ends) if end]
            if lost:
                sizes, told = self._descend(around[lost], np.full(len(lost), size), [ends[k] for k in lost])
                k = int(np.argmin(sizes))
                way, size, end = around[lost][k], float(sizes[k]), told[k]
            else:
                width *= 0.5
        return way, size, end

    def _lost(self, runs: Runs, k: int) -> tuple[float, str]:
        """When a push was not survived any more, and why; "" if it was to the end."""
        use, force = runs.limit_surface_use[k], runs.contact_force[k, :, :, 2]
        slips, lifts = (use >= _SLIPS) | (runs.is_slipping[k] > 0), force <= 0.0
        outcome = runs.outcomes[k]
        gone = np.any(slips | lifts, axis=1) & (runs.time <= outcome.time + 1e-9)
        if np.any(gone):
            row = int(np.argmax(gone))
            tip = int(np.argmax(slips[row] | lifts[row]))
            return float(runs.time[row]), f"{self._tips[tip]} {'lifts off' if lifts[row, tip] else 'slips'}"
        if outcome.reason != "finished":
            return outcome.time, f"the run ends: {outcome.reason}"
        return np.inf, ""


def _grown(share: Array) -> Array:
    """How far a push has grown at a share of its time, 0 to 1, without a jerk: 10 s^3 - 15 s^4 + 6 s^5."""
    grown: Array = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    return grown


def pushes(
    scenario: Scenario,
    ways: Array,
    sizes: Array,
    kind: Kind = "force",
    profile: Profile = "ramp",
    threads: int | None = None,
) -> Array:
    """Which pushes the start of a scenario does not survive, as `worst_push` tries them.

    Args:
        scenario: with a grasp at its start.
        ways: unit vectors in base axes, shape (pushes, 3).
        sizes: [N or N m], shape (pushes,).
        kind: "force" or "moment".
        profile: "ramp" or "step".
        threads: as in `rollout`.
    """
    scenario = as_scenario(scenario)
    start, quiet = _at_rest(scenario)
    pusher = _Pusher(scenario, held_there(start), kind, profile, quiet, threads, None)
    return np.array([bool(end) for end in pusher.survived(ways, sizes)])


def held_scenario(scenario: Scenario, duration: float) -> Scenario:
    """A scenario that stays at its start, with nothing recorded but what is asked for, and no pushes of its own."""
    return scenario.replace({"reference": {"kind": "hold"}, "duration": float(duration), "push": []})


def _lever_of(held: Held, scenario: Scenario) -> Array:
    """Centre of mass in the frame of the object [m]."""
    offset = held.position - np.array(scenario.object.position)
    lever: Array = rotation_of(scenario.object.rpy).T @ offset
    return lever


def _around(way: Array, width: float) -> Array:
    """Eight directions at an angle from one [rad], shape (8, 3)."""
    one = np.cross(way, np.eye(3)[int(np.argmin(np.abs(way)))])
    one /= np.linalg.norm(one)
    two, turns = np.cross(way, one), np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)[:, None]
    found: Array = np.cos(width) * way + np.sin(width) * (np.cos(turns) * one + np.sin(turns) * two)
    return found
