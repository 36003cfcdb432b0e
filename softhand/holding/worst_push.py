"""The worst push: the largest force or moment in any direction that a grasp survives, and which friction and mass."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from softhand.errors import ControllerError, GraspError, ScenarioError
from softhand.holding.edge import NOTHING
from softhand.holding.held import Held
from softhand.holding.loads import directions
from softhand.holding.push_record import Kind, Profile, WorstPush
from softhand.holding.push_search import PushSearch
from softhand.holding.pushed_run import Course, PushedRun
from softhand.holding.pushing import Progress, Pushing
from softhand.holding.response import linear_reach, response
from softhand.holding.unpushed import Unpushed, unpushed
from softhand.numerics.arrays import Array, as_numbers
from softhand.scenario.scenario import Scenario, as_scenario
from softhand.settings.guesses import did_you_mean

_KINDS, _PROFILES = ("force", "moment"), ("ramp", "step")
_LEVELS = {12: 0, 42: 1, 162: 2}
_RAMP, _STAIRS, _REST = 0.6, 30, 0.3  # [s] of a ramp, and its stairs; [s] behind it
_STEP = 0.5  # [s] that a step lasts
_FIRST = {"ramp": 1.1, "step": 0.5}  # times the linear bound: what is pushed first


def worst_push(
    scenario: Scenario | str | Path,
    kind: Kind = "force",
    profile: Profile = "ramp",
    count: int = 42,
    along: Sequence[Sequence[float]] | Array = (),
    threads: int | None = None,
    progress: Progress | None = None,
) -> WorstPush:
    """The largest push in each direction that the start of a scenario survives under its controller.

    The reference is held at the start, or where the controller has come to rest. How the contact forces answer is
    linear near rest, `linear`; that tells how far to push first. Then each direction is pushed in the compiled loop
    with all that is not linear: the object moves, tips roll and slip, torques end at their limits. Survived is what
    lets no tip slip or lift and does not end the run. A push that is lost tells by what it had borne where to go on.
    Between the directions, where the linear bound and the edges beside promise less than the worst, others are tried.

    A ramp grows without a jerk in 0.6 s and is held for 0.3 s: slow beside the motions of the loop, so that the answer
    is nearly that of rest. A step is worse, as the object overshoots.

    Args:
        scenario: with a grasp at its start, or its name or path.
        kind: "force" through the centre of mass, or "moment".
        profile: "ramp" or "step".
        count: of directions, 12, 42 or 162.
        along: other directions that are pushed as well, in base axes, of any length but zero, shape (ways, 3).
        threads: as in `rollout`.
        progress: called with the number of directions that are done, and of all, of each series.

    Raises:
        GraspError: the start does not hold, or no tip touches.
        ScenarioError: an argument cannot be used.
    """
    _check(kind, profile, count)
    asked = _unit_vectors(along)
    grasp = unpushed(as_scenario(scenario))
    held = grasp.held
    linear, use = _linear(grasp, kind), float(np.max(held.limit_use))
    weight = float(np.linalg.norm(held.gravity))
    has_mass = kind == "force" and profile == "ramp" and weight > 0.0
    ways, n = np.vstack([asked, directions(_LEVELS[count])]), len(asked)
    down = held.gravity[None] / weight if has_mass else np.zeros((0, 3))
    with Pushing(pushed_run_of(grasp, kind, profile), threads, progress) as pushing:
        _must_last(pushing)
        search = PushSearch(pushing, _finite(linear, held, kind), use, _FIRST[profile])
        every = np.vstack([ways, down, -down])
        edges = search.edges(every, [*range(n), *range(len(ways), len(every))])
        edges, (more, less) = edges[: len(ways)], [edge.low / weight for edge in edges[len(ways) :]] or (np.nan, np.nan)
        others, beside = search.between(ways, edges)
    ways, edges = np.vstack([ways, others]), [*edges, *beside]
    sizes = np.array([edge.low for edge in edges])
    k = int(np.argmin(sizes))
    return WorstPush(
        kind=kind, profile=profile, directions=ways, sizes=sizes, ends=tuple(edge.end or NOTHING for edge in edges),
        linear=linear(ways), worst=float(sizes[k]), worst_direction=ways[k], worst_end=edges[k].end or NOTHING,
        along=n, friction=np.column_stack([use * held.friction, held.friction]),
        mass=np.array([max(held.mass - less, 0.0), held.mass + more]), mass_known=held.mass,
        contacts=held.tips, controller=grasp.scenario.controller.name, runs=pushing.runs,
    )  # fmt: skip


def _check(kind: str, profile: str, count: int) -> None:
    for key, value, allowed in (("kind", kind, _KINDS), ("profile", profile, _PROFILES), ("count", count, _LEVELS)):
        if value not in allowed:
            raise ScenarioError(
                f"{key}: got {value!r}; allowed are {', '.join(map(repr, allowed))}"
                f"{did_you_mean(str(value), map(str, allowed))}",
                key=key, value=value,
            )  # fmt: skip


def _unit_vectors(along: Sequence[Sequence[float]] | Array) -> Array:
    rows = as_numbers(along)
    if rows is None or (rows.size and (rows.ndim != 2 or rows.shape[1] != 3)):
        raise ScenarioError(f"along: got {along!r}; give directions of three numbers each.", key="along", value=along)
    rows = rows.reshape(-1, 3)
    for row in rows:
        if not np.all(np.isfinite(row)) or not np.any(row):
            raise ScenarioError(
                f"along: got {row.tolist()}; a direction has finite numbers that are not all zero.",
                key="along", value=row,
            )  # fmt: skip
    rows = rows / np.max(np.abs(rows), axis=1, keepdims=True)  # of any size, without overflow
    found: Array = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    return found


def _must_last(pushing: Pushing) -> None:
    """To the end of a run whose push is nothing."""
    trial = pushing.map(lambda run: run.push(np.zeros(3)), [()])[0]
    if trial.end:
        raise GraspError(
            f"the grasp does not last without any push: {trial.end} at t = {trial.time:g} s; softhand check tells "
            "whether the loop grows by itself.",
            quantity="run", value=trial.time,
        )  # fmt: skip


def _linear(grasp: Unpushed, kind: str) -> Callable[[Array], Array]:
    """The bound of the linear answer along ways of three numbers; NaN where the controller has none."""
    try:
        by_wrench = response(grasp.start)
    except ControllerError:
        return lambda ways: np.full(len(ways), np.nan)

    def reach(ways: Array) -> Array:
        wrenches = np.zeros((len(ways), 6))
        wrenches[:, :3] = ways if kind == "force" else 0.0
        wrenches[:, 3:] = ways if kind == "moment" else 0.0
        return linear_reach(grasp.held, by_wrench, wrenches)

    return reach


def _finite(linear: Callable[[Array], Array], held: Held, kind: str) -> Callable[[Array], Array]:
    """The same, with something to begin with where there is no bound, or nothing holds."""
    every = linear(directions(_LEVELS[42]))
    known = every[np.isfinite(every) & (every > 0.0)]
    friction = float(held.friction @ held.force[2::3])
    usual = float(np.median(known)) if len(known) else friction * (1.0 if kind == "force" else held.length)

    def bound(ways: Array) -> Array:
        found = linear(ways)
        return np.where(np.isfinite(found) & (found > 0.0), found, usual)

    return bound


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
    _check(kind, profile, min(_LEVELS))
    grasp = unpushed(as_scenario(scenario))
    with Pushing(pushed_run_of(grasp, kind, profile), threads, None) as pushing:
        trials = pushing.map(lambda run, push: run.push(push), [(push,) for push in sizes[:, None] * ways])
    return np.array([bool(trial.end) for trial in trials])


def pushed_run_of(grasp: Unpushed, kind: Kind, profile: Profile) -> Callable[[Callable[[], bool]], PushedRun]:
    """Makes runs that stop where a function says so."""
    world, quiet = grasp.start.probe.plant.world, grasp.quiet
    course = Course.of(quiet, _RAMP, _STAIRS, _REST) if profile == "ramp" else Course.of(quiet, 0.0, 1, _STEP)
    lever = np.array(world.model.inertias[world.object_joint].lever)
    return lambda is_stopped: PushedRun(grasp.scenario, kind, course, lever, grasp.held.tips, is_stopped)
