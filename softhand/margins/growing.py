"""How far small motions grow in the course of a run, and what ends it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import ClassVar

import numpy as np

from softhand.assembly.parts import read_start
from softhand.assembly.probe import recorded_scenario
from softhand.assembly.resolve import Setup, resolve
from softhand.assembly.unmodelled import is_modelled
from softhand.closed_loop.start import goal_of, resting_since
from softhand.errors import GraspError, SofthandError
from softhand.margins.loop import NEUTRAL, acceleration_at, close_loop
from softhand.margins.place import END, Place, held_pose, place_in
from softhand.margins.remedies import Remedy, find_remedies
from softhand.numerics.record import Record
from softhand.numerics.spatial import rotation_of
from softhand.recording.recording import Recording
from softhand.references.goal import Goal
from softhand.start.grasp import solve_grasp

FOLD = 1e3
"""Growth of a small motion within a run from which it is told: a disturbance of 1 um is 1 mm by then."""


_AT = "a pose at which the reference rests"
_AT_REST = 1e-3  # [m/s^2 or rad/s^2] of a grasp that the controller keeps


@dataclass(frozen=True, eq=False)
class Growing(Record):
    """A stretch of a run in which small motions grow a thousandfold or more.

    Attributes:
        rate: of the fastest growing motion, with the torque held for the period, where it is largest [1/s].
        period: for which a torque is held [s].
        begin: of the stretch [s].
        end: of it [s].
        exponent: logarithm of the growth in it.
        poses: where the rates are from.
    """

    units: ClassVar = {"rate": "1/s", "period": "s", "begin": "s", "end": "s", "exponent": "1"}

    rate: float
    period: float
    begin: float
    end: float
    exponent: float
    poses: tuple[Place, ...]

    def short(self) -> str:
        """The figures in one sentence."""
        fold = f"1e{int(self.exponent / math.log(10.0))}"
        return (
            f"the closed loop is unstable: with torques held for {1e3 * self.period:g} ms small motions grow at up to "
            f"{self.rate:+.3g} 1/s, more than {fold}-fold from t = {self.begin:g} to {self.end:g} s."
        )

    def text(self) -> str:
        """The figures, and what ends the growth; every remedy has been tried on the linear loop."""
        found = find_remedies(self.poses)
        return f"{self.short()} {_advice(found)}"


def growing(setup: Setup, until: float | None = None) -> Growing | None:
    """What grows in a run, by the poses alone that its reference stays at or passes at rest.

    Between two of them the smaller rate of both is taken. A pose with open fingers, one that no grasp at rest with the
    contact points of the start has, and one whose controller cannot be asked there are not known and count as none.
    Obstacles are left out: where they hold the object, it does not rest at these poses.

    Args:
        setup: what the run is made of.
        until: end [s], before the duration of the scenario.

    Returns:
        The stretch of the largest growth, None where small motions grow less than a thousandfold, and where dry
        friction or servos leave no linear loop.
    """
    if not is_modelled(setup.world.mechanics, setup.actuation):
        return None
    end = setup.scenario.duration if until is None else until
    setup = replace(setup, supports=[support for support in setup.supports if support.obstacle is None])
    best: Growing | None = None
    grown, begin = 0.0, 0.0  # exponent, and since when
    passed: list[_Node] = []
    for (t0, first), (t1, second) in pairwise(_nodes(setup, end)):
        if first and second:
            rate = second.rate
            if rate > 0.0 or grown:  # else nothing grows between them, whatever the first is
                rate = min(rate, first.rate)
            grown += rate * (t1 - t0)
        if not (first and second and grown > 0.0):
            grown, begin, passed = 0.0, t1, []
            continue
        passed += [first, second]
        if grown > (best.exponent if best else math.log(FOLD)):
            poses = tuple({id(one): one.held for one in passed}.values())
            best = Growing(max(one.rate for one in passed), poses[0].period, begin, t1, grown, poses)
    return best


def growing_run(recording: Recording, setup: Setup | None = None, expected: Growing | None = None) -> Growing | None:
    """What grew in a run, complete or not: the larger of what `growing` says of it and of what its end pose says.

    The end pose is looked at where the motion has grown since the reference rests, or the run was lost.

    Args:
        recording: None is returned if it is empty, or if its scenario cannot be read: one with a controller of its own,
            say.
        setup: of its scenario, if that is known.
        expected: what `growing` says of the whole run; it is asked only if this is None and the run was lost, or if
            `setup` is.
    """
    end = recording.stop_time
    try:
        if setup is None:
            setup = resolve(recorded_scenario(recording))
            expected = growing(setup, end)
        elif not recording.complete:
            expected = growing(setup, end)
        if any(support.obstacle is not None for support in setup.supports):
            return expected
        begin = resting_since(setup.reference.start(read_start(setup.scenario)), end)
        if begin is None or not len(recording) or (recording.complete and not _has_grown(recording, begin)):
            return expected
        node = _Node(place_in(recording, END, setup), math.inf)
    except SofthandError:
        return None
    exponent = node.rate * (end - begin)
    if exponent <= (expected.exponent if expected else math.log(FOLD)):
        return expected
    return Growing(node.rate, node.held.period, begin, end, exponent, (node.held,))


def _has_grown(recording: Recording, begin: float) -> bool:
    """Whether the joints are faster at the end than they were in a twentieth of the time before."""
    speed = np.max(np.abs(recording.joint_velocity[recording.time >= begin]), axis=1, initial=0.0)
    peaks = [np.max(part, initial=0.0) for part in np.array_split(speed, 20)]
    return bool(peaks[-1] > 10.0 * min(peaks))


class _Node:
    """A pose, whose rate of growth is found when it is asked for."""

    def __init__(self, held: Place, at_rest: float = _AT_REST) -> None:
        self.held, self._at_rest = held, at_rest

    @cached_property
    def rate(self) -> float:
        """Growth with the torque held [1/s]; zero where the controller cannot be asked, or does not keep the rest."""
        try:
            rate = close_loop(self.held).growth
            is_restless = np.max(np.abs(acceleration_at(self.held))) > self._at_rest
        except Exception:
            return 0.0
        return 0.0 if is_restless or abs(rate) < NEUTRAL else rate


def _nodes(setup: Setup, end: float) -> Iterator[tuple[float, _Node | None]]:
    """The times at which the reference rests, with the pose there if it is known, to the end [s]."""
    start = read_start(setup.scenario)
    motion = setup.reference.start(start)
    if not motion.stops:
        return
    known: dict[bytes, _Node | None] = {}
    for time in sorted({0.0, end, *(stop for stop in motion.stops if stop < end)}):
        goal = goal_of(motion.update(time))
        name = goal.row().tobytes()
        if name not in known:
            held = _pose(setup, goal, start, time)
            known[name] = _Node(held) if held else None
        yield time, known[name]


def _pose(setup: Setup, goal: Goal, start: Goal, time: float) -> Place | None:
    """The grasp at rest that is asked for, if there is one."""
    if np.array_equal(goal.row(), start.row()):
        return held_pose(setup, goal, setup.grasp.state, time, _AT)
    grasp = setup.scenario.grasp
    if goal.opening or goal.carried < 1.0 or not np.any(goal.internal_force):
        return None
    position, rpy = np.split(np.asarray(goal.coordinates), 2)
    points, guess = grasp.contact_points, grasp.joint_guess
    try:
        held = solve_grasp(
            setup.world, setup.fingertips, points, goal.internal_force, position, rotation_of(rpy), guess,
            reach=grasp.reach,
        )  # fmt: skip
        return held_pose(setup, goal, held.state, time, _AT)
    except GraspError:
        return None


def _advice(found: list[Remedy]) -> str:
    if not found:
        return "No gain, control period or damping of the tips that was tried alone keeps them from growing."
    rates = " or with ".join(f"{remedy.setting} ({remedy.rate:+.2g} 1/s)" for remedy in found)
    return f"They grow no more with {rates}."
