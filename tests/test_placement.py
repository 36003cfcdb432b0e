"""Placing the object where the fingers have most room."""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

import softhand.commands.main
from softhand import GraspError, load_scenario, place_object, simulate
from softhand.assembly.plant import read_world
from softhand.commands.main import app
from softhand.grasping.placement import room
from softhand.grasping.quality import quality_in
from softhand.scenario.scenario import with_law

assert softhand.commands.main.main  # which adds the commands


def room_at(scenario: softhand.Scenario) -> float:
    world = read_world(scenario)
    return room(world, scenario, quality_in(world, scenario))


def test_the_place_has_more_room_than_any_beside_it() -> None:
    """From a place where the fingers do not reach: there is a grasp at rest, it runs, and no neighbour is better."""
    task = load_scenario("target-a", {"object.position": [0.0, 0.010, 0.190], "duration": 0.05})
    placement = place_object(task)
    assert placement.room_before < -1.0 and placement.room > 0.7
    assert placement.room == room_at(placement.scenario)
    place = np.array(placement.scenario.object.position)
    assert np.linalg.norm(place - task.object.position) <= 0.040
    for way in np.vstack([np.eye(3), -np.eye(3)]):
        beside = placement.scenario.with_values({"object.position": (place + 0.5e-3 * way).tolist()})
        assert room_at(beside) <= placement.room or np.linalg.norm(place + 0.5e-3 * way - task.object.position) > 0.040
    assert simulate(placement.scenario.with_values({"reference.object_position": place.tolist()})).complete


def test_room_is_the_least_of_what_is_free() -> None:
    """Against a count by hand, for both kinds of law."""
    for law in ("nakashima", "hertz"):
        scenario = load_scenario("target-a")
        if law != scenario.fingertip.law:
            scenario = with_law(scenario, law)
        world = read_world(scenario)
        quality = quality_in(world, scenario)
        lower, upper = world.position_limits
        free = []
        for k, finger in enumerate(quality.fingers):
            middle, half = 0.5 * (lower + upper)[3 * k : 3 * k + 3], 0.5 * (upper - lower)[3 * k : 3 * k + 3]
            free += list(1.0 - np.abs(finger.angles - middle) / half)
            free += list(1.0 - np.abs(finger.torque) / world.effort_limit[3 * k : 3 * k + 3])
            degrees = np.degrees(finger.Phi)
            free.append(min(degrees / 45.0, 1.0) if law == "hertz" else 1.0 - abs(degrees - 45.0) / 45.0)
        assert room(world, scenario, quality) == pytest.approx(min(free), rel=1e-12)


def test_where_no_place_will_do_it_says_why() -> None:
    """The reason is that of the best place, and nothing is returned."""
    with pytest.raises(GraspError, match=r"within 10 mm of object.position there is no place .*out of reach by"):
        place_object(load_scenario("target-a", {"object.position": [0.0, 0.010, 0.300]}), span=0.010)


def test_the_command_prints_the_line_to_paste(tmp_path) -> None:
    """And the table is that of the new place."""
    words = ["grasp", "pinch", "--place", "--out", str(tmp_path / "grasp.png")]
    result = CliRunner().invoke(app, words, catch_exceptions=False)
    assert result.exit_code == 0 and "object.position = [0, 0, 0.1435]" in result.output
    assert (tmp_path / "grasp.png").stat().st_size > 10_000
