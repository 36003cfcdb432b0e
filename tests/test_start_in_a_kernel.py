"""The kernel that finds a start, beside the Python that it stands for."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from test_hands import ALLEGRO

import softhand.model.arm
import softhand.start.finger
from softhand.assembly.plant import read_grasp, read_world
from softhand.errors import GraspError
from softhand.laws.law import Law
from softhand.model.arm import Arm
from softhand.plugins import SHIPPED
from softhand.scenario.file import scenario_names
from softhand.scenario.scenario import Scenario, load_scenario, with_law
from softhand.start.grasp import Grasp
from softhand.start.reach import initial_joints

PLAIN = [name for name in scenario_names() if "allegro" not in name]


def by_the_kernel(scenario: Scenario) -> Grasp:
    """The start, where the kernel alone must find it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Arm, "reach_anyhow", lambda *_: pytest.fail("the kernel gave up"))
        patch.setattr(softhand.start.finger, "deform_tip", lambda *_: pytest.fail("the kernel gave up"))
        return read_grasp(scenario, read_world(scenario))[1]


def without_the_kernel(scenario: Scenario) -> Grasp:
    """The start by numeric slopes and pseudo-inverses, in Python."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(softhand.start.finger, "settle", lambda *_: False)
        patch.setattr(softhand.start.finger, "answer_force", lambda *_: False)
        patch.setattr(softhand.model.arm, "reach", lambda *_: math.inf)
        return read_grasp(scenario, read_world(scenario))[1]


def assert_equal(one: Grasp, other: Grasp, of_joints: float = 1e-12) -> None:
    """The same deformation, forces and angles, and joints as near as told."""
    turned = max(1e-12, of_joints)
    for mine, its, atol in (
        (one.deformation[:, 0], other.deformation[:, 0], 1e-15),
        (one.deformation, other.deformation, turned),
        (one.force, other.force, turned),
        (one.angles, other.angles, turned),
        (one.friction_use, other.friction_use, 1e-12),
        (one.state.q, other.state.q, turned),
        (one.state.z, other.state.z, turned),
    ):
        np.testing.assert_allclose(mine, its, rtol=1e-12 if turned < 1e-9 else 1e-7, atol=atol)


def elsewhere(scenario: Scenario, seed: int) -> Scenario:
    """The object a few millimetres and degrees away, squeezed otherwise."""
    rng, held = np.random.default_rng(seed), scenario.object
    return scenario.with_values(
        {
            "object.position": np.array(held.position) + rng.uniform(-3e-3, 3e-3, 3),
            "object.rpy": np.array(held.rpy) + rng.uniform(-0.1, 0.1, 3),
            "grasp.internal_force": np.array(scenario.grasp.internal_force) * rng.uniform(0.9, 1.5),
        }
    )


@pytest.mark.parametrize("name", PLAIN)
def test_shipped_starts_are_found_at_once(name: str) -> None:
    """The kernel finds the start of each scenario, the one that the way through Python finds."""
    scenario = load_scenario(name)
    assert_equal(by_the_kernel(scenario), without_the_kernel(scenario))


@pytest.mark.parametrize("name", SHIPPED["laws"])
def test_each_law_answers_in_the_kernel(name: str) -> None:
    """With each law, with its stiffness or with differences of its force, also elsewhere; the same branch."""
    scenario = load_scenario("target-a", {"fingertip.friction": 1.0})
    scenario = scenario if name == scenario.fingertip.law else with_law(scenario, name)
    for seed in range(3):
        other = elsewhere(scenario, seed)
        assert_equal(by_the_kernel(other), without_the_kernel(other))


@pytest.mark.parametrize("name", ALLEGRO)
def test_redundant_fingers_stay_as_near_the_guess(name: str) -> None:
    """Of all the ways to reach a point both find the one nearest to the guess, as far as a minimum tells."""
    scenario = load_scenario(name)
    assert_equal(by_the_kernel(scenario), without_the_kernel(scenario), of_joints=1e-7)


def test_relaxing_tips_are_pressed_deeper_in_the_kernel() -> None:
    """The share of the force that is left at rest counts."""
    damping = {"name": "fung", "shares": [0.3, 0.2], "rates": [10.0, 1.0]}
    scenario = load_scenario("target-a", {"fingertip.damping": damping})
    assert_equal(by_the_kernel(scenario), without_the_kernel(scenario))
    assert np.all(
        by_the_kernel(scenario).deformation[:, 0] > by_the_kernel(load_scenario("target-a")).deformation[:, 0]
    )


@pytest.mark.parametrize(
    "changes",
    [
        {"object.position": (0.0, 0.010, 0.230)},
        {"object.position": (0.0, 0.010, 0.060)},
        {"grasp.internal_force": (4e5, 4e5, 3e5)},
    ],
)
def test_what_is_refused_is_refused_in_the_same_words(changes: dict[str, tuple[float, ...]]) -> None:
    """Where Newton's iteration finds nothing, the error is that of the other way."""
    scenario = load_scenario("target-a", changes)
    with pytest.raises(GraspError) as expected:
        without_the_kernel(scenario)
    with pytest.raises(GraspError) as caught:
        read_grasp(scenario, read_world(scenario))
    assert str(caught.value) == str(expected.value)


def reached() -> Iterator[tuple[Arm, int, np.ndarray, np.ndarray]]:
    """Points that the fingers of the reference hand can reach, and angles to begin from."""
    world, rng = read_world(load_scenario("target-a")), np.random.default_rng(3)
    arm, guess = Arm(world), initial_joints(world, None)
    lower, upper = arm.limits
    for index in (0, 1, 2) * 10:
        arm.move(lower + (upper - lower) * rng.uniform(0.2, 0.8, world.n_joints))
        yield arm, index, arm.tip(index)[0], guess.copy()


def test_the_chain_is_where_pinocchio_has_it() -> None:
    """The tip that the kernel puts at a point is there in Pinocchio's model as well, and the arm is left so."""
    found = 0
    for arm, index, target, angles in reached():
        gap = arm.reach(index, target, angles)
        found += gap <= 1e-9
        np.testing.assert_allclose(arm.tip(index)[0], target, rtol=0.0, atol=1e-12)
        assert np.all(arm.limits[0] <= angles) and np.all(angles <= arm.limits[1])
    assert found == 30


class Wall(Law):
    """A law that numba cannot compile, and whose answer Python finds all the same."""

    coordinates = "surface"

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius):
        """Springs, by way of an object."""
        return tuple({"k": 1e4}[key] * x for key, x in zip("kkkk", (dr, s1, s2, 1e-4 * psi), strict=True))


def test_a_law_that_cannot_be_compiled_has_a_start() -> None:
    """The start is that of Python; that the law cannot be compiled is told where it must be."""
    scenario = load_scenario("target-a", {"fingertip.friction": 1.0})
    law = Wall(radius=0.01)
    grasp = read_grasp(scenario, read_world(scenario), law)[1]
    np.testing.assert_allclose(grasp.deformation[:, 0], grasp.force[:, 2] / 1e4, rtol=1e-8)
