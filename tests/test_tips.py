"""Tips that differ: their own law, coefficients and damping, and friction by the face of the box."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest

from softhand import Recording, build, load_scenario
from softhand.analysis.energy import energy_ledger
from softhand.assembly.parts import read_face_friction, read_laws
from softhand.assembly.probe import Probe
from softhand.checks.scenario import check_scenario
from softhand.contact.friction import face_of
from softhand.errors import ScenarioError
from softhand.grasping.poses import Poses
from softhand.margins.loop import close_loop
from softhand.margins.place import find_place
from softhand.numerics.spatial import rotation_of
from softhand.scenario.bodies import FACES
from softhand.scenario.scenario import Scenario, with_law
from softhand.settings.settings import read_settings
from softhand.studies.compare import compare

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

MIXED: dict[str, Any] = {
    "finger_1_tip": {"friction": 0.8, "static_friction": 0.9, "torsion_length": 0.002},
    "finger_2_tip": {"law": "hertz", "E": 0.5e6, "radius": 0.012, "damping": {"name": "fung"}},
}
COULOMB = {"fingertip.contact": "coulomb", "duration": 0.1}


def mixed(values: dict[str, Any] | None = None) -> Scenario:
    return load_scenario("target-a", {"fingertip.tips": MIXED, **COULOMB, **(values or {})})


def test_each_tip_has_its_own_keys_over_those_of_all() -> None:
    """A tip's table replaces single keys; another law begins from its own defaults, but keeps the radius."""
    plant = build(mixed({"fingertip.damping": {"name": "kelvin-voigt"}})).plant
    one, two, three = plant.fingertips
    assert [type(tip.law).__name__ for tip in plant.fingertips] == ["Nakashima", "Hertz", "Nakashima"]
    assert one.law == three.law and (one.friction, one.static_friction, one.torsion_length) == (0.8, 0.9, 0.002)
    assert (three.friction, three.static_friction, three.torsion_length) == (0.5, None, None)
    assert (two.law.radius, two.law.E, two.law.nu) == (0.012, 0.5e6, 0.5)
    assert [type(tip.damping).__name__ for tip in plant.fingertips] == ["KelvinVoigt", "Fung", "KelvinVoigt"]
    hertz = load_scenario("target-a", {"fingertip.tips": {"finger_3_tip": {"law": "hertz"}}})
    assert read_laws(hertz)[2].radius == 0.010


def test_a_run_is_repeated_from_its_own_scenario() -> None:
    """Tables of tips and faces are written out with all defaults, and read back to the same numbers."""
    simulation = build(mixed({"object.face_friction": {"-y": 0.7}}))
    table = tomllib.loads(simulation.scenario)
    assert table["fingertip"]["tips"]["finger_2_tip"]["nu"] == 0.5
    first, again = simulation.run(), build(read_settings(Scenario, table, "")).run()
    for name, values in first.variables.items():
        np.testing.assert_array_equal(values, again[name])


@pytest.mark.parametrize("contact", ["rolling", "coulomb"])
def test_friction_use_is_by_the_friction_of_the_tip_and_the_face(contact: str) -> None:
    """|f_t| / (mu f_z) with mu of the tip, or that of the face that it lies on, in both kinds of contact."""
    values = {"fingertip.contact": contact, "object.face_friction": {"-y": 0.7, "+z": 0.1}}
    simulation = build(mixed(values))
    recording = simulation.run()
    force = recording.contact_force
    mu = np.array([0.8, 0.5, 0.7])  # finger 3 presses on -y
    np.testing.assert_allclose(
        recording.friction_use, np.hypot(force[..., 0], force[..., 1]) / (mu * force[..., 2]), rtol=1e-12
    )
    np.testing.assert_allclose(simulation.plant.contacts["static_friction"], [0.9, 0.5, 0.7])


def test_a_face_keeps_the_ratio_of_static_and_kinetic_friction() -> None:
    """With its own mu, a face lowers or raises both."""
    plant = build(mixed({"object.face_friction": {"+x": 0.4}})).plant
    assert plant.contacts["friction"][0] == 0.4
    assert plant.contacts["static_friction"][0] == pytest.approx(0.4 * 0.9 / 0.8, rel=1e-15)


def test_the_face_is_that_of_the_dominating_axis() -> None:
    """Over an edge or a vertex the largest component of the normal along the axes of the box decides."""
    axes = rotation_of((0.3, -0.7, 1.1))
    for k, name in enumerate(FACES):
        normal = (1.0 if name[0] == "+" else -1.0) * axes[:, "xyz".index(name[1])]
        assert face_of(axes, normal) == k
        assert face_of(axes, normal + 0.9 * axes[:, ("xyz".index(name[1]) + 1) % 3]) == k


def test_a_slippery_face_slips_and_a_slippery_tip_too() -> None:
    """Only the tip that lies on it, or has it, slips, and is held by that coefficient."""
    for values, finger in (
        ({"object.face_friction": {"-y": 0.3}}, 2),
        ({"fingertip.tips": {"finger_2_tip": {"friction": 0.3}}}, 1),
    ):
        start = {"grasp.internal_force": (8.0, 8.0, 8.0), "reference.internal_force": (8.0, 8.0, 8.0)}
        values = {**COULOMB, "duration": 0.6, **start, "fingertip.friction": 1.0, **values}
        recording = build(load_scenario("target-a", values)).run()
        assert np.flatnonzero(recording.slip_travel[-1]).tolist() == [finger]
        force = recording.contact_force[:, finger]
        assert np.max(np.hypot(force[:, 0], force[:, 1]) / force[:, 2]) < 0.3 + 1e-12


def test_the_start_is_refused_by_the_friction_of_the_face() -> None:
    """The start needs 0.36 of the normal force at finger 1."""
    with pytest.raises(Exception, match=r"finger_1_tip: the start needs .*mu = 0\.3"):
        build(load_scenario("target-a", {"object.face_friction": {"+x": 0.3}}))


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"fingertip.tips": {"finger_1_tp": {}}}, 'no fingertip. Did you mean "finger_1_tip"'),
        ({"fingertip.tips": {"finger_1_tip": {"friction": -1.0}}}, "finger_1_tip.friction: got -1"),
        ({"fingertip.tips": {"finger_1_tip": 3}}, "finger_1_tip: got 3"),
        (
            {"fingertip.tips": {"finger_1_tip": {"law": "herz"}}},
            'tips.finger_1_tip.law: no law .* Did you mean "hertz"',
        ),
        ({"fingertip.tips": {"finger_1_tip": {"k_rr": 1.0}}}, "tips.finger_1_tip.k_rr: unknown key"),
        ({"fingertip.static_friction": 0.6, "fingertip.tips": {"finger_1_tip": {"friction": 0.7}}}, "0.6 is below"),
        ({"object.face_friction": {"+X": 0.5}}, r'"\+X" is no face. Did you mean "\+x"'),
        ({"object.face_friction": {"+x": 0.0}}, r'"\+x" must be a number > 0'),
    ],
)
def test_wrong_tips_and_faces_are_named(values: dict[str, Any], words: str) -> None:
    """One clear error with the table, and near matches."""
    with pytest.raises(ScenarioError, match=words):
        build(load_scenario("target-a", values))


def test_only_a_box_has_faces_with_friction() -> None:
    """Any other shape is refused by name; without the key all shapes will do."""

    class Sphere:
        pass

    with pytest.raises(ScenarioError, match=r"only a box has faces .* sphere"):
        read_face_friction(load_scenario("target-a", {"object.face_friction": {"+x": 0.7}}), Sphere())
    assert read_face_friction(load_scenario("target-a"), Sphere()) == ()


def test_another_law_is_that_of_all_tips() -> None:
    """with_law and compare: one law everywhere, while friction, radius and damping of each tip stay."""
    scenario = with_law(mixed(), "radial")
    plant = build(scenario).plant
    assert [type(tip.law).__name__ for tip in plant.fingertips] == ["Radial"] * 3
    assert [tip.friction for tip in plant.fingertips] == [0.8, 0.5, 0.5]
    assert [tip.law.radius for tip in plant.fingertips] == [0.010, 0.012, 0.010]
    assert type(plant.fingertips[1].damping).__name__ == "Fung" and plant.can_slip
    own, other = compare(mixed(), laws=["nakashima", "radial"])
    assert own.recording is not None and other.recording is not None
    assert "finger_2_tip" in own.recording.scenario and "hertz" in own.recording.scenario
    assert "hertz" not in other.recording.scenario and 'contact = "coulomb"' in other.recording.scenario


def test_tools_take_each_tip_as_it_is() -> None:
    """Ledger, probe, loop and workspace read the laws of the scenario tip by tip."""
    scenario = mixed({"fingertip.contact": "rolling"})
    simulation = build(scenario)
    recording: Recording = simulation.run()
    assert energy_ledger(recording).residual[-1] == energy_ledger(recording, simulation.plant).residual[-1]
    assert Probe.of_scenario(scenario).laws == [tip.law for tip in simulation.plant.fingertips]
    same = load_scenario("target-a")
    assert close_loop(find_place(scenario)).growth != close_loop(find_place(same)).growth
    np.testing.assert_array_equal(Poses(scenario).fingers.radius, [0.010, 0.012, 0.010])


def test_the_check_up_shows_what_holds_at_each_tip() -> None:
    """Law, coefficients and damping, with units of the keys in the tables of tips."""
    checkup = check_scenario(mixed({"object.face_friction": {"-y": 0.7}}))
    start = dict(checkup.start)
    assert "Nakashima" in start["finger_1_tip, material"] and "mu 0.8, 0.9 until" in start["finger_1_tip, material"]
    assert "Hertz" in start["finger_2_tip, material"] and "Fung" in start["finger_2_tip, material"]
    assert "mu 0.7 (0.7 on -y)" in start["finger_3_tip, material"]
    assert ("fingertip.tips.finger_2_tip.radius", "0.012", "m") in checkup.values
