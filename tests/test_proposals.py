"""Proposed grasps: they hold, they run, they are the same each time."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hands import FINGER_GUESS
from test_grasp_quality import run, scenario_of

from softhand.assembly.build import simulate
from softhand.assembly.plant import read_world
from softhand.errors import GraspError
from softhand.grasping.chains import finger_chain, place_tip, work_rows
from softhand.grasping.inverse import approach
from softhand.grasping.places import PHI, PRESSING, RESERVE
from softhand.grasping.proposals import USE, Proposal, propose_grasps
from softhand.grasping.quality import grasp_quality
from softhand.scenario.scenario import Scenario, load_scenario
from softhand.settings.toml import tomllib

MOVED = (0.004, 0.006, 0.139)  # [m]


# ---------------------------------------------------------------------------------------- as near as a finger gets


def approached(name: str, target: np.ndarray) -> tuple[float, np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Distance left, joint angles, where the first tip then is, and the limits."""
    world = read_world(load_scenario(name))
    links, columns = finger_chain(world, 0, np.zeros(world.n_joints))
    lower, upper = (limit[columns] for limit in world.position_limits)
    angles = np.array(FINGER_GUESS)
    gap = approach(links, target, angles, lower, upper, np.empty((3, 3)))
    place = np.empty(3)
    place_tip(links, angles, np.empty((3, 3)), place, np.empty((3, 3)), np.empty((work_rows(3), 3)))
    return gap, angles, place, (lower, upper)


def test_a_point_in_reach_is_reached() -> None:
    """To rounding."""
    target = np.array([0.036, 0.010, 0.142])
    gap, _, place, _ = approached("target-a", target)
    assert gap < 1e-9
    np.testing.assert_allclose(place, target, atol=1e-9)


def test_a_point_beside_the_plane_of_a_finger_is_met_in_the_plane() -> None:
    """As near as it gets: the distance to the plane."""
    gap, _, place, _ = approached("pinch", np.array([0.036, 0.007, 0.142]))
    assert gap == pytest.approx(0.007, rel=1e-6)
    np.testing.assert_allclose(place, [0.036, 0.0, 0.142], atol=1e-5)


def test_limits_are_kept() -> None:
    """A point behind the hand: the finger stops at its limits, not beyond, and says what is left."""
    target = np.array([0.3, 0.3, -0.1])
    gap, angles, place, (lower, upper) = approached("target-a", target)
    assert np.all(angles >= lower) and np.all(angles <= upper) and np.any((angles == lower) | (angles == upper))
    assert gap == pytest.approx(np.linalg.norm(target - place), rel=1e-3) and gap > 0.1


# --------------------------------------------------------------------------------------------------------- proposals


@pytest.fixture(scope="module")
def proposals() -> list[Proposal]:
    """For the reference hand, the box a little off its place."""
    return propose_grasps(load_scenario("target-a", {"object.position": MOVED}), count=3, points=200)


def hold(scenario: Scenario) -> None:
    """The start, held for 0.1 s with slip, under Eq. (59): nothing moves."""
    start = scenario.object.position
    recording = simulate(
        scenario.with_values(
            {
                "duration": 0.1,
                "fingertip.contact": "coulomb",
                "reference.object_position": start,
                "reference.object_rpy": scenario.object.rpy,
                "reference.internal_force": scenario.grasp.internal_force,
            }
        )
    )
    assert recording.complete and not recording.is_slipping.any()
    np.testing.assert_allclose(recording.object_position[-1], start, atol=1e-6)


def test_proposals_are_grasps_at_rest(proposals: list[Proposal]) -> None:
    """Each as its own scenario has the figures that it promises."""
    for proposal in proposals:
        found = grasp_quality(proposal.scenario)
        assert found.refusal is None and found.margin == pytest.approx(proposal.margin, rel=1e-12)
        for finger in found.fingers:
            assert finger.friction_use < USE + 0.02 and finger.force[2] > PRESSING - 1e-6
            assert finger.reserve.min() > 0.9 * RESERVE
            assert PHI[0] - math.radians(5.0) < finger.Phi < PHI[1] + math.radians(5.0)


def test_proposals_run(proposals: list[Proposal]) -> None:
    """The controller holds them."""
    for proposal in proposals:
        hold(proposal.scenario)


def test_proposals_are_ranked_and_differ(proposals: list[Proposal]) -> None:
    """Best first, better than the grasp of the scenario, and by a radius apart at one contact at least."""
    margins = [proposal.margin for proposal in proposals]
    assert len(margins) == 3 and margins == sorted(margins, reverse=True)
    assert margins[0] > 1.2 * grasp_quality(load_scenario("target-a")).margin
    points = [np.array(proposal.scenario.grasp.contact_points) for proposal in proposals]
    for k, one in enumerate(points):
        for other in points[:k]:
            assert np.linalg.norm(one - other, axis=1).max() >= 0.010


def test_the_same_seed_proposes_the_same(proposals: list[Proposal]) -> None:
    """Number by number."""
    again = propose_grasps(load_scenario("target-a", {"object.position": MOVED}), count=3, points=200)
    assert [proposal.section() for proposal in again] == [proposal.section() for proposal in proposals]


def test_the_section_can_be_pasted(proposals: list[Proposal]) -> None:
    """The lines are TOML and the grasp that was found."""
    for proposal in proposals:
        table = tomllib.loads(proposal.section())["grasp"]
        pasted = load_scenario("target-a", {"object.position": MOVED, "grasp": table})
        assert pasted.grasp == proposal.scenario.grasp


@pytest.mark.parametrize("turn", [0.0, 0.2])
def test_two_planar_fingers(turn: float) -> None:
    """Points in the plane of the fingers, the centre of mass above or below their line; the box pitched, too."""
    scenario = load_scenario("pinch", {"object.position": [0.003, 0.0, 0.145], "object.rpy": [0.0, turn, 0.0]})
    for proposal in propose_grasps(scenario, count=2, points=200):
        assert np.abs(np.array(proposal.scenario.grasp.contact_points)[:, 1]).max() < 1e-8
        hold(proposal.scenario)


@pytest.mark.parametrize("name", ["two fingers", "four fingers", "wrist"])
def test_other_hands(name: str, tmp_path: Path) -> None:
    """Two fingers that move in space, four fingers, a joint that moves all of them."""
    scenario = scenario_of(name, tmp_path)
    proposal = propose_grasps(scenario, count=1, points=150)[0]
    hold(proposal.scenario)


def test_an_object_out_of_reach_is_told() -> None:
    """With the finger that reaches nothing."""
    with pytest.raises(GraspError, match=r"finger_1_tip reaches none of \d+ points") as caught:
        propose_grasps(load_scenario("target-a", {"object.position": [0.0, 0.0, 0.5]}), points=50)
    assert caught.value.finger == "finger_1_tip"  # type: ignore[attr-defined]


def test_an_object_too_slippery_is_told() -> None:
    """Points in reach, but nothing holds."""
    with pytest.raises(GraspError, match="no grasp at rest found"):
        propose_grasps(load_scenario("target-a", {"fingertip.friction": 0.02}), points=60)


def test_the_command_proposes(tmp_path: Path) -> None:
    """The list, the lines to paste, and the picture of the best."""
    result = run("pinch", "--propose", "--count", "2", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    for words in ("proposal 2", "[grasp]", "contact_points = [", "joint_guess", "wrote grasp.png"):
        assert words in result.stdout
