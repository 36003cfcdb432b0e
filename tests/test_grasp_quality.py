"""The figures of a grasp at its start, with and without one at rest."""

from __future__ import annotations

import math
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import run_command
from hands import (
    CONTACT_POINTS,
    FINGER_GUESS,
    LAYOUTS,
    REFERENCE,
    holding_torque,
    reference_task,
    write_box,
    write_hand,
)

import softhand
from softhand.assembly.build import build
from softhand.assembly.plant import read_world
from softhand.errors import GraspError, ScenarioError
from softhand.grasping.quality import GraspQuality, grasp_quality
from softhand.model.arm import Arm
from softhand.plots.grasp import draw_grasp
from softhand.scenario.scenario import Scenario, load_scenario

WEIGHT = 0.2 * 9.81  # [N]


def quality(name: str = "target-a", **changes: Any) -> GraspQuality:
    return grasp_quality(load_scenario(name, {key.replace("__", "."): value for key, value in changes.items()}))


def scenario_of(name: str, folder: Path) -> Scenario:
    """A hand of `LAYOUTS` as a scenario."""
    layout = LAYOUTS[name]
    hand = write_hand(folder, layout.bases, wrist=layout.wrist is not None, continuous=layout.continuous)
    guess = [*([] if layout.wrist is None else [layout.wrist]), *np.tile(FINGER_GUESS, len(layout.bases)).tolist()]
    return load_scenario(
        "target-a",
        {
            "hand": {"urdf": str(hand), "tips": [f"finger_{k + 1}_tip" for k in range(len(layout.bases))]},
            "object": {"urdf": str(write_box(folder)), "position": layout.position, "rpy": [0.0, 0.0, 0.0]},
            "grasp.contact_points": layout.contact_points,
            "grasp.internal_force": layout.internal_force,
            "grasp.joint_guess": guess,
            "reference.internal_force": layout.internal_force,
        },
    )


# ------------------------------------------------------------------------------------------------- a grasp at rest


def test_the_figures_are_those_of_the_grasp_at_rest() -> None:
    """Deformation, angles, forces and joints as `solve_grasp` finds them."""
    found, task = quality(), reference_task()
    assert found.refusal is None
    for k, finger in enumerate(found.fingers):
        assert finger.missing == 0.0
        assert finger.depth == pytest.approx(task.grasp.deformation[k, 0], rel=1e-9)
        assert finger.Phi == pytest.approx(task.grasp.angles[k, 1], rel=1e-9)
        assert finger.force[2] == pytest.approx(task.grasp.force[k, 2], rel=1e-9)
        assert finger.friction_use == pytest.approx(task.grasp.friction_use[k], rel=1e-9)
        assert finger.limit_surface_use == pytest.approx(finger.friction_use, rel=1e-9)  # no torsion at the start
        np.testing.assert_allclose(finger.angles, task.grasp.state.q[3 * k : 3 * k + 3], atol=1e-12)


def test_the_torques_hold_hand_and_object() -> None:
    """With these torques nothing moves."""
    task = reference_task()
    torque = np.concatenate([finger.torque for finger in quality().fingers])
    np.testing.assert_allclose(torque, holding_torque(task.plant(), task.grasp.state), atol=1e-9)
    use = np.concatenate([finger.torque_use for finger in quality().fingers])
    np.testing.assert_allclose(use, np.abs(torque) / 2.0, rtol=1e-12)


def test_the_forces_carry_the_weight() -> None:
    """On the object, in the world: together they are its weight upwards, without moment about the centre of mass."""
    found = quality()
    np.testing.assert_allclose(found.forces.sum(axis=0), [0.0, 0.0, WEIGHT], atol=1e-9)
    np.testing.assert_allclose(np.cross(found.contacts.points, found.forces).sum(axis=0), 0.0, atol=1e-9)
    assert np.all(np.einsum("ir,ir->i", found.contacts.normals, found.forces) > 0.0)


def test_the_reserve_is_the_way_to_the_nearer_limit() -> None:
    """Of each joint of the reference hand."""
    lower, upper = np.array([-1.05, -1.75, -0.1]), np.array([1.05, 1.05, 2.6])
    for finger in quality().fingers:
        np.testing.assert_allclose(finger.reserve, np.minimum(finger.angles - lower, upper - finger.angles))


def test_the_speeds_are_those_of_the_tip() -> None:
    """The Jacobian by differences has these singular values; their product is the manipulability."""
    scenario = load_scenario("target-a")
    found, world = grasp_quality(scenario), read_world(scenario)
    arm, angles = Arm(world), np.concatenate([finger.angles for finger in found.fingers])

    def tip(moved: np.ndarray) -> np.ndarray:
        arm.move(moved)
        return arm.tip(1)[0]

    steps = 1e-6 * np.eye(9)[3:6]
    J = np.column_stack([(tip(angles + step) - tip(angles - step)) / 2e-6 for step in steps])
    np.testing.assert_allclose(found.fingers[1].speeds, np.linalg.svd(J, compute_uv=False), rtol=1e-6)
    assert found.fingers[1].manipulability == pytest.approx(abs(np.linalg.det(J)), rel=1e-6)


def test_a_planar_finger_does_not_move_across_its_plane() -> None:
    """Its third speed and its manipulability are zero."""
    for finger in quality("pinch").fingers:
        assert finger.speeds[2] < 1e-12 and finger.speeds[1] > 0.01 and finger.manipulability < 1e-12


def test_the_length_is_that_of_the_mass() -> None:
    """L^2 = (I_x + I_y + I_z) / 2 m."""
    assert quality().contacts.length == pytest.approx(math.sqrt((81.93 + 112.78 + 74.70) * 1e-6 / 0.4), rel=1e-6)


def test_the_reach_is_straight_when_stretched() -> None:
    """A finger that does not get there is as long as it can be."""
    finger = quality(object__position=[0.0, 0.010, 0.30]).fingers[2]
    assert finger.stretch == pytest.approx(1.0, abs=1e-3) and finger.length == pytest.approx(0.179)


@pytest.mark.parametrize("name", ["two fingers", "four fingers", "wrist", "continuous"])
def test_any_hand(name: str, tmp_path: Path) -> None:
    """Other numbers of fingers, a shared joint, a joint without limits."""
    found = grasp_quality(scenario_of(name, tmp_path))
    assert found.refusal is None and found.margin > 0.01
    assert {len(finger.angles) for finger in found.fingers} == {4 if name == "wrist" else 3}
    assert all(np.isinf(finger.reserve[0]) == (name == "continuous") for finger in found.fingers)
    draw_grasp(found, name)
    assert len({len(row) for row in found.finger_rows()}) == 1 and found.rows()


# --------------------------------------------------------------------------------------- least internal forces


def test_two_fingers_hold_by_the_weight_over_twice_the_friction() -> None:
    """The smallest f_N of the pinch is m g / (2 mu)."""
    found = quality("pinch").least_internal_force
    assert found is not None
    np.testing.assert_allclose(found, [WEIGHT / (2.0 * 0.5)], rtol=1e-6)


@pytest.mark.parametrize("name", ["target-a", "pinch"])
def test_the_least_internal_forces_are_the_least(name: str) -> None:
    """A little more is a grasp at rest, a little less is refused."""
    least = quality(name).least_internal_force
    assert least is not None
    assert quality(name, grasp__internal_force=(1.002 * least).tolist()).refusal is None
    assert quality(name, grasp__internal_force=(0.99 * least).tolist()).refusal is not None


def test_no_squeeze_holds_without_friction() -> None:
    """With next to no friction the weight slides out."""
    assert quality(fingertip__friction=1e-3).least_internal_force is None


# ---------------------------------------------------------------------------------------------- no grasp at rest


def test_out_of_reach_is_told_with_the_distance() -> None:
    """The refusal, how much is missing, and what does not depend on the fingers."""
    found = quality(object__position=[0.0, 0.030, 0.190])
    assert found.refusal is not None and found.refusal.quantity == "reach"  # type: ignore[attr-defined]
    assert all(0.005 < finger.missing < 0.02 for finger in found.fingers)
    assert found.margin == pytest.approx(quality().margin, rel=0.02)
    assert all(np.isnan(finger.Phi) and np.isnan(finger.torque).all() for finger in found.fingers)
    assert "out of reach by" in found.finger_rows()[2][1]


def test_what_is_missing_is_the_distance_to_the_tip() -> None:
    """From where the finger ends to where the centre of its tip should be."""
    found = quality(object__position=[0.0, 0.030, 0.190])
    for k, finger in enumerate(found.fingers):
        target = found.points[k] - (found.radius - 0.0018) * found.contacts.normals[k]
        assert np.linalg.norm(found.fingers_at[k][-1] - target) == pytest.approx(finger.missing, abs=1e-3)


def test_a_pulling_contact_is_told() -> None:
    """Negative internal forces: friction use is infinite, and the table says that a contact pulls."""
    found = quality(grasp__internal_force=[-4.0, -4.0, -3.0])
    assert found.refusal is not None and any(math.isinf(finger.friction_use) for finger in found.fingers)
    assert any("pulls" in row for row in found.finger_rows())


def test_any_friction_can_be_drawn() -> None:
    """Hardly any, and more than there is: every cone has finite corners."""
    for friction in (1e-6, 1e6):
        axes = draw_grasp(quality(fingertip__friction=friction), "friction").axes
        corners = [patch.get_path().vertices for one in axes for patch in one.patches]
        assert corners and all(np.isfinite(corner).all() for corner in corners)


def test_without_gravity_no_squeeze_is_needed_beyond_a_touch() -> None:
    """Each of two fingers presses with the 0.1 N that are asked for."""
    found = quality("pinch", gravity=[0.0, 0.0, 0.0])
    assert found.refusal is None and found.least_internal_force is not None
    np.testing.assert_allclose(found.least_internal_force, [0.1], rtol=1e-6)
    draw_grasp(found, "weightless")


def test_a_weight_that_cannot_be_carried_is_told() -> None:
    """Two contacts beside the centre of mass: no forces, no least squeeze, but the geometry."""
    found = quality("pinch", grasp__contact_points=[[0.028, 0.004, 0.0], [-0.028, 0.004, 0.0]])
    assert found.refusal is not None and np.isnan(found.forces).all() and found.least_internal_force is None
    assert found.singular_values[-1] > 0.1
    draw_grasp(found, "beside")


def test_a_point_off_the_surface_is_told() -> None:
    """It is taken to the nearest surface point, and the refusal names it."""
    points = [list(point) for point in CONTACT_POINTS]
    points[1][0] = -0.030
    found = quality(grasp__contact_points=points)
    assert found.refusal is not None and found.refusal.quantity == "contact point"  # type: ignore[attr-defined]
    np.testing.assert_allclose(found.points[1], np.add(REFERENCE.position, [-0.028, 0.0, 0.0]), atol=1e-12)


# ---------------------------------------------------------------------------------------------------- the command


def test_the_command_prints_and_draws(tmp_path: Path) -> None:
    """The rows of the call, and grasp.png in a new folder."""
    result = run_command("grasp", "target-a", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    lines = [" ".join(line.split()) for line in result.stdout.splitlines()]
    for row in (*quality().finger_rows(), *quality().rows()):
        assert " ".join(" ".join(row).split()) in lines
    assert "146 of 179" in result.stdout and "wrote runs/grasp-target-a/grasp.png" in result.stdout
    assert (tmp_path / "runs/grasp-target-a/grasp.png").read_bytes().startswith(b"\x89PNG")


def test_the_command_shows_what_it_can(tmp_path: Path) -> None:
    """No grasp at rest: table, picture, reason, exit code 1."""
    far = ("--set", "object.position=[0,0.03,0.19]", "--out", "far.svg")
    result = run_command("grasp", "target-a", *far, folder=tmp_path)
    assert result.returncode == 1 and "Traceback" not in result.stderr
    assert "out of reach by" in result.stdout and "error: finger_1_tip" in result.stderr
    assert "No grasp at rest" in (tmp_path / "far.svg").read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [(["target-c"], "target-a"), (["--out", "grasp.jpg"], ".jpg"), (["--set", "grasp.points=1"], "contact_points")],
)
def test_wrong_words_are_one_error(arguments: list[str], words: str, tmp_path: Path) -> None:
    """A name, an ending, a key."""
    result = run_command("grasp", *arguments, folder=tmp_path)
    assert result.returncode == 1 and words in result.stderr and "Traceback" not in result.stderr


def test_a_wrong_guess_is_refused() -> None:
    """A number of angles that does not fit the hand is told at once."""
    with pytest.raises((GraspError, ScenarioError), match="joint"):
        quality(grasp__joint_guess=[0.0, 1.0])


def test_it_is_public() -> None:
    """softhand.grasp_quality and softhand.propose_grasps."""
    assert softhand.grasp_quality is grasp_quality and callable(softhand.propose_grasps)


def test_slides_are_told_in_millimetres() -> None:
    """The jaws of the gripper: travel and reserve [mm], one millimetre a millimetre, no manipulability."""
    quality = grasp_quality(load_scenario("gripper"))
    rows = {row[0]: row[1:] for row in quality.finger_rows()}
    finger = quality.fingers[0]
    assert finger.slides.all() and rows["joint angles [mm]"][0] == f"{1e3 * finger.angles[0]:.1f}"
    assert rows["to the nearest limit [mm]"][0] == f"{1e3 * finger.reserve[0]:.1f}"
    assert rows["tip moves by [mm/mm]"][0] == "1.00, 0.00, 0.00" and set(rows["manipulability [cm^3/rad^3]"]) == {"-"}
    assert not grasp_quality(load_scenario("target-a")).fingers[0].slides.any()


def test_open_fingers_press_on_nothing() -> None:
    """The gap is told, forces are not known, the torques are those of gravity; the contact points are judged."""
    scenario = load_scenario("grasp-and-lift")
    quality = grasp_quality(scenario)
    rows = {row[0]: row[1:] for row in quality.finger_rows()}
    assert rows["gap to the contact point [mm]"] == ("15.0",) * 3
    for label in ("normal force [N]", "friction use", "limit-surface use", "dr [mm]"):
        assert rows[label] == ("-",) * 3
    simulation = build(scenario)
    gravity = simulation.sample().N_F
    torque = np.concatenate([finger.torque for finger in quality.fingers])
    np.testing.assert_allclose(torque, gravity, atol=1e-9)
    assert quality.refusal is None and quality.margin > 0.0
    figure = draw_grasp(quality, "open")
    front = figure.axes[1]
    assert front.get_ylabel() == "z [mm]" and "open start" in figure.axes[0].texts[-1].get_text()
    low, high = front.get_ylim()
    assert front.yaxis.get_major_formatter()(low, 0) != front.yaxis.get_major_formatter()(high, 0)
    assert low < -142.0 < high and front.yaxis.get_major_formatter()(-142.0, 0) == "142"  # upside down


@pytest.mark.skipif(find_spec("example_robot_data") is None, reason="needs the extra robots")
def test_the_least_internal_forces_of_four_fingers_may_spread() -> None:
    """Three fingers on one face: a squeeze is found, with the sizes of the scenario at most."""
    scenario = load_scenario("allegro-box")
    least = grasp_quality(scenario).least_internal_force
    assert least is not None and least.min() < -0.01
    assert np.abs(least).sum() < np.abs(scenario.grasp.internal_force).sum()
