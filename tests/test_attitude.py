"""Attitude has no seams: a grasp, its reference and its controller are the same however the whole is turned."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hands import ARM_IN_THE_AIR, Array
from numpy.testing import assert_allclose

import softhand
from softhand.analysis.performance import errors
from softhand.numerics.rotations import (
    log_of_turn,
    rates_to_turning,
    rotation_vector,
    set_rotation,
    set_rpy,
    turn_rotation,
    turn_vector,
    turning_to_rates,
    turns_between,
)
from softhand.numerics.spatial import rotation_of, turning_of

TURNS = {
    "half about z": pin.exp3(np.array([0.0, 0.0, np.pi])),
    "half about x": pin.exp3(np.array([np.pi, 0.0, 0.0])),
    "pitch 90": rotation_of((0.0, 0.5 * np.pi, 0.0)),
    "general": rotation_of((-2.0, 0.7, 1.3)),
    "seam": rotation_of((3.1, -1.5, -3.1)),
}
"""Of the whole scenario: onto the seams of roll, pitch and yaw, and off every axis."""

CONTROLLERS = {
    "object-impedance": "object-impedance",
    "computed-torque": "computed-torque",
    "finger-only": "finger-only",
    "point-contact": "point-contact",
    "blind": "blind",
    "regulation": "target-a",
    "angle-feedback": "pinch-angle-feedback",
    "two-phase": "pinch-two-phase",
    "opposing": "pinch-opposing",
    "pick-and-place": "target-a",
    "arm-pick-and-place": "arm-pick-and-place",
    "least-squeeze": "target-a",
}


def angles(R: Array) -> list[float]:
    return [float(value) for value in pin.rpy.matrixToRpy(R)]


def turned(scenario: softhand.Scenario, Q: Array) -> softhand.Scenario:
    """The whole scenario turned about the origin of the world: hand, object, gravity, what is asked for."""
    hand, thing, reference = scenario.hand, scenario.object, scenario.reference
    return scenario.with_values({
        "gravity": (Q @ scenario.gravity).tolist(),
        "hand.position": (Q @ hand.position).tolist(),
        "hand.rpy": angles(Q @ rotation_of(hand.rpy)),
        "object.position": (Q @ thing.position).tolist(),
        "object.rpy": angles(Q @ rotation_of(thing.rpy)),
        "reference.object_position": (Q @ reference.object_position).tolist(),
        "reference.object_rpy": angles(Q @ rotation_of(reference.object_rpy)),
    })  # fmt: skip


def load(name: str) -> softhand.Scenario:
    """A short run with a controller, errors as rotation vectors, which moves to its target in 0.1 s."""
    values = {"duration": 0.12, "reference.duration": 0.1, "reference.orientation_path": "geodesic"}
    if name == "arm-pick-and-place":
        values = {**ARM_IN_THE_AIR, **values, "reference": {
            "kind": "minimum-jerk", "duration": 0.1, "object_position": [0.35, 0.1, 0.14],
            "object_rpy": [0.2, -0.3, 0.4], "internal_force": [6.0, 6.0, 5.0],
        }}  # fmt: skip
        del values["reference.duration"], values["reference.orientation_path"]
    scenario = softhand.load_scenario(CONTROLLERS[name], values)
    if name in ("regulation", "pick-and-place", "least-squeeze"):
        scenario = scenario.with_values({"controller": {"name": name}})
    # a smaller way, which the grasp follows at that pace
    start, target = np.array(scenario.object.position), np.array(scenario.reference.object_position)
    way = rotation_vector(rotation_of(scenario.object.rpy), rotation_of(scenario.reference.object_rpy))
    R = pin.exp3(0.2 * way) @ rotation_of(scenario.object.rpy)
    position = (start + 0.1 * (target - start)).tolist()
    return scenario.with_values({"reference.object_position": position, "reference.object_rpy": angles(R)})


@pytest.mark.parametrize("turn", list(TURNS))
@pytest.mark.parametrize("name", list(CONTROLLERS))
def test_turning_everything_changes_nothing(name: str, turn: str) -> None:
    """Joints, torques, contact forces and deformations of a turned scenario are those of the scenario itself."""
    scenario, Q = load(name), TURNS[turn]
    here, there = softhand.simulate(scenario), softhand.simulate(turned(scenario, Q))
    assert np.ptp(here.joint_position, axis=0).max() > 1e-4, "the run should move"
    for variable in ("joint_position", "joint_torque", "contact_force", "deformation", "internal_force_desired"):
        assert_allclose(there[variable], here[variable], rtol=0.0, atol=1e-9)
    assert_allclose(there.object_position, here.object_position @ Q.T, rtol=0.0, atol=1e-10)
    assert_allclose(errors(there).orientation, errors(here).orientation, rtol=0.0, atol=1e-7)


def test_every_controller_is_turned() -> None:
    """The test above walks all controllers that ship."""
    from softhand.plugins import SHIPPED

    apart = {"state-feedback", "set-points"}  # gains stand for one attitude; set points are turned in test_servo
    assert {*CONTROLLERS} | apart == set(SHIPPED["controllers"])


HOLD = {"reference.kind": "step", "reference.object_position": (0.0, 0.010, 0.142), "duration": 0.3,
        "reference.internal_force": (4.0, 4.0, 3.0)}  # fmt: skip


@pytest.mark.parametrize("form", ["rotation-vector", "euler"])
@pytest.mark.parametrize("yaw", [np.pi, -np.pi])
def test_an_object_frame_turned_by_half_is_held(form: str, yaw: float) -> None:
    """The box with its frame turned by pi about z stays where it is, whichever of the two names its target has."""
    points = [(-28e-3, 0.0, 0.0), (28e-3, 0.0, 0.0), (0.0, 18e-3, -5e-3)]
    frame = {"object.rpy": (0.0, 0.0, np.pi), "reference.object_rpy": (0.0, 0.0, yaw), "grasp.contact_points": points}
    values = {**HOLD, **frame, "controller.orientation_error": form}
    run = softhand.simulate(softhand.load_scenario("target-a", values))
    assert run.complete
    assert np.max(np.abs(run.object_position - run.object_position[0])) < 1e-6
    assert errors(run).orientation.max() < 1e-3  # [deg]


def test_the_paper_s_form_is_refused_where_it_is_singular() -> None:
    """Near pitch 90 deg roll, pitch and yaw end the run by name, with the remedy."""
    scenario = turned(
        softhand.load_scenario("target-a", HOLD | {"reference.object_rpy": (0.0, 0.0, 0.0)}), TURNS["pitch 90"]
    )
    with pytest.raises(softhand.ControllerError, match=r'pitch is 90\.0 deg; set controller.orientation_error = "rot'):
        softhand.simulate(scenario)
    run = softhand.simulate(scenario.with_values({"controller.orientation_error": "rotation-vector"}))
    assert np.max(np.abs(run.object_position - run.object_position[0])) < 1e-6


def test_both_forms_agree_near_the_target() -> None:
    """For a small error the torques differ by its square."""
    simulation = softhand.build(softhand.load_scenario("target-a"))
    observation = simulation.sample().copy()
    gaps = []
    for size in (1e-2, 1e-3):
        near = observation.copy()
        near.object_rpy_desired = observation.object_rpy + size * np.array([0.5, -0.7, 0.4])
        forms = [
            softhand.controllers.regulation.Regulation(orientation_error=form) for form in ("euler", "rotation-vector")
        ]
        one, two = (form.torque(near, form.start(near))[0] for form in forms)
        gaps.append(np.max(np.abs(one - two)))
    assert 0.0 < gaps[1] < 1.2e-2 * gaps[0]


def test_a_geodesic_turns_about_one_axis() -> None:
    """The reference goes the shortest way: its angular velocity keeps its direction and makes up the whole turn."""
    scenario = softhand.load_scenario("object-impedance", {"object.rpy": (0.0, 0.0, 0.0)})
    motion = softhand.assembly.parts.read_motion(scenario)
    target = rotation_of(scenario.reference.object_rpy)
    whole = rotation_vector(np.eye(3), target)
    step, turned_by = 1e-4, np.zeros(3)
    for time in np.arange(step / 2, 1.0, step):
        w = motion.update(time).twist[3:]
        assert np.linalg.norm(np.cross(w, whole)) < 1e-12
        turned_by += step * w
    assert_allclose(turned_by, whole, atol=1e-7)
    assert_allclose(rotation_of(motion.desired.coordinates[3:]), target, atol=1e-7)


@pytest.mark.parametrize("path", ["geodesic", "euler"])
def test_rates_of_a_reference_are_its_differences(path: str) -> None:
    """Twist and its rate, and those of the coordinates, belong to what is asked for, in general position."""
    values = {
        "reference.orientation_path": path,
        "object.rpy": (0.3, -0.2, 2.9),
        "reference.object_rpy": (-1.0, 0.8, -2.5),
    }
    scenario = softhand.load_scenario("target-a", values)
    motion = softhand.assembly.parts.read_motion(scenario)

    def at(time: float) -> dict[str, Array]:
        desired = motion.update(time)
        names = ("coordinates", "coordinates_rate", "coordinates_acceleration", "twist", "twist_rate")
        kept = {name: getattr(desired, name).copy() for name in names}
        return kept | {"R": rotation_of(desired.coordinates[3:])}

    h = 1e-5
    for time in (0.13, 0.4, 0.77):
        before, now, after = at(time - h), at(time), at(time + h)
        w = rotation_vector(before["R"], after["R"]) / (2.0 * h)
        assert_allclose(now["twist"][3:], w, atol=1e-7)
        assert_allclose(now["twist"][:3], (after["coordinates"] - before["coordinates"])[:3] / (2.0 * h), atol=1e-9)
        assert_allclose(now["twist_rate"], (after["twist"] - before["twist"]) / (2.0 * h), atol=1e-6)
        rates = (after["coordinates_rate"] - before["coordinates_rate"]) / (2.0 * h)
        assert_allclose(now["coordinates_acceleration"], rates, atol=1e-5)
        assert_allclose(turning_of(now["coordinates"][3:]) @ now["coordinates_rate"][3:], now["twist"][3:], atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-7, 1e-4, 0.3, 2.0, np.pi - 1e-3, np.pi - 1e-9, np.pi])
def test_the_logarithm_is_exact_at_any_angle(angle: float) -> None:
    """From nothing to half a turn, about any axis, from any rotation; at half a turn up to its sign."""
    rng = np.random.default_rng(0)
    for _ in range(50):
        start, axis = pin.exp3(rng.normal(size=3)), rng.normal(size=3)
        w = angle * axis / np.linalg.norm(axis)
        found, end = np.empty(3), start @ pin.exp3(w)
        log_of_turn(start, end, found)
        if angle > 3.14159265:
            found *= np.sign(found @ w)
        else:
            assert_allclose(rotation_vector(start, end), start @ found, atol=1e-14)
        assert_allclose(found, w, rtol=0.0, atol=4e-15)
        again = np.empty((3, 3))
        turn_rotation(*(start @ w), start, again)
        assert_allclose(again, end, rtol=0.0, atol=4e-15)
        column = start[:, 1].copy()
        turn_vector(*(start @ w), column)
        assert_allclose(column, again[:, 1], rtol=0.0, atol=4e-16)  # one formula for both


def test_angles_and_rates_go_and_come_back() -> None:
    """Rotation to roll, pitch, yaw and back; their rates to angular velocity and acceleration and back."""
    rng = np.random.default_rng(1)
    for _ in range(100):
        R, rpy, again = pin.exp3(rng.normal(size=3) * 2.0), np.empty(3), np.empty((3, 3))
        for steep in (
            R,
            pin.exp3(rng.normal(size=3) * 1e-9) @ rotation_of((0.4, rng.choice([-0.5, 0.5]) * np.pi, -1.1)),
        ):
            set_rpy(steep, rpy)
            set_rotation(rpy, again)
            assert_allclose(again, steep, atol=1e-14)
        set_rpy(R, rpy)
        rate, bend = rng.normal(size=(2, 3))
        velocity, acceleration, back = np.empty(3), np.empty(3), np.empty((2, 3))
        rates_to_turning(rpy, rate, bend, velocity, acceleration)
        h = 1e-6
        sides = [turning_of(rpy + s * rate) @ (rate + s * bend) for s in (h, -h)]
        assert_allclose(velocity, turning_of(rpy) @ rate, atol=1e-14)
        assert_allclose(acceleration, (sides[0] - sides[1]) / (2.0 * h), atol=1e-8)
        turning_to_rates(rpy, velocity, acceleration, *back)
        assert_allclose(back, (rate, bend), rtol=1e-9, atol=1e-9)


def test_an_error_across_the_seam_is_small() -> None:
    """From yaw 179 deg to -179 deg is a turn of 2 deg."""
    rpy = np.radians([[0.0, 0.0, 179.0], [180.0, 0.0, -179.0]])
    other = np.radians([[0.0, 0.0, -179.0], [-180.0, 0.0, 179.0]])
    assert_allclose(np.degrees(turns_between(rpy, other)), [[0.0, 0.0, 2.0], [0.0, 0.0, 2.0]], atol=1e-12)
