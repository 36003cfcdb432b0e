"""The worst push: closed form, symmetry, brute force over directions, and random pushes inside and outside."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import run_command
from hands import Array
from numpy.testing import assert_allclose

import softhand
from softhand.holding.between import Between
from softhand.holding.edge import Edge
from softhand.holding.held import held_there, look
from softhand.holding.loads import directions
from softhand.holding.push_record import WorstPush
from softhand.holding.pushed_run import Trial
from softhand.holding.response import linear_reach, response
from softhand.holding.unpushed import unpushed
from softhand.holding.worst_push import pushed_run_of, pushes, worst_push

DAMPED = {"name": "kelvin-voigt", "radial": 1.0, "tangential": 1.0, "torsional": 1e-4}


def damped(name: str = "target-a", **values: Any) -> softhand.Scenario:
    """A scenario of damped tips that can slip."""
    return softhand.load_scenario(name).replace({"fingertip.contact": "coulomb", "fingertip.damping": DAMPED, **values})


@cache
def worst(name: str = "target-a", kind: Any = "force", profile: Any = "ramp") -> WorstPush:
    return worst_push(damped(name), kind, profile)


def ways(count: int, seed: int = 0) -> Array:
    rows = np.random.default_rng(seed).normal(size=(count, 3))
    found: Array = rows / np.linalg.norm(rows, axis=1)[:, None]
    return found


# ------------------------------------------------------------------------------------------------- linear answer


def test_the_answer_balances_the_push() -> None:
    """Of a stiff gripper G R = -1 along its slides, but for what the object moves."""
    start = look(softhand.load_scenario("gripper"))
    held, (force, torsion) = held_there(start), response(start)
    assert_allclose((held.force_map @ force + held.torsion_map @ torsion)[[0, 2], [0, 2]], [-1.0, -1.0], atol=0.01)


def test_along_the_line_of_two_tips_the_linear_bound_is_closed_form() -> None:
    """A push of F against the weight's direction is shared by halves: (m g + F) / 2 = mu f_z of a pinch."""
    start = look(softhand.load_scenario("pinch"))
    held = held_there(start)
    bound = linear_reach(held, response(start), np.array([[0.0, 0.0, -1.0, 0.0, 0.0, 0.0]]))
    pressing = held.force[2]
    assert_allclose(bound[0], 2.0 * 0.5 * pressing - held.mass * 9.81, rtol=2e-2)


# ------------------------------------------------------------------------------------------------- in simulation


def test_a_push_of_the_table_is_survived_and_a_larger_one_is_not() -> None:
    """Each of ten directions again: its size holds, 1.2 times it is lost."""
    found = worst()
    some = np.linspace(0, len(found.sizes) - 1, 10).astype(int)
    scenario = damped()
    assert not np.any(pushes(scenario, found.directions[some], found.sizes[some]))
    assert np.mean(pushes(scenario, found.directions[some], 1.2 * found.sizes[some])) >= 0.9


def test_the_worst_is_near_the_linear_bound_and_not_above_what_was_tried() -> None:
    """At this grasp within a quarter; the worst is the least of all."""
    found = worst()
    assert found.worst == np.min(found.sizes)
    assert 0.75 * np.min(found.linear) < found.worst < 1.1 * np.min(found.linear)


def test_a_mirrored_grasp_has_mirrored_pushes() -> None:
    """The pinch is its own mirror in x: pushes along +x and -x, and about the weight, are survived alike."""
    found = worst("pinch")
    for way, size in zip(found.directions[:12], found.sizes[:12], strict=True):
        mirror = np.argmin(np.linalg.norm(found.directions - way * [-1.0, 1.0, 1.0], axis=1))
        assert_allclose(found.sizes[mirror], size, rtol=0.2)


def test_a_step_is_worse_than_a_ramp() -> None:
    """The object overshoots."""
    assert worst(profile="step").worst < 0.9 * worst().worst


def test_mass_and_friction() -> None:
    """The least friction is mu times the use of the start; a mass beyond the range is lost by a push of its weight."""
    found, scenario = worst(), damped()
    use = held_there(look(scenario)).limit_use.max()
    assert_allclose(found.friction[0], [0.5 * use, 0.5], rtol=1e-9)
    down = np.array([[0.0, 0.0, -1.0]])
    extra = 9.81 * (found.mass[1] - found.mass_known)
    assert not np.any(pushes(scenario, down, np.array([extra])))
    assert np.all(pushes(scenario, down, np.array([1.25 * extra])))
    assert found.mass[0] < 0.2 < found.mass[1]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["force", "moment"])
def test_inside_none_is_lost_and_outside_some_are(kind: Any) -> None:
    """400 pushes of any direction and any size up to 97 % of the worst; and 200 of 1.15 times it."""
    found, rng = worst(kind=kind), np.random.default_rng(7)
    sizes = 0.97 * found.worst * rng.uniform(0.0, 1.0, 400) ** (1.0 / 3.0)
    assert not np.any(pushes(damped(), ways(400, 1), sizes, kind))
    assert np.any(pushes(damped(), ways(200, 2), np.full(200, 1.15 * found.worst), kind))


@pytest.mark.slow
def test_brute_force_over_directions_finds_none_that_is_worse() -> None:
    """162 directions at 97 % of the worst of 42."""
    finer = worst_push(damped(), count=162)
    assert finer.worst > 0.95 * worst().worst


@pytest.mark.long
@pytest.mark.parametrize(("kind", "profile"), [("force", "ramp"), ("moment", "ramp"), ("force", "step")])
def test_of_ten_thousand_inside_none_is_lost_and_just_outside_some_are(kind: Any, profile: Any) -> None:
    """Random directions: sizes up to 97 % of the worst, as if drawn from the ball; and 1000 of 105 % of it."""
    found, rng = worst(kind=kind, profile=profile), np.random.default_rng(11)
    sizes = 0.97 * found.worst * rng.uniform(0.0, 1.0, 10_000) ** (1.0 / 3.0)
    inside = pushes(damped(), ways(10_000, 100), sizes, kind, profile)
    outside = pushes(damped(), ways(1000, 101), np.full(1000, 1.05 * found.worst), kind, profile)
    print(f"{kind}, {profile}: {found.worst:.4g}; lost {np.sum(inside)} inside, {np.sum(outside)} of 1000 outside")
    assert not np.any(inside), (sizes[inside] / found.worst, ways(10_000, 100)[inside])
    assert np.any(outside)


# -------------------------------------------------------------------------------------------------------- the search


@pytest.mark.parametrize("first", [0.3, 2.9, 3.1, 40.0])
@pytest.mark.parametrize("lag", [0.0, 0.3])
def test_an_edge_is_found_from_anywhere(first: float, lag: float) -> None:
    """Of a made-up grasp that loses at 3 N: below is survived, above is lost, and no more than 2 % between them.

    One that answers late has borne more by the time that it is lost than it survives.
    """

    def push(size: float) -> Trial:
        use = 0.4 + 0.6 * (size / 3.0) ** 2
        return Trial("slips", min(3.0 * (1.0 + lag) / size, 1.0), 1.0, 0.5) if size >= 3.0 else Trial("", 1.0, use, 0.9)

    edge = Edge(0.4)
    edge.find(push, first)
    assert 0.84 * 3.0 < edge.low < 3.0 <= edge.high and edge.end == "slips"
    edge.close(push, 0.02)
    assert edge.low < 3.0 <= edge.high and 3.0 - edge.low < 0.061


def test_a_push_that_nothing_ends_and_one_that_nothing_survives() -> None:
    """No end is told where there was none, no size where none held; and neither search hangs."""
    endless, hopeless = Edge(0.4), Edge(0.4)
    endless.find(lambda size: Trial("", 1.0, 0.4, 0.9), 1.0)
    endless.close(lambda size: Trial("", 1.0, 0.4, 0.9), 0.02)
    hopeless.find(lambda size: Trial("slips", 0.0, 1.0, 0.0), 1.0)
    hopeless.close(lambda size: Trial("slips", 0.0, 1.0, 0.0), 0.02)
    assert endless.low > 1.0 and endless.end == "" and hopeless.low == 0.0 and hopeless.end == "slips"


def test_worse_directions_are_looked_for_where_they_are() -> None:
    """Edges 0.8 times a bound that is least along w, told of 42 directions: the first that is tried is within 9 deg."""
    w = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
    between, known = Between(lambda some: 2.0 - some @ w), directions(1)
    edges = 0.8 * (2.0 - known @ w)
    assert between.worst(known, edges, 0.9, 4)[0] @ w > np.cos(np.radians(9.0))
    assert len(between.worst(known, edges, 0.79, 4)) == 0
    some = ways(50)
    assert_allclose(between.promised(some, known, edges), 0.8 * (2.0 - some @ w), rtol=1e-12)


def test_a_run_that_is_pushed_again_is_as_if_new() -> None:
    """After others, which were lost, and in Python's rollout of one run: the same to the last bit."""
    made = pushed_run_of(unpushed(softhand.load_scenario("target-a")), "force", "ramp")
    run, other = made(lambda: False), made(lambda: False)
    pushes_ = [np.array([0.3, 0.5, -0.4]), np.array([4.0, 3.0, -6.0]), np.array([0.3, 0.5, -0.4])]
    first, lost, again = map(run.push, pushes_)
    assert first == again and lost.end and not first.end
    assert other._push_in_python(pushes_[0]) == first
    there = other._push_in_python(pushes_[1])
    assert (there.end, there.share, there.time) == (lost.end, lost.share, lost.time)


def test_directions_that_are_asked_for(tmp_path: Path) -> None:
    """The first rows, of length one; as far as a push along them is survived."""
    found = worst_push(damped(), count=12, along=[[0.0, 2.0, -2.0], [1e300, 0.0, 0.0]])
    assert_allclose(found.directions[:2], [[0.0, 0.5**0.5, -(0.5**0.5)], [1.0, 0.0, 0.0]], atol=1e-15)
    assert found.along == 2 and found.rows()[1][0] == "along (0.00, 0.71, -0.71)"
    assert not np.any(pushes(damped(), found.directions[:2], found.sizes[:2]))
    assert np.all(pushes(damped(), found.directions[:2], 1.1 * found.sizes[:2]))


def test_a_controller_with_a_sum_is_pushed_without_a_linear_answer() -> None:
    """finger-only has no torque at rest that its state alone tells."""
    found = worst_push(softhand.load_scenario("finger-only"), count=12)
    assert np.all(np.isnan(found.linear)) and found.worst > 0.5
    assert ("worst by the linear answer", "none: the torque of finger-only depends on a sum over time") in found.rows()


def test_the_least_friction_is_the_edge_in_simulation() -> None:
    """The damped start holds, pushed with nothing, with 1.03 times that mu, and not with 0.97 times it."""
    least = float(worst().friction[0, 0])
    nothing = np.array([[0.0, 0.0, 1.0]]), np.array([1e-9])
    assert not np.any(pushes(damped(**{"fingertip.friction": 1.03 * least}), *nothing))
    with pytest.raises(softhand.GraspError, match=r"times (its limit surface|the available friction)"):
        pushes(damped(**{"fingertip.friction": 0.97 * least}), *nothing)


# ----------------------------------------------------------------------------------------------------------- refused


def test_mistakes_are_told(tmp_path: Path) -> None:
    """Unknown kinds, open tips, a start that slips, a count that is none."""
    scenario = softhand.load_scenario("pinch")
    with pytest.raises(softhand.ScenarioError, match=r"kind: got 'forces'; .*did you mean 'force'"):
        worst_push(scenario, "forces")  # type: ignore[arg-type]
    with pytest.raises(softhand.ScenarioError, match="count: got 13; allowed are 12, 42, 162"):
        worst_push(scenario, count=13)
    with pytest.raises(softhand.ScenarioError, match=r"profile: got 'steps'"):
        worst_push(scenario, profile="steps")  # type: ignore[arg-type]
    for along in ([[0.0, 0.0, 0.0]], [[np.nan, 0.0, 1.0]], [[np.inf, 0.0, 1.0]], [[1.0, 2.0]], [1.0, 2.0, 3.0], "up"):
        with pytest.raises(softhand.ScenarioError, match="along: got"):
            worst_push(scenario, along=along)  # type: ignore[arg-type]
    with pytest.raises(softhand.ScenarioError, match="threads: got 0"):
        worst_push(scenario, threads=0)
    with pytest.raises(softhand.GraspError, match="not pressing on the object"):
        worst_push(softhand.load_scenario("grasp-and-lift"))
    for changes, told in (
        ({"fingertip.friction": 0.2}, "times the available friction"),
        ({"controller.K_N": 50.0}, "does not hold without any push: finger_._tip rolls over its rim"),
        ({"controller.period": 0.02}, "does not last without any push: finger_._tip slips at t ="),
    ):
        with pytest.raises(softhand.GraspError, match=told):
            worst_push(softhand.load_scenario("target-a", changes), count=12)
    refused = run_command("push", "grasp-and-lift", folder=tmp_path)
    assert refused.returncode == 1 and "not pressing on the object at the start" in refused.errors


def test_the_command_draws_and_prints(tmp_path: Path) -> None:
    """A table, a figure, JSON with units."""
    told = run_command("push", "gripper", "--count", "12", "--json", "--out", "a.png", folder=tmp_path)
    assert told.returncode == 0, told.stderr
    found = json.loads(told.stdout)
    assert found["worst"] > 1.0 and found["units"]["worst"] == "N or N m"
    assert (tmp_path / "a.png").stat().st_size > 10_000
    refused = run_command("push", "gripper", "--along", "0,0,0", folder=tmp_path)
    assert refused.returncode == 1 and "along: got [0.0, 0.0, 0.0]" in refused.errors
