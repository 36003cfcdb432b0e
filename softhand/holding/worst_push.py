"""The worst push: the largest force or moment in any direction that a grasp survives, and which friction and mass."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from scipy.spatial import ConvexHull

from softhand.batch.rollout import rollout
from softhand.batch.runs import Runs
from softhand.errors import GraspError, ScenarioError
from softhand.holding.held import Held, held_there, look
from softhand.holding.loads import directions
from softhand.holding.response import linear_reach, response
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.numerics.spatial import rotation_of
from softhand.numerics.table import html_table
from softhand.scenario.scenario import Scenario
from softhand.settings.guesses import did_you_mean

Kind = Literal["force", "moment"]
Profile = Literal["ramp", "step"]
_KINDS, _PROFILES = ("force", "moment"), ("ramp", "step")
_WAYS = {12: 0, 42: 1, 162: 2}
_QUIET = 0.25  # [s] before a push
_RAMP, _STAIRS, _REST = 1.0, 50, 0.1  # [s] of a ramp, and its steps; [s] behind it
_STEP = 0.5  # [s] that a step lasts
_EVERY = 0.005  # [s] between samples
_FIRST = 1.6  # times the linear bound, up to which is pushed first
_TURNS = 5  # of the search for the size of a step
_WIDER = 2.0
_SLIPS = 0.999  # use of the limit surface; a tip that slips is on it
_TINY = 1e-9  # [N or N m]
_NET = 12  # points along the side of a triangle
_NEAR = 0.12  # [rad] of the directions that are tried around the worst

Progress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False, repr=False)
class WorstPush(Record):
    """What pushes a grasp survives: no tip slips or lifts, and the run goes on.

    Attributes:
        kind: "force", through the centre of mass, or "moment".
        profile: "ramp", slowly grown in 1 s; or "step", all at once and held for 0.5 s, where the overshoot counts.
        directions: unit vectors in base axes, shape (directions, 3).
        sizes: largest push of each direction that was survived in simulation [N or N m], shape (directions,).
        ends: what ended each, in words.
        linear: the same by the contact forces' linear answer at rest [N or N m], shape (directions,).
        worst: the smallest of `sizes` [N or N m].
        worst_direction: shape (3,).
        worst_end: what ends it.
        every: the same of a push of any direction, flat between those that were tried [N or N m].
        friction: the least mu of each contact with which the start holds, all lowered alike, and the mu there is, shape
            (nc, 2).
        mass: least and largest mass of the object of which the controller does not know, it counting with `mass_known`
            [kg], shape (2,); NaN for moments and steps.
        mass_known: [kg].
        contacts: names.
        controller: name.
        runs: that were simulated.
    """

    units: ClassVar = {
        "directions": "1", "sizes": "N or N m", "linear": "N or N m", "worst": "N or N m", "worst_direction": "1",
        "every": "N or N m", "friction": "1", "mass": "kg", "mass_known": "kg", "runs": "1",
    }  # fmt: skip

    kind: str
    profile: str
    directions: Array
    sizes: Array
    ends: tuple[str, ...]
    linear: Array
    worst: float
    worst_direction: Array
    worst_end: str
    every: float
    friction: Array
    mass: Array
    mass_known: float
    contacts: tuple[str, ...]
    controller: str
    runs: int

    def __repr__(self) -> str:
        return f"<WorstPush: {'; '.join(': '.join(row) for row in self.rows())}>"

    def _repr_html_(self) -> str:
        """The table of the command, for a notebook."""
        return html_table("Worst push", ("", ""), self.rows())

    @property
    def unit(self) -> str:
        """Of the sizes."""
        return "N" if self.kind == "force" else "N m"

    def within(self, direction: Array) -> float:
        """Largest push in a direction that is within what was survived, flat between neighbouring directions [N or N m].

        Args:
            direction: any length but zero, in base axes, shape (3,).
        """
        way = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
        corners = np.swapaxes(_patches(self.directions, np.maximum(self.sizes, _TINY)), 1, 2)
        shares = np.linalg.solve(corners, np.broadcast_to(way, (len(corners), 3))[..., None])[..., 0]
        inside = np.min(shares, axis=1) / np.sum(np.abs(shares), axis=1)
        return float(1.0 / np.sum(shares[int(np.argmax(inside))]))

    def rows(self) -> list[tuple[str, str]]:
        """Label and value."""
        what = "force through the centre of mass" if self.kind == "force" else "moment"
        how = "grown slowly, in 1 s" if self.profile == "ramp" else "all at once, held for 0.5 s"
        k = int(np.argmax(self.sizes))
        mu = ", ".join(f"{least:.3g} of {now:g}" for least, now in self.friction)
        rows = [
            ("push", f"{what}, {how}, under {self.controller}"),
            ("worst", f"{self.worst:.3g} {self.unit} along {_way(self.worst_direction)}; then {self.worst_end}"),
            ("best", f"{self.sizes[k]:.3g} {self.unit} along {_way(self.directions[k])}; then {self.ends[k]}"),
            ("whatever the direction", f"{self.every:.3g} {self.unit}"),
            ("worst by the linear answer", f"{np.min(self.linear):.3g} {self.unit} along "
             f"{_way(self.directions[int(np.argmin(self.linear))])}"),
            ("least friction without push", mu),
        ]  # fmt: skip
        if np.all(np.isfinite(self.mass)):
            rows.append(
                ("mass that it survives", f"{self.mass[0]:.3g} to {self.mass[1]:.3g} kg, counting with {self.mass_known:g}")
            )
        return [*rows, ("directions, runs", f"{len(self.directions)}, {self.runs}")]


def worst_push(
    scenario: Scenario,
    kind: Kind = "force",
    profile: Profile = "ramp",
    count: int = 42,
    threads: int | None = None,
    progress: Progress | None = None,
) -> WorstPush:
    """The largest push in each direction that the start of a scenario survives under its controller.

    The reference is held at the start. How the contact forces answer is linear near rest, `linear`; that tells how far
    to push. Then each direction is pushed in the compiled loop with everything that is not linear: the object moves, tips
    roll and slip, torques end at their limits. Survived is what lets no tip slip or lift and does not end the run.
    Around the worst direction others are tried.

    A slow push is a ramp of 1 s, which quasi-static bounds are about. A step is worse, as the object overshoots.

    Args:
        scenario: with a grasp at its start.
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
    start = look(scenario)
    held = held_there(start)
    _must_hold(held)
    linear_of = _linear(held, response(start), kind)
    pusher = _Pusher(scenario, held, kind, profile, threads, progress)
    ways = np.array(directions(_WAYS[count]))
    linear = linear_of(ways)
    sizes, ends = pusher.reach(ways, linear)
    k = int(np.argmin(sizes))
    around = _around(ways[k])
    near, near_ends = pusher.reach(around, linear_of(around))
    ways, sizes, ends = np.vstack([ways, around]), np.concatenate([sizes, near]), [*ends, *near_ends]
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
        worst=float(sizes[k]), worst_direction=ways[k], worst_end=ends[k], every=_inner_ball(ways, sizes),
        friction=np.column_stack([use * held.friction, held.friction]), mass=mass, mass_known=held.mass,
        contacts=held.tips, controller=scenario.controller.name, runs=pusher.runs,
    )  # fmt: skip


def _must_hold(held: Held) -> None:
    use = held.limit_use
    k = int(np.argmax(use))
    if use[k] >= 1.0:
        raise GraspError(
            f"{held.tips[k]} slips at the start without any push: it needs {use[k]:.3g} times its limit surface at mu = "
            f"{held.friction[k]:g}; mu = {np.ceil(1e3 * use[k] * held.friction[k]) / 1e3:g} would do, or a larger "
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
        self, scenario: Scenario, held: Held, kind: str, profile: str, threads: int | None, progress: Progress | None
    ) -> None:
        length = _RAMP + _REST if profile == "ramp" else _STEP
        period = scenario.control_period
        self._base = held_scenario(scenario, np.ceil((_QUIET + length) / period) * period)
        self._every = max(round(_EVERY / period), 1) * period
        self._point = [float(value) for value in _lever_of(held, scenario)]
        self._kind, self._profile, self._threads, self._progress = kind, profile, threads, progress
        self._tips = held.tips
        self.runs = 0

    def reach(self, ways: Array, linear: Array) -> tuple[Array, list[str]]:
        """Largest push that is survived along each way, and what ends it."""
        usual = np.median(linear[np.isfinite(linear)]) if np.any(np.isfinite(linear)) else 1.0
        top = _FIRST * np.where(np.isfinite(linear) & (linear > 0.0), linear, usual)
        search = self._ramp if self._profile == "ramp" else self._step
        return search(ways, top)

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
        length = (_RAMP if self._profile == "ramp" else _STEP) / stairs
        last = length + (_REST if self._profile == "ramp" else 0.0) + 1.0
        return [
            {self._kind: [float(value) for value in push * (k + 1) / stairs], "point": self._point,
             "start": _QUIET + k * length, "duration": length if k + 1 < stairs else last}
            for k in range(stairs)
        ]  # fmt: skip

    def _ramp(self, ways: Array, top: Array) -> tuple[Array, list[str]]:
        sizes, ends, open_ways = np.zeros(len(ways)), [""] * len(ways), np.arange(len(ways))
        top = top.copy()
        for _ in range(4):
            runs = self.push(ways[open_ways], top[open_ways])
            left = []
            for row, k in enumerate(open_ways):
                time, ends[k] = self._lost(runs, row)
                share = np.clip(np.ceil((time - _QUIET) / _RAMP * _STAIRS - 1e-9) - 1.0, 0.0, _STAIRS) / _STAIRS
                sizes[k] = top[k] * share
                if not ends[k]:
                    left.append(k)
            if not left:
                break
            open_ways = np.array(left)
            top[open_ways] *= _WIDER
        return sizes, [end or "nothing that was tried" for end in ends]

    def _step(self, ways: Array, top: Array) -> tuple[Array, list[str]]:
        low, high, ends = np.zeros(len(ways)), np.full(len(ways), np.inf), [""] * len(ways)
        size = 0.4 * top
        for _ in range(_TURNS + 3):
            runs = self.push(ways, size)
            for k in range(len(ways)):
                time, end = self._lost(runs, k)
                if end:
                    high[k], ends[k] = size[k], end
                else:
                    low[k] = size[k]
            size = np.where(np.isfinite(high), 0.5 * (low + np.minimum(high, 1e9)), _WIDER * size)
        return low, [end or "nothing that was tried" for end in ends]

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


def held_scenario(scenario: Scenario, duration: float) -> Scenario:
    """A scenario that stays at its start, with nothing recorded but what is asked for, and no pushes of its own."""
    return scenario.replace({"reference": {"kind": "hold"}, "duration": float(duration), "push": []})


def _lever_of(held: Held, scenario: Scenario) -> Array:
    """Centre of mass in the frame of the object [m]."""
    offset = held.position - np.array(scenario.object.position)
    lever: Array = rotation_of(scenario.object.rpy).T @ offset
    return lever


def _around(way: Array) -> Array:
    """Directions close to one, in two rings."""
    one = np.cross(way, np.eye(3)[int(np.argmin(np.abs(way)))])
    one /= np.linalg.norm(one)
    two = np.cross(way, one)
    turns = np.linspace(0.0, 2.0 * np.pi, 6, endpoint=False)
    rows = [way + np.tan(angle) * (np.cos(turn) * one + np.sin(turn) * two) for angle in (_NEAR, 2.0 * _NEAR) for turn in turns]
    found: Array = np.array(rows) / np.linalg.norm(rows, axis=1)[:, None]
    return found


def _patches(ways: Array, sizes: Array) -> Array:
    """Corners of the triangles between neighbouring directions, at what was survived there, shape (triangles, 3, 3)."""
    corners: Array = (ways * sizes[:, None])[ConvexHull(ways).simplices]
    return corners


def _inner_ball(ways: Array, sizes: Array) -> float:
    """Least distance of these triangles from zero, on a net of points on each."""
    weights = np.array([(a, b, _NET - a - b) for a in range(_NET + 1) for b in range(_NET + 1 - a)]) / _NET
    return float(np.min(np.linalg.norm(np.einsum("pc,tck->tpk", weights, _patches(ways, sizes)), axis=2)))


def _way(direction: Sequence[float] | Array) -> str:
    return "(" + ", ".join(f"{value + 0.0:.2f}" for value in np.round(direction, 2)) + ")"
