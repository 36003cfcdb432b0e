"""Placing the object where the fingers have most room."""

from __future__ import annotations

import numpy as np
import pytest
from commands import run_command

from softhand import GraspError, Scenario, load_scenario, place_object, simulate
from softhand.assembly.plant import read_world
from softhand.grasping import placement
from softhand.grasping.placement import room
from softhand.grasping.quality import quality_in
from softhand.scenario.scenario import with_law


def room_at(scenario: Scenario) -> float:
    world = read_world(scenario)
    return room(world, scenario, quality_in(world, scenario))


@pytest.mark.slow
def test_the_place_has_more_room_than_any_beside_it(tmp_path, monkeypatch) -> None:
    """From a place where the fingers do not reach: there is a grasp at rest, it runs, and no neighbour is better.

    The command prints the line to paste and the table of the new place.
    """
    found = []
    watched = lambda *args, **options: found.append(place_object(*args, **options)) or found[0]  # noqa: E731
    monkeypatch.setattr(placement, "place_object", watched)
    result = run_command("grasp", "target-a", "--place", "--set", "object.position=[0,0.010,0.190]", folder=tmp_path)
    (best,) = found
    assert result.returncode == 0 and " = ".join(best.rows()[0]) in result.stdout
    assert " ".join(best.quality.rows()[2]) in " ".join(result.stdout.split())
    assert (tmp_path / "runs/grasp-target-a/grasp.png").stat().st_size > 10_000
    assert best.room_before < -1.0 and best.room > 0.7
    assert best.room == room_at(best.scenario)
    place = np.array(best.scenario.object.position)
    asked = np.array([0.0, 0.010, 0.190])
    assert np.linalg.norm(place - asked) <= 0.040
    for way in np.vstack([np.eye(3), -np.eye(3)]):
        beside = best.scenario.with_values({"object.position": (place + 0.5e-3 * way).tolist()})
        assert room_at(beside) <= best.room or np.linalg.norm(place + 0.5e-3 * way - asked) > 0.040
    held = {"reference.object_position": place.tolist(), "duration": 0.05}
    assert simulate(best.scenario.with_values(held)).complete


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
    with pytest.raises(GraspError, match=r"within 2 mm of object.position there is no place .*out of reach by"):
        place_object(load_scenario("target-a", {"object.position": [0.0, 0.010, 0.300]}), span=0.002)
