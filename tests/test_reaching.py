"""Where an object has to be for all fingers to reach it, and grasps without any contact points to begin with."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from commands import run_command

import softhand
from softhand.assembly.plant import read_world
from softhand.errors import GraspError
from softhand.grasping.places import PlaceFinder
from softhand.grasping.reaching import place_in_reach, reachable_place
from softhand.grasping.situation import situation_of
from softhand.scenario.scenario import load_scenario
from softhand.scenario.ungrasped import without_grasp

FAR = [0.05, 0.2, 0.4]  # [m]


@pytest.fixture
def ungrasped(tmp_path: Path) -> Path:
    """A scenario without contact points and internal forces at the start."""
    text = (Path(softhand.__file__).parent / "scenarios/target-a.toml").read_text()
    file = tmp_path / "mine.toml"
    file.write_text(re.sub(r"contact_points = .*?(?=joint_guess)", "", text, flags=re.DOTALL))
    return file


@pytest.mark.slow
def test_the_object_goes_to_the_fingers() -> None:
    """From far away: at the new place each finger reaches what is told, at the old one none reaches anything."""
    scenario = load_scenario("target-a", {"object.position": FAR})
    here = situation_of(scenario, read_world(scenario))
    found = reachable_place(here)
    np.testing.assert_allclose(found.position, here.position + found.way)
    assert min(found.counts) > 0 and f"reach {', '.join(map(str, found.counts))} of" in str(found)
    finder = PlaceFinder(here, 60)
    assert not any(finder.places(i) for i in range(3))
    placed = place_in_reach(scenario).scenario
    finder = PlaceFinder(situation_of(placed, read_world(placed)), 200)
    assert all(finder.places(i) for i in range(3))


def test_an_object_stays_on_its_table() -> None:
    """It moves along the table alone."""
    scenario = load_scenario("grasp-and-lift", {"object.position": [0.1, 0.1, 0.142]})
    found = reachable_place(situation_of(scenario, read_world(scenario)))
    assert found.position[2] == pytest.approx(0.142, abs=1e-12) and np.linalg.norm(found.way) > 0.03


def test_an_object_too_large_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no place is found, what is left for each finger and what to try."""
    monkeypatch.setattr(PlaceFinder, "places", lambda *_: [])
    scenario = load_scenario("pinch")
    with pytest.raises(GraspError, match=r"no place of the object .* finger_1_tip .* mm.*another grasp.joint_guess"):
        reachable_place(situation_of(scenario, read_world(scenario)))


def test_only_what_is_missing_gets_a_stand_in(ungrasped: Path) -> None:
    """Contact points that are there, in the file or from the command line, stay."""
    assert without_grasp("target-a", {}) == {}
    values = without_grasp(ungrasped, {})
    assert load_scenario(ungrasped, values).grasp.internal_force == (0.0, 0.0, 0.0)
    assert without_grasp(ungrasped, {"grasp.contact_points": [[0.0, 0.0, 0.0]]}) == {}
    assert without_grasp(ungrasped, {"hand.tips": 3}) == {}


def test_grasps_without_contact_points(ungrasped: Path) -> None:
    """--place --propose from far away prints a position and a section that can be run."""
    far = ("--set", f"object.position={FAR}")
    result = run_command("grasp", "mine.toml", "--propose", "--place", "--count", "1", *far, folder=ungrasped.parent)
    assert result.returncode == 0, result.stderr
    position = re.search(r"^object.position = (\[.*?\])", result.stdout, re.MULTILINE)
    section = re.search(r"\[grasp\]\n.*?\njoint_guess = .*?\n", result.stdout, re.DOTALL)
    assert position and section
    text = re.sub(r"\[grasp\].*?(?=\n\[)", section[0], ungrasped.read_text(), flags=re.DOTALL)
    ungrasped.write_text(text)
    checked = run_command("check", "mine.toml", "--set", f"object.position={position[1]}", folder=ungrasped.parent)
    assert "no errors" in checked.stdout, checked.stderr


def test_the_direction_is_told_where_nothing_is_in_reach(ungrasped: Path) -> None:
    """With all fingers that reach nothing, and what they reach there."""
    far = ("--set", f"object.position={FAR}")
    result = run_command("grasp", "mine.toml", "--propose", *far, folder=ungrasped.parent)
    assert result.returncode == 1
    words = (
        r"finger_1_tip and finger_2_tip and finger_3_tip reach none .* move the object by \(.*\) mm of the base frame"
    )
    assert re.search(words, result.stderr), result.stderr
