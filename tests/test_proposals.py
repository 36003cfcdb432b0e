"""Proposed grasps: they hold, they run, they are the same each time."""

from __future__ import annotations

import math
from itertools import islice, pairwise, product
from pathlib import Path

import numpy as np
import pytest
from commands import run_command
from hands import FINGER_GUESS
from test_grasp_quality import scenario_of

from softhand.assembly.build import simulate
from softhand.assembly.plant import read_world
from softhand.errors import GraspError
from softhand.grasping import proposals as proposing
from softhand.grasping.chains import finger_chain, tip_position
from softhand.grasping.combinations import Combinations
from softhand.grasping.inverse import approach
from softhand.grasping.places import PHI, PRESSING, RESERVE, PlaceFinder
from softhand.grasping.proposals import USE, Proposals, propose_grasps
from softhand.grasping.quality import grasp_quality
from softhand.grasping.refinement import refine
from softhand.grasping.situation import situation_of
from softhand.model.world import own_columns
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
    return gap, angles, tip_position(links, angles), (lower, upper)


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
def proposals() -> Proposals:
    """For the reference hand, the box a little off its place."""
    return propose_grasps(load_scenario("target-a", {"object.position": MOVED}), count=3, points=200)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """No more grasps are refined than are asked for."""
    monkeypatch.setattr(proposing, "_FEW", 1)


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


def test_proposals_are_grasps_at_rest(proposals: Proposals) -> None:
    """Each as its own scenario has the figures that it promises."""
    for proposal in proposals:
        found = grasp_quality(proposal.scenario)
        assert found.refusal is None and found.margin == pytest.approx(proposal.margin, rel=1e-12)
        for finger in found.fingers:
            assert finger.friction_use < USE + 0.02 and finger.force[2] > PRESSING - 1e-6
            assert finger.reserve.min() > 0.9 * RESERVE
            assert PHI[0] - math.radians(5.0) < finger.Phi < PHI[1] + math.radians(5.0)


def test_proposals_run(proposals: Proposals) -> None:
    """The controller holds them."""
    for proposal in proposals:
        hold(proposal.scenario)


def test_proposals_are_ranked_and_differ(proposals: Proposals) -> None:
    """Best first, better than the grasp of the scenario, and by a radius apart at one contact at least."""
    margins = [proposal.margin for proposal in proposals]
    assert len(margins) == 3 and margins == sorted(margins, reverse=True)
    assert margins[0] > 1.2 * grasp_quality(load_scenario("target-a")).margin
    points = [np.array(proposal.scenario.grasp.contact_points) for proposal in proposals]
    for k, one in enumerate(points):
        for other in points[:k]:
            assert np.linalg.norm(one - other, axis=1).max() >= 0.010


def test_the_same_seed_proposes_the_same(quick: None) -> None:
    """Number by number; another one may draw other combinations."""
    scenario = load_scenario("target-a", {"object.position": MOVED})
    one, other = (propose_grasps(scenario, count=1, points=80, seed=4) for _ in range(2))
    assert one[0].section() == other[0].section()


def test_the_section_can_be_pasted(proposals: Proposals) -> None:
    """The lines are TOML and the grasp that was found."""
    for proposal in proposals:
        table = tomllib.loads(proposal.section())["grasp"]
        pasted = load_scenario("target-a", {"object.position": MOVED, "grasp": table})
        assert pasted.grasp == proposal.scenario.grasp


@pytest.mark.parametrize("turn", [0.0, 0.2])
def test_two_planar_fingers(turn: float, quick: None) -> None:
    """Points in the plane of the fingers, the centre of mass above or below their line; the box pitched, too."""
    scenario = load_scenario("pinch", {"object.position": [0.003, 0.0, 0.145], "object.rpy": [0.0, turn, 0.0]})
    for proposal in propose_grasps(scenario, count=2, points=200):
        assert np.abs(np.array(proposal.scenario.grasp.contact_points)[:, 1]).max() < 1e-8
        hold(proposal.scenario)


@pytest.mark.parametrize("name", ["two fingers", "four fingers", "wrist"])
def test_other_hands(name: str, tmp_path: Path, quick: None) -> None:
    """Two fingers that move in space, four fingers, a joint that moves all of them."""
    scenario = scenario_of(name, tmp_path)
    proposal = propose_grasps(scenario, count=1, points=150)[0]
    hold(proposal.scenario)


def test_an_object_out_of_reach_is_told() -> None:
    """With the finger that reaches nothing."""
    with pytest.raises(GraspError, match=r"finger_1_tip .*reach none of \d+ points") as caught:
        propose_grasps(load_scenario("target-a", {"object.position": [0.0, 0.0, 0.5]}), points=50)
    assert caught.value.finger == "finger_1_tip"  # type: ignore[attr-defined]


def test_an_object_too_slippery_is_told() -> None:
    """Points in reach, but nothing holds."""
    with pytest.raises(GraspError, match="no grasp at rest found"):
        propose_grasps(load_scenario("target-a", {"fingertip.friction": 0.02}), points=60)


def test_the_command_proposes(tmp_path: Path, quick: None) -> None:
    """The list, the lines to paste, and the picture of the best."""
    result = run_command("grasp", "pinch", "--propose", "--count", "2", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    for words in ("proposal 2", "[grasp]", "contact_points = [", "joint_guess", "wrote runs/grasp-pinch/grasp.png"):
        assert words in result.stdout


def test_open_fingers_get_proposals(quick: None) -> None:
    """Judged with the fingers closed, pasted with the fingers open: it stays open and says what to squeeze with."""
    scenario = load_scenario("grasp-and-lift")
    proposal = propose_grasps(scenario, count=1, points=150)[0]
    grasp = proposal.scenario.grasp
    assert (grasp.opening, set(grasp.internal_force)) == (scenario.grasp.opening, {0.0})
    assert proposal.margin > 0.1 and proposal.internal_force.max() > 0.3 and proposal.quality.opening == 0.0
    table = tomllib.loads(proposal.section())["grasp"]
    assert load_scenario("grasp-and-lift", {"grasp": table}).grasp == grasp
    assert grasp_quality(proposal.scenario).refusal is None


# ------------------------------------------------------------------------------------------------ none better is missed


def own_margin(scenario: Scenario) -> float:
    """Margin of the contact points of a scenario under all that is asked of a proposal."""
    here = situation_of(scenario, read_world(scenario))
    finder = PlaceFinder(here, 60)
    places = []
    for i, point in enumerate(scenario.grasp.contact_points):
        place = finder.place(i, *here.shape.nearest(point), finder.start[own_columns(here.world, i)])
        assert place is not None
        places.append(place)
    solved = proposing._Solver(here, finder).solve(tuple(places))
    assert solved is not None
    return solved.margin


@pytest.mark.parametrize(
    "name",
    [
        "target-a",
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("can", "prism", "ball")),
        "pinch",
        "gripper",
    ],
)
def test_no_grasp_that_ships_is_better_than_the_proposal(name: str) -> None:
    """The points of each scenario, under the conditions of a proposal, are at most one per cent better."""
    scenario = load_scenario(name)
    assert own_margin(scenario) <= 1.01 * propose_grasps(scenario, count=1)[0].margin


@pytest.fixture(scope="module")
def combinations() -> tuple[Combinations, PlaceFinder]:
    """Of the can, where it stands a little askew: no symmetry is left."""
    scenario = load_scenario("can", {"object.rpy": [0.1, -0.15, 0.3], "object.position": [0.002, 0.008, 0.143]})
    here = situation_of(scenario, read_world(scenario))
    finder = PlaceFinder(here, 60)
    torsions = [tip.torsion(depth) for tip, depth in zip(here.materials, finder.depths, strict=True)]
    return Combinations(here, [finder.places(i) for i in range(3)], torsions, 2.0 * finder.radius), finder


def test_the_best_combination_comes_first(combinations: tuple[Combinations, PlaceFinder]) -> None:
    """The first ones have the largest margins of all that keep the fingers apart, in order."""
    found, _ = combinations
    kept = [
        choice for choice in product(*found.places)
        if all(found.keep_apart(one, other) for one, other in pairwise((*choice, choice[0])))
    ]  # fmt: skip
    assert len(kept) > 100
    margins = sorted((found.margin(choice)[0] for choice in kept), reverse=True)
    first = [found.margin(choice)[0] for choice in islice(found.best_first(np.random.default_rng(0)), 5)]
    np.testing.assert_allclose(first, margins[:5], rtol=2e-3)


def test_refined_contacts_are_better_and_keep_the_conditions(combinations: tuple[Combinations, PlaceFinder]) -> None:
    """From the best combination: a larger margin, on the surface, with room, in reach, the fingers apart."""
    found, finder = combinations
    choice = next(found.best_first(np.random.default_rng(0)))
    better = refine(choice, found, finder)
    assert found.margin(better)[0] > 1.02 * found.margin(choice)[0]
    for i, place in enumerate(better):
        point, normal = finder.here.shape.nearest(place.point)
        assert point == pytest.approx(place.point, abs=1e-9) and finder.has_room(point, normal)
        links, _ = finger_chain(finder.here.world, i, finder.start)
        tip = finder.here.to_object(tip_position(links, place.angles))
        radius, depth = finder.here.materials[i].law.radius, finder.depths[i]
        assert tip == pytest.approx(point + (radius - depth) * normal, abs=1e-8)
    assert all(found.keep_apart(one, other) for one, other in pairwise((*better, better[0])))
