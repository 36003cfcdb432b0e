"""Variations of a scenario are what `resolve` makes of the changed scenario, and share nothing that is written to."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hands import BOX_URDF

from softhand.assembly.build import assemble
from softhand.assembly.resolve import Setup, resolve
from softhand.assembly.variations import Variations
from softhand.controllers.regulation import Regulation
from softhand.errors import GraspError, ScenarioError
from softhand.laws.conservative import Conservative
from softhand.scenario.scenario import Scenario, load_scenario

CHANGES: list[dict[str, Any]] = [
    {},
    {"object.mass": 0.3},
    {"object.mass": 0.25, "fingertip.friction": 0.6},
    {"fingertip.friction": np.float64(0.7)},
    {"fingertip.k_r": 4e5, "fingertip.k_psi": 5e7},
    {"fingertip.radius": 0.011},
    {"fingertip.contact": "coulomb", "fingertip.static_friction": 0.8},
    {"fingertip.tips": {"finger_2_tip": {"friction": 0.9, "k_r": 5e5}}},
    {"fingertip": {"law": "conservative", "friction": 0.6, "radius": 0.01}},
    {"fingertip.damping": {"name": "fung", "shares": [0.3], "rates": [2.0]}},
    {"object.position": [0.001, 0.011, 0.141], "object.rpy": [0.02, -0.03, 0.04]},
    {"object.face_friction": {"+x": 0.9}},
    {
        "object.ellipsoid": [0.028, 0.018, 0.03],
        "grasp.contact_points": [[0.028, 0.0, 0.0], [-0.028, 0.0, 0.0], [0.0, -0.018, 0.0]],
    },
    {"object.urdf": str(BOX_URDF)},
    {"grasp.internal_force": (4.5, 4.0, 3.5)},
    {"grasp.contact_points": [[0.028, 0.001, 0.0], [-0.028, 0.0, 0.001], [0.0, -0.018, -0.004]]},
    {"grasp.joint_guess": None},
    {"gravity": (0.3, 0.0, -9.7)},
    {"controller.K_v": 0.006},
    {"controller": {"name": "computed-torque"}},
    {"reference.duration": 0.5, "reference.object_position": [0.0, 0.02, 0.13]},
    {"reference.orientation_path": None},
    {"stepper.step": 0.0005},
    {"stepper.name": "rk4", "duration": 1.0},
    {"push": [{"force": [1.0, 0.0, 0.0], "duration": 0.1}]},
    {"table": {"height": 0.05, "friction": 0.4}},
    {"fingertip.tips_touch": True},
    {"hand.effort_limit": 2.0},
    {"hand.position": [0.0, 0.0, 0.001]},
    {"description": "another"},
]

MISTAKES: list[dict[str, Any]] = [
    {"object.mass": -1.0},
    {"object.mas": 0.3},
    {"fingertip.k_r": "much"},
    {"fingertip.k_phi": None},
    {"fingertip.friction": 0.5, "fingertip.static_friction": 0.3},
    {"grasp.internal_force": [1.0, 2.0]},
    {"controller.K_v": -1.0},
    {"stepper.step": 0.0003},
    {"push": [{"force": [1.0, 0.0], "duration": 0.1}]},
    {"object.position": [0.0, 0.01, 0.23]},
    {"fingertip.friction": 0.1},
    {"object.": 1},
]


@pytest.fixture(scope="module")
def variations() -> Variations:
    """Of target A."""
    return Variations(load_scenario("target-a"))


def in_plain_words(setup: Setup) -> dict[str, Any]:
    """All of a setup that a run depends on, comparable to the last bit."""
    grasp, model = setup.grasp, setup.world.model
    arrays = (grasp.state.q, grasp.state.v, grasp.state.z, grasp.deformation, grasp.force, grasp.angles)
    plant = assemble(setup).plant
    words = [name for name in plant.pads.dtype.names if not name.endswith("_function") and name != "shape_data"]
    return {
        "start": [array.tobytes() for array in (*arrays, grasp.friction_use)],
        "pads": [plant.pads[name].tobytes() for name in words],
        "bodies": setup.world.bodies.tobytes(),
        "inertias": [np.asarray(inertia.toDynamicParameters()).tobytes() for inertia in model.inertias],
        "limits": [np.asarray(limit).tobytes() for limit in (model.upperEffortLimit, model.lowerPositionLimit)],
        "gravity": setup.world.gravity.tobytes(),
        "settings": (setup.controller, setup.reference, setup.stepper),
        "scenario": setup.scenario.to_toml(),
    }


@pytest.mark.parametrize("changes", CHANGES, ids=lambda changes: ",".join(changes) or "none")
def test_a_variation_is_the_changed_scenario_resolved(variations: Variations, changes: dict[str, Any]) -> None:
    """Bit for bit, whatever the keys touch."""
    expected, setup = resolve(variations.scenario.with_values(changes)), variations.at(changes)
    assert in_plain_words(setup) == in_plain_words(expected)
    assert setup.scenario == expected.scenario


@pytest.mark.parametrize("changes", MISTAKES, ids=lambda changes: ",".join(changes))
def test_mistakes_are_told_in_the_same_words(variations: Variations, changes: dict[str, Any]) -> None:
    """An error of a key, of a value, of sections that do not agree or of the start is that of the whole way."""
    with pytest.raises((GraspError, ScenarioError)) as expected:
        resolve(variations.scenario.with_values(changes))
    with pytest.raises(type(expected.value)) as caught:
        variations.at(changes)
    assert str(caught.value) == str(expected.value)
    assert caught.value.__dict__.keys() == expected.value.__dict__.keys()


def test_with_a_law_and_a_controller_of_ones_own() -> None:
    """They stay, whatever the scenario names."""
    scenario = load_scenario("target-a")
    own = Regulation(K_v=0.01), Conservative(radius=0.01)
    varied = Variations(scenario, *own)
    for changes in ({"object.mass": 0.3, "fingertip.friction": 0.6}, {"controller.K_v": 0.02}):
        expected = resolve(scenario.with_values(changes), *own)
        assert in_plain_words(varied.at(changes)) == in_plain_words(expected)


@pytest.mark.parametrize("name", ["can", "prism", "grasp-and-lift", "gripper"])
def test_other_objects_and_starts(name: str) -> None:
    """A curved object, a mesh, open fingers over a table, a gripper."""
    varied = Variations(load_scenario(name))
    changes = {"object.mass": 1.1 * varied.setup.world.object_mass, "fingertip.friction": 0.9}
    assert in_plain_words(varied.at(changes)) == in_plain_words(resolve(varied.scenario.with_values(changes)))


def test_nothing_that_is_written_to_is_shared(variations: Variations) -> None:
    """Neither a model nor a start of one setup belongs to another."""
    one, other = (variations.at({"controller.K_v": 0.006}) for _ in range(2))
    before = in_plain_words(variations.at({"controller.K_v": 0.006}))
    one.world.model.inertias[1] = pin.Inertia.Random()
    one.world.model.gravity.linear = np.zeros(3)
    one.grasp.state.q[:] = 0.0
    one.grasp.deformation[:] = 0.0
    assert in_plain_words(other) == before
    assert in_plain_words(variations.at({"controller.K_v": 0.006})) == before


def test_the_base_is_left_as_it_is(variations: Variations) -> None:
    """Variations do not add up."""
    scenario: Scenario = variations.scenario
    variations.at({"object.mass": 0.5, "gravity": (0.0, 0.0, -1.0)})
    assert in_plain_words(variations.at({})) == in_plain_words(resolve(scenario))
