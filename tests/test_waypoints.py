"""References through waypoints: from rest to rest, what stays, what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import softhand
from softhand.assembly.parts import read_motion, read_reference, read_start
from softhand.errors import ScenarioError
from softhand.recording.events import find_events
from softhand.references.goal import Goal
from softhand.references.reference import Motion
from softhand.references.straight import MinimumJerk
from softhand.references.waypoint import Waypoint, passed
from softhand.references.waypoints import Waypoints
from softhand.settings.settings import read_settings
from softhand.settings.toml import tomllib

START = Goal((0.0, 0.01, 0.142, 0.0, 0.1, 0.0), (1.0, 2.0, 3.0), opening=0.015, carried=0.0,
             standoff=(0.0, 0.1, 0.2))  # fmt: skip
FIRST = Goal((0.01, 0.01, 0.13, 0.0, 0.0, 0.2), (4.0, 4.0, 3.0), opening=-0.002, carried=0.5)
SECOND = Goal((0.02, 0.03, 0.12, 0.3, 0.0, 0.2), (5.0, 1.0, 3.0), opening=0.0, standoff=(0.1, 0.0, -0.2))
THIRD = Goal((0.0, 0.01, 0.142, 0.0, 0.1, 0.0), (0.0, 0.0, 0.0), carried=0.0)


def _waypoint(goal: Goal, **others: Any) -> Waypoint:
    position, rpy = np.split(np.asarray(goal.coordinates), 2)
    return Waypoint(
        object_position=position, object_rpy=rpy, internal_force=goal.internal_force, opening=goal.opening,
        carried=goal.carried, standoff=goal.standoff, **others,
    )  # fmt: skip


WAYPOINTS = (
    _waypoint(FIRST, duration=0.4, phase="a"),
    _waypoint(SECOND, duration=1.1),
    _waypoint(THIRD, duration=0.5, phase="c"),
)


@pytest.fixture
def passing() -> Motion:
    """A reference through three waypoints."""
    return Waypoints(waypoints=WAYPOINTS).start(START)


def _row(passing: Motion, time: float) -> np.ndarray:
    seen = passing.update(time)
    return np.concatenate([seen.coordinates, seen.internal_force, seen.opening, seen.carried, seen.standoff])


def test_it_is_at_each_waypoint_at_its_time_and_at_rest(passing: Motion) -> None:
    """Pose, force, opening and share are those of the waypoint there, the rates zero; the last one stays."""
    for time, point in ((0.0, START), (0.4, FIRST), (1.5, SECOND), (2.0, THIRD), (7.0, THIRD)):
        np.testing.assert_allclose(_row(passing, time), point.row(), rtol=0, atol=1e-14)
        np.testing.assert_allclose(passing.desired.coordinates_rate, 0.0, atol=1e-12)
        np.testing.assert_allclose(passing.desired.coordinates_acceleration, 0.0, atol=1e-11)


def test_between_two_waypoints_it_is_the_minimum_jerk(passing: Motion) -> None:
    """The second leg is the reference `minimum-jerk` of its length, later by the first."""
    position, rpy = SECOND.coordinates[:3], SECOND.coordinates[3:]
    alone = MinimumJerk(
        object_position=position, object_rpy=rpy, internal_force=SECOND.internal_force, duration=1.1
    ).start(FIRST)
    for time in (0.1, 0.37, 0.9):
        one, other = passing.update(0.4 + time), alone.update(time)
        for name in ("coordinates", "coordinates_rate", "coordinates_acceleration", "internal_force"):
            np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("time", [0.13, 0.8, 1.7])
def test_rates_are_the_slopes_of_the_values(passing: Motion, time: float) -> None:
    """q_Od', q_Od'' and those of the standoff against central differences."""
    h = 1e-5
    places, rates = ([getattr(passing.update(time + step), name).copy() for step in (-h, h)]
                     for name in ("standoff", "standoff_rate"))  # fmt: skip
    np.testing.assert_allclose(passing.update(time).standoff_rate, (places[1] - places[0]) / (2 * h), atol=1e-7)
    np.testing.assert_allclose(passing.desired.standoff_acceleration, (rates[1] - rates[0]) / (2 * h), atol=1e-5)
    before, after = (passing.update(time + step).coordinates.copy() for step in (-h, h))
    slow, fast = (passing.update(time + step).coordinates_rate.copy() for step in (-h, h))
    seen = passing.update(time)
    np.testing.assert_allclose(seen.coordinates_rate, (after - before) / (2 * h), atol=1e-8)
    np.testing.assert_allclose(seen.coordinates_acceleration, (fast - slow) / (2 * h), atol=1e-6)


def test_named_ways_are_phases(passing: Motion) -> None:
    """Name and begin of each way that has a name."""
    assert passing.phases == (("a", 0.0), ("c", 1.5)) and passing.stops == (0.4, 1.5, 2.0)


WAYS: list[dict[str, Any]] = [
    {"phase": "up", "duration": 0.05, "object_position": [0.0, 0.01, 0.145]},
    {"duration": 0.05, "internal_force": [5.0, 5.0, 4.0]},
]


def _target_a(ways: Any = WAYS, **values: Any) -> softhand.Scenario:
    return softhand.load_scenario("target-a", {"reference": {"kind": "waypoints", "waypoints": ways}, **values})


def test_what_a_waypoint_does_not_say_stays() -> None:
    """The second waypoint has the position of the first and the attitude of the start."""
    scenario = _target_a()
    start, first, second = passed(read_start(scenario), read_reference(scenario).waypoints)
    assert (start.opening, start.carried) == (0.0, 1.0)
    assert tuple(second.coordinates) == (0.0, 0.01, 0.145, 0.0, 0.0, 0.0)
    assert tuple(first.internal_force) == (4.0, 4.0, 3.0)
    assert tuple(second.internal_force) == (5.0, 5.0, 4.0)


def test_any_controller_follows_them_and_the_file_gives_the_same_run() -> None:
    """`regulation` on target A: what is recorded as desired passes the waypoints; the phases are in the events."""
    scenario = _target_a(duration=0.12)
    recording = softhand.simulate(scenario)
    np.testing.assert_allclose(recording.object_position_desired[50], [0.0, 0.01, 0.145], atol=1e-12)
    np.testing.assert_allclose(recording.internal_force_desired[-1], [5.0, 5.0, 4.0])
    assert [(e.time, e.text) for e in find_events(recording) if e.kind == "phase"] == [(0.0, "up")]
    again = read_motion(read_settings(softhand.Scenario, tomllib.loads(recording.scenario), ""))
    np.testing.assert_array_equal(again.update(0.05).coordinates[:3], recording.object_position_desired[50])


@pytest.mark.parametrize(
    ("reference", "key", "words"),
    [
        ({"kind": "waypoints"}, "reference.waypoints", "missing"),
        ({"kind": "step", "waypoints": WAYS}, "reference.object_position", "missing"),
        ({"kind": "waypoints", "waypoints": WAYS, "object_rpy": [0.0, 0.0, 0.0]}, "reference.object_rpy", "remove it"),
        ({"kind": "waypoints", "waypoints": [{"object_rpy": [0.0, 0.0, 0.0]}]}, "reference.waypoints", "item 1"),
        ({"kind": "waypoints", "waypoints": [{"duration": 1.0, "carried": 1.5}]}, "reference.waypoints", "1.5"),
        (
            {"kind": "waypoints", "waypoints": [*WAYS, {"duration": 1.0, "internal_force": [1.0]}]},
            "reference.waypoints, internal_force of item 3",
            "length 3",
        ),
    ],
)
def test_wrong_waypoints_are_refused(reference: dict[str, Any], key: str, words: str) -> None:
    """The message names the key and what is wrong."""
    with pytest.raises(ScenarioError, match=words) as caught:
        softhand.load_scenario("target-a", {"reference": reference})
    assert caught.value.key == key  # type: ignore[attr-defined]
