"""Gains of a controller for a wanted bandwidth and damping ratio, with a margin for delay."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from softhand.controllers.controller import Controller
from softhand.design.effective import Effective, effective
from softhand.design.families import NAMES, Knobs, first_knobs, not_known, with_knobs
from softhand.design.gain_design import GainDesign
from softhand.design.response import bandwidths, push_of_pose
from softhand.errors import GraspError, ScenarioError, SofthandError
from softhand.margins.delay import delay_margin, delayed_step, reach_of
from softhand.margins.groups import Groups
from softhand.margins.loop import Loop, close_loop, growth_of
from softhand.margins.modes import find_modes
from softhand.margins.place import Place, find_place
from softhand.numerics.arrays import Array
from softhand.plant.state import State
from softhand.plugins import find_plugin, plugin_name
from softhand.resting.equilibrium import equilibrium
from softhand.scenario.scenario import Scenario, as_scenario

_ENOUGH = 0.95
"""Share of what is wanted that counts as reached."""
_TURNS = 16
"""Loops that are tried for one bandwidth."""
_LESS, _LOWER = 0.75, 6
"""Share of a bandwidth that is tried after it, and how often."""
_IN_BAND = 2.0
"""Times the bandwidth: up to there a mode is one of the pose, beyond it one of the contacts."""
_DELAY = 0.1
"""Of a control period, that a loop has to bear if nothing else is asked for."""
_STAYS = -0.05  # [1/s] growth that is asked for at most


class Reached(NamedTuple):
    """What a loop does at the worst of the poses."""

    bandwidth: Array
    """Along and about the axes of the object [Hz], shape (6,)."""
    damping: float
    """Least damping ratio of the modes of the pose."""
    growth: float
    """Of the fastest growing, or slowest dying, motion [1/s]."""
    delayed: float
    """The same with the delay that is asked for [1/s]."""
    name: str
    """What moves in the motion that is nearest to be lost."""

    def lacks(self, bandwidth: float, damping: float) -> str:
        """The first thing that is missing, in words; nothing if all is reached."""
        if not self.growth < _STAYS:
            return f"small motions go at {self.growth:+.3g} 1/s ({self.name})"
        if not self.delayed < 0.0:
            return f"with the delay that is asked for small motions grow at {self.delayed:+.3g} 1/s ({self.name})"
        if self.damping < _ENOUGH * damping:
            return f"the damping ratio of a motion of the pose is {self.damping:.2g}"
        k = int(np.argmin(self.bandwidth))
        if self.bandwidth[k] < _ENOUGH * bandwidth:
            way = f"{'along' if k < 3 else 'about'} the {'xyz'[k % 3]} axis of the object"
            return f"the bandwidth {way} is {self.bandwidth[k]:.3g} Hz"
        return ""


def design_gains(
    source: Scenario | str | Path,
    bandwidth: float,
    damping: float = 0.3,
    *,
    controller: str | None = None,
    delay: float | None = None,
    state: State | None = None,
    overrides: Mapping[str, Any] | None = None,
    progress: Callable[[float], None] | None = None,
    **values: Any,
) -> GainDesign:
    """Gains of `regulation`, `object-impedance` or `computed-torque` for a bandwidth of the pose.

        found = softhand.design_gains("target-a", 3.0)
        softhand.simulate(softhand.load_scenario("target-a", {"controller": {"name": found.name, **found.settings}}))

    The first guess is the object as one mass, M = M_O + A^T M_F A with A the joint velocities by its twist in rolling
    contact: K = omega^2 M, and damping 2 zeta omega M at the object or, of the joints, nearest to it. Then the gains
    are turned, one axis each, until the linear loop of `stability` with its samples and its soft tips has the bandwidth
    along and about every axis, the damping ratio in each mode up to twice the bandwidth, and bears the delay. It is
    looked at where the scenario starts and where its reference ends, and the worse of both counts.

    Args:
        source: a scenario, its name or path.
        bandwidth: frequency up to which the pose follows what is asked for, to 71 % [Hz].
        damping: least damping ratio of the motions of the pose.
        controller: name, in place of that of the scenario, whose settings are then its defaults.
        delay: between sample and torque, that the loop has to bear [s]; a tenth of a control period by default.
        state: a rest, in place of start and end.
        overrides: dotted keys and values put over those of the scenario.
        progress: called with the share done of the first bandwidth.
        values: the same by the last part of the key.

    Raises:
        ScenarioError: bandwidth, damping or delay is none, or the controller has no such gains.
        GraspError: there is no rest, or the bandwidth cannot be reached; `value` is the nearest that can.
        SofthandError: as `build`.
    """
    scenario = as_scenario(source, overrides, **values)
    poses = _poses(scenario, state)
    period = poses[0].period
    _check(bandwidth, damping, delay, period)
    wanted_delay = _DELAY * period if delay is None else float(delay)
    first = poses[0].controller
    before = plugin_name("controllers", type(first))
    name = controller or before
    if name not in NAMES:
        raise not_known(name)
    base = first if name == before else find_plugin("controllers", name, "controller.name")()
    search = _Search(poses, base, damping, wanted_delay, progress or (lambda done: None))
    found = search.find(bandwidth)
    knobs, reached = found
    if lack := reached.lacks(bandwidth, damping):
        raise _unreached(search, bandwidth, lack)
    chosen = with_knobs(base, search.felt, knobs)
    after, old = search.loops(chosen), [close_loop(place) for place in poses]
    worst = int(np.argmax([loop.growth for loop in after]))
    groups = Groups(poses[worst].plant, poses[worst].state.q)
    changed = [key for key in type(chosen).model_fields if getattr(chosen, key) != _default(chosen, key)]
    return GainDesign(
        name=name, settings={key: _listed(getattr(chosen, key)) for key in changed},
        poses=tuple(place.words for place in poses), wanted=bandwidth, wanted_damping=damping,
        wanted_delay=wanted_delay, bandwidth=reached.bandwidth, damping=reached.damping, growth=reached.growth,
        delay=_least(delay_margin(loop, place) for loop, place in zip(after, poses, strict=True)), limit=reached.name,
        before=before, growth_before=max(loop.growth for loop in old),
        delay_before=_least(delay_margin(loop, place) for loop, place in zip(old, poses, strict=True)),
        modes=find_modes(after[worst], groups), modes_before=find_modes(old[worst], groups), controller=chosen,
    )  # fmt: skip


def _least(delays: Any) -> float:
    found = list(delays)
    return math.nan if any(math.isnan(one) for one in found) else min(found)


def _default(controller: Controller, key: str) -> Any:
    return type(controller).model_fields[key].default


def _listed(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _check(bandwidth: Any, damping: Any, delay: Any, period: float) -> None:
    fastest = 0.25 / period
    limits = {
        "bandwidth": (bandwidth, 0.0, fastest, "Hz, a quarter of the samples at most"),
        "damping": (damping, 0.0, 2.0, ", a damping ratio"),
        "delay": (delay, -1.0, 40.0 * period, "s, forty control periods at most"),
    }
    for key, (value, low, high, what) in limits.items():
        if value is None:
            continue
        is_number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        if not is_number or not low < value <= high or (key == "delay" and value < 0.0):
            least = "from 0" if key == "delay" else "above 0"
            raise ScenarioError(
                f"{key}: got {value!r}; give a number {least} to {high:g} {what}.", key=key, value=value
            )


def _poses(scenario: Scenario, state: State | None) -> list[Place]:
    """Where the loop is looked at."""
    if state is not None:
        return [find_place(scenario, state)]
    start = find_place(scenario)
    if start.goal and start.goal.opening:
        raise GraspError(
            "the fingers start open: there is no grasp to design gains for; give a rest as state, or set "
            "grasp.opening = 0 and grasp.internal_force.",
            finger="", quantity="opening", value=start.goal.opening,
        )  # fmt: skip
    rest = equilibrium(scenario)
    if rest.refusal is None and rest.time > 0.0:
        return [start, find_place(scenario, rest.state)]
    return [start]


def _unreached(search: _Search, bandwidth: float, lack: str) -> GraspError:
    lower = bandwidth
    for _ in range(_LOWER):
        lower *= _LESS
        _, reached = search.find(lower)
        if not reached.lacks(lower, search.damping):
            least = float(np.min(reached.bandwidth))
            return GraspError(
                f"bandwidth: {bandwidth:g} Hz with a damping ratio of {search.damping:g} and a delay of "
                f"{1e3 * search.delay:g} ms cannot be reached: {lack}. The nearest that was found is {lower:.3g} Hz.",
                finger="", quantity="bandwidth", value=min(lower, least),
            )  # fmt: skip
    return GraspError(
        f"bandwidth: {bandwidth:g} Hz with a damping ratio of {search.damping:g} and a delay of {1e3 * search.delay:g} "
        f"ms cannot be reached, nor any down to {lower:.2g} Hz: {lack}. Ask for less damping or delay, let the tips "
        "damp, or take a shorter control period.",
        finger="", quantity="bandwidth", value=math.nan,
    )  # fmt: skip


class _Search:
    """Gains that are turned until a loop has what is wanted."""

    def __init__(
        self, poses: list[Place], base: Controller, damping: float, delay: float, tell: Callable[[float], None]
    ) -> None:
        self.poses, self.base, self.damping, self.delay, self.tell = poses, base, damping, delay, tell
        self.felt: Effective = effective(poses[-1])
        self.reach = [reach_of(close_loop(place), place, delay) for place in poses]

    def loops(self, controller: Controller) -> list[Loop]:
        return [close_loop(place.with_controller(controller)) for place in self.poses]

    def find(self, bandwidth: float) -> tuple[Knobs, Reached]:
        """The first gains that have all, or those of all tried that lack the least."""
        knobs = first_knobs(self.base, self.felt, 2.0 * math.pi * bandwidth, self.damping)
        best: tuple[float, Knobs, Reached] | None = None
        for k in range(_TURNS):
            reached = self._reached(knobs, bandwidth)
            badness = self._badness(reached, bandwidth)
            if best is None or badness < best[0]:
                best = badness, knobs, reached
            if not reached.lacks(bandwidth, self.damping):
                break
            knobs = self._turned(knobs, reached, bandwidth)
            self.tell((k + 1.0) / _TURNS)
        assert best is not None
        return best[1], best[2]

    def _reached(self, knobs: Knobs, bandwidth: float) -> Reached:
        controller = with_knobs(self.base, self.felt, knobs)
        found = []
        for place, reach in zip(self.poses, self.reach, strict=True):
            there = place.with_controller(controller)
            try:
                loop = close_loop(there)
                delayed = growth_of(delayed_step(loop, there, self.delay, reach), loop.cycle)
                answered = bandwidths(loop, push_of_pose(there))
            except SofthandError:
                return Reached(np.zeros(6), 0.0, math.inf, math.inf, "no linear loop")
            modes = find_modes(loop, Groups(there.plant, there.state.q))
            of_pose = [mode.damping for mode in modes if 0.0 < mode.frequency < _IN_BAND * bandwidth]
            found.append(Reached(answered, min([1.0, *of_pose]), loop.growth, delayed, modes[0].name))
        worst = max(found, key=lambda one: one.growth)
        return Reached(
            np.min([one.bandwidth for one in found], axis=0), min(one.damping for one in found), worst.growth,
            max(one.delayed for one in found), worst.name,
        )  # fmt: skip

    def _badness(self, reached: Reached, bandwidth: float) -> float:
        lacking = np.maximum(0.0, np.log(bandwidth / np.maximum(reached.bandwidth, 1e-3)))
        undamped = max(0.0, 1.0 - reached.damping / self.damping)
        lost = 10.0 * (not reached.growth < _STAYS) + 5.0 * (not reached.delayed < 0.0)
        return float(np.max(lacking) + undamped + lost)

    def _turned(self, knobs: Knobs, reached: Reached, bandwidth: float) -> Knobs:
        """Stiffer where the pose is too slow, softer where too fast; more damping where it rings or is lost."""
        ratio = np.clip((bandwidth / np.maximum(reached.bandwidth, 1e-3)) ** 0.8, 0.7, 1.5)
        stiffness = knobs.stiffness * np.where((ratio < 1.0) & (ratio > 0.6), 1.0, ratio)
        if not (reached.growth < _STAYS and reached.delayed < 0.0):
            more = 1.2 if reached.damping < self.damping or reached.growth > 0.0 else 0.85
            return Knobs(stiffness, 0.5 * knobs.damping, more * knobs.joint_damping, max(0.3, 0.85 * knobs.force))
        more = min(1.5, (self.damping / max(reached.damping, 1e-3)) ** 0.8) if reached.damping < self.damping else 1.0
        return Knobs(stiffness, knobs.damping, more * knobs.joint_damping, knobs.force)
