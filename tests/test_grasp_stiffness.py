"""The stiffness of a held object: joints locked, on springs, under a controller."""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from commands import run_command
from numpy.testing import assert_allclose
from test_attitude import TURNS, turned
from test_closed_loop import Delayed, Slow

import softhand
from softhand.closed_loop.feedback import differentiate
from softhand.closed_loop.grasp_stiffness import settled
from softhand.closed_loop.linearize import linearize_plant
from softhand.closed_loop.object_tangent import tangent
from softhand.closed_loop.start import HeldStart, held_start
from softhand.errors import ControllerError, GraspError, RecordingError, ScenarioError
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.scenario.scenario import Scenario, load_scenario, with_law

GENERAL = {"object.rpy": (0.05, -0.03, 0.08)}
LEVEL = {
    "gravity": (0.0, 0.0, 0.0),
    "object.position": (0.0, 0.0, 0.08),
    "grasp.contact_points": ((-0.028, 0.0, 0.0), (0.028, 0.0, 0.0)),
}
LINEAR = {"k": 9e3, "k_tangential": 2.5e3, "k_torsional": 0.03}


@cache
def scenario_of(name: str) -> Scenario:
    """A box askew in three fingers by the name of a law, or a scenario that ships."""
    if name in ("nakashima", "conservative", "point"):
        scenario = load_scenario("target-a", GENERAL)
        return scenario if name == "nakashima" else with_law(scenario, name, LINEAR if name == "point" else None)
    return load_scenario(name)


@cache
def start_of(name: str) -> HeldStart:
    return held_start(scenario_of(name))


def pressed(scenario: Scenario, **fields: float) -> Scenario:
    """The gripper without gravity, its tips opposite each other and linear."""
    return with_law(scenario.with_values(LEVEL), "point", {**LINEAR, "gamma": 0.05, **fields})


def wrench(plant: Plant, position: Array, rotation: Array) -> Array:
    """Of contacts and gravity on the object about its origin [N, N m], from the contact table, in the world."""
    world, found = plant.world, np.zeros(6)
    for contact in plant.contacts:
        R, force = contact["rotation"], contact["force"]
        push = R @ force[:3]
        found += np.concatenate([push, np.cross(contact["point"] - position, push) + R[:, 2] * force[3]])
    weight = world.object_mass * world.gravity
    arm = rotation @ world.model.inertias[world.object_joint].lever
    return found + np.concatenate([weight, np.cross(arm, weight)])


def rolled(plant: Plant, state: State, way: Array) -> Array:
    """Wrench on the object once it has gone along a way [m, rad] in the world, joints locked, the tips rolling."""
    world, steps, z = plant.world, 4, state.z.copy()
    position, rotation, q = world.object_position(state.q).copy(), world.object_rotation(state.q), state.q.copy()

    def rate(share: float, z: Array) -> Array:
        R = pin.exp3(share * way[3:]) @ rotation
        world.set_object_pose(position + share * way[:3], R, q)
        v = np.concatenate([np.zeros(world.n_joints), R.T @ way[:3], R.T @ way[3:]])
        plant.update(q, v, z)
        return np.pad(plant.contacts["deformation_rate"][:, 1:], ((0, 0), (0, z.shape[1] - 3)))

    for k in range(steps):
        half = z + 0.5 / steps * rate(k / steps, z)
        z = z + rate((k + 0.5) / steps, half) / steps
    rate(1.0, z)
    plant.update(q, np.zeros_like(state.v), z)
    return wrench(plant, position + way[:3], world.object_rotation(q))


# ---------------------------------------------------------------------------------------------------- joints locked


@pytest.mark.parametrize("name", ["nakashima", "conservative", "can", "ball", "gripper"])
def test_it_is_what_the_contact_forces_lose_when_the_object_is_moved(name):
    """Rolling by 20 um and 1 mrad in six random directions, the wrench summed over the contacts."""
    start, K = start_of(name), softhand.grasp_stiffness(scenario_of(name)).stiffness
    ways = np.random.default_rng(3).normal(size=(6, 6)) * np.repeat([2e-5, 1e-3], 3)
    for way in ways:
        ahead, behind = (rolled(start.probe.plant, start.state, side * way) for side in (1.0, -1.0))
        assert_allclose(K @ way, 0.5 * (behind - ahead), rtol=0.0, atol=2e-4 * np.abs(K @ way).max())


@pytest.mark.parametrize("name", ["conservative", "point"])
def test_a_spring_without_shear_is_symmetric_and_with_shear_as_far_from_it_as_that_goes(name):
    """Rolling is not holonomic: what it does to stored shear depends on the way. About a moment M, as of a state that
    is not at rest, rotations do not commute: K - K^T has the cross product with M there."""
    plant, state = start_of(name).probe.plant, start_of(name).state

    def skewness(share: float) -> Array:
        found = tangent(plant, State(state.q, state.v, share * state.z))
        K, moment = found.with_joints(np.zeros(plant.world.n_joints)), found.unbalanced[3:]
        K[3:, 3:] -= 0.5 * pin.skew(moment)
        return K - K.T

    assert np.abs(state.z).max() > 1e-6
    assert_allclose(skewness(0.0), 0.0, atol=1e-6)
    assert np.abs(skewness(1.0)).max() > 1e-3
    assert_allclose(skewness(1.0), 2.0 * skewness(0.5), rtol=0.0, atol=1e-4 * np.abs(skewness(1.0)).max())


def test_the_papers_law_has_no_energy_and_its_matrix_is_left_as_it_is():
    found = softhand.grasp_stiffness(scenario_of("nakashima"))
    assert found.asymmetry > 0.01
    assert not np.allclose(found.stiffness, found.stiffness.T, rtol=1e-3)
    assert any("not symmetric" in note for note in found.notes())


@pytest.mark.parametrize("joints", ["locked", 3.0, "controller"])
def test_turning_the_scene_turns_it(joints):
    scenario, Q = load_scenario("blind"), TURNS["general"]
    here, there = (softhand.grasp_stiffness(one, joints=joints) for one in (scenario, turned(scenario, Q)))
    both = np.kron(np.eye(2), Q)
    size = np.abs(here.stiffness).max()
    assert_allclose(there.stiffness, both @ here.stiffness @ both.T, rtol=0.0, atol=1e-7 * size)
    assert_allclose(there.translation, here.translation, rtol=1e-6)
    assert_allclose(there.rotation, here.rotation, rtol=1e-5)
    turns = np.abs(np.sum(there.translation_directions * (here.translation_directions @ Q.T), axis=1))
    assert_allclose(turns, 1.0, atol=1e-6)


def test_twice_the_coefficients_and_the_forces_are_twice_the_stiffness():
    scenario = scenario_of("nakashima")
    names = ("k_r", "k_phi", "k_theta", "k_psi")
    values = {f"fingertip.{name}": 2.0 * scenario.fingertip.parameters[name] for name in names}
    values["object.mass"] = 2.0 * start_of("nakashima").probe.plant.world.object_mass
    values["grasp.internal_force"] = [2.0 * force for force in scenario.grasp.internal_force]
    K, twice = (softhand.grasp_stiffness(one).stiffness for one in (scenario, scenario.with_values(values)))
    assert_allclose(twice, 2.0 * K, rtol=0.0, atol=1e-7 * np.abs(K).max())


def test_a_tip_that_has_relaxed_has_what_is_left_of_its_springs():
    scenario = scenario_of("conservative")
    damping = {"name": "fung", "shares": (0.3, 0.2), "rates": (20.0, 300.0)}
    values = {f"fingertip.{name}": 2.0 * value for name, value in (("k_r", 0.377e6), ("k_phi", 0.166e6),
                                                                   ("k_psi", 0.0488e9))}  # fmt: skip
    relaxed = scenario.with_values({**values, "fingertip.damping": damping})
    K = softhand.grasp_stiffness(scenario).stiffness
    assert_allclose(softhand.grasp_stiffness(relaxed).stiffness, K, rtol=0.0, atol=1e-6 * np.abs(K).max())


def test_two_opposite_tips():
    """Pressed along x with f: each adds k, k_t, k_t; about x k_psi; across k_t a^2 + f (a + r - d), as the force turns
    with the face and its point rolls along it."""
    scenario, Q = load_scenario("gripper"), rotation_of((0.4, -0.3, 0.9))
    found = softhand.grasp_stiffness(turned(pressed(scenario), Q))
    (k, k_t, k_psi), a, f = LINEAR.values(), 0.028, scenario.grasp.internal_force[0]
    across = k_t * a**2 + f * (a + 0.010 - f / k)
    expected = 2.0 * np.diag([k, k_t, k_t, k_psi, across, across])
    both = np.kron(np.eye(2), Q)
    assert_allclose(found.stiffness, both @ expected @ both.T, rtol=0.0, atol=1e-5)
    assert_allclose(found.translation, [2.0 * k_t, 2.0 * k_t, 2.0 * k], rtol=1e-7)
    assert_allclose(found.rotation, 2.0 * np.array([k_psi, across, across]), rtol=1e-6)
    assert_allclose(np.abs(found.rotation_directions[0]), np.abs(Q[:, 0]), atol=1e-6)
    assert_allclose(found.compliance @ found.stiffness, np.eye(6), atol=1e-9)
    assert found.asymmetry < 1e-8


def test_tips_without_torsion_leave_one_turn_without_compliance():
    found = softhand.grasp_stiffness(pressed(load_scenario("gripper"), k_torsional=1e-12))
    assert np.isnan(found.compliance).all()
    assert_allclose(found.rotation[0], 0.0, atol=1e-8)
    assert json.loads(found.to_json())["compliance"][0][0] is None
    assert any("no compliance" in note for note in found.notes())


# ------------------------------------------------------------------------------------------------- joints that give way


def test_joints_that_get_stiffer_come_to_locked_ones():
    """The error goes with the compliance of the joints."""
    scenario = scenario_of("nakashima")
    locked = softhand.grasp_stiffness(scenario).stiffness
    gaps = [np.abs(softhand.grasp_stiffness(scenario, joints=k).stiffness - locked).max() for k in (1e4, 1e5, 1e6)]
    assert_allclose([gaps[0] / gaps[1], gaps[1] / gaps[2]], 10.0, rtol=0.1)
    assert_allclose(softhand.grasp_stiffness(scenario, joints=np.inf).stiffness, locked, rtol=1e-12)


def test_a_grasp_pressed_lightly_is_the_series_of_springs_in_fixed_contact_frames():
    """K = G (C_s + J C_q J^T)^-1 G^T [MP]; what it leaves out goes with the forces."""

    def gap(force: float) -> float:
        scenario = pressed(load_scenario("gripper")).with_values({"grasp.internal_force": [force]})
        start, n = held_start(scenario), 2
        plant, state = start.probe.plant, start.state
        plant.snapshot.update(state.q, state.v)
        plant.touch(state.v, state.z, 0.0, True)
        C_s = np.kron(
            np.eye(n), np.diag([1 / LINEAR["k_tangential"]] * 2 + [1 / LINEAR["k"], 1 / LINEAR["k_torsional"]])
        )
        J, G = plant.jacobian.reshape(4 * n, -1)[:, :n], -plant.jacobian.reshape(4 * n, -1)[:, n:].T
        series = G @ np.linalg.inv(C_s + J @ np.diag(1.0 / np.array([400.0, 700.0])) @ J.T) @ G.T
        R = np.kron(np.eye(2), plant.world.object_rotation(state.q))
        found = softhand.grasp_stiffness(scenario, joints=[400.0, 700.0]).stiffness
        return float(np.abs(found - R @ series @ R.T).max())

    gaps = np.array([gap(force) for force in (0.4, 0.2, 0.1)])
    assert gaps[2] < 0.02
    assert_allclose(gaps[:2] / gaps[1:], 2.0, rtol=0.02)


@pytest.mark.parametrize("name", ["can", "computed-torque", "allegro-prism"])
def test_under_a_controller_it_is_the_gain_of_the_linear_loop_at_rest(name):
    """Where a wrench on the object leaves plant and memory, x' = A x + B (K x + L m) + E w = 0, m = P x + Q m."""
    start, found = start_of(name), softhand.grasp_stiffness(scenario_of(name), joints="controller")
    world, q = start.probe.plant.world, start.state.q
    control = differentiate(start.controller, start.probe, start.state, start.period)
    model = linearize_plant(start.probe.plant, start.state, control.torque)
    A, B = model.A, model.B
    nv, n, s, m = len(start.state.v), world.n_joints, len(A), len(control.by_memory.T)
    pushed = np.zeros((s + m, 6))
    pushed[nv : 2 * nv] = np.linalg.inv(start.probe.plant.rigid.mass_matrix(q))[:, n:]
    whole = np.block([[A + B @ control.by_state, B @ control.by_memory],
                      [control.memory_by_state, control.memory_by_memory - np.eye(m)]])  # fmt: skip
    rest = -np.linalg.solve(whole, pushed)[n:nv]
    R = np.kron(np.eye(2), world.object_rotation(q))
    assert_allclose(found.compliance, R @ rest @ R.T, rtol=0.0, atol=1e-5 * np.abs(found.compliance).max())


@pytest.mark.parametrize(("memory", "joints"), [(Slow(), 3.0), (Delayed(), "controller")], ids=["slow", "delayed"])
def test_what_a_controller_remembers_has_come_to_rest(memory, joints):
    """A spring on the joints that lags is that spring, and (59) of an earlier grasp is (59)."""
    scenario = load_scenario("hold")
    start = held_start(scenario)
    controller = memory if isinstance(memory, Slow) else Delayed(**dict(start.controller))
    control = differentiate(controller, start.probe, start.state, start.period)
    assert not control.is_smooth
    found = tangent(start.probe.plant, start.state, settled(control, "own")).with_torques()
    expected = softhand.grasp_stiffness(scenario, joints=joints).stiffness
    assert_allclose(found, expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["target-a", "pinch", "allegro-box"])
def test_the_papers_controller_holds_the_object_with_its_gains(name):
    """Joints that it does not hold, those of the planar fingers of `pinch`, stay where they are."""
    found = softhand.grasp_stiffness(load_scenario(name), joints="controller")
    assert_allclose(found.translation[:2], 100.0, rtol=1e-6)
    assert_allclose(found.rotation[1], 0.3, rtol=1e-4)
    assert not any("rest" in note for note in found.notes())


def test_a_controller_that_does_not_hold_the_start_is_said_to():
    assert any(
        "do not rest" in note for note in softhand.grasp_stiffness(load_scenario("blind"), joints="controller").notes()
    )


# --------------------------------------------------------------------------------------------------------- recordings


def test_a_recording_at_a_time():
    run = softhand.simulate(load_scenario("target-a", {"duration": 0.3, "reference.duration": 0.3}))
    start, first = softhand.grasp_stiffness(load_scenario("target-a")), softhand.grasp_stiffness(run, at=0.0)
    assert_allclose(first.stiffness, start.stiffness, rtol=0.0, atol=1e-6 * np.abs(start.stiffness).max())
    later = softhand.grasp_stiffness(run, at=0.2004)
    assert later.time == pytest.approx(0.2, abs=1e-9)
    assert_allclose(later.position, run.object_position[200])
    assert np.abs(later.stiffness - start.stiffness).max() > 100.0, "it is squeezed harder"
    with pytest.raises(RecordingError, match=r"at: got 0.5 s, but the recording goes from 0 to 0.3 s"):
        softhand.grasp_stiffness(run, at=0.5)


@pytest.mark.parametrize(
    ("name", "values", "error", "message"),
    [
        ("target-a", {"joints": "lokced"}, ScenarioError, "'lokced'.*did you mean 'locked'"),
        ("target-a", {"joints": [1.0, 2.0]}, ScenarioError, r"shape \(2,\).*each of the 9 joints"),
        ("target-a", {"joints": -1.0}, ScenarioError, "above 0 N m/rad"),
        ("target-a", {"joints": float("nan")}, ScenarioError, "above 0 N m/rad"),
        ("target-a", {"at": 0.1}, ScenarioError, "at: got 0.1 s for a scenario"),
        ("grasp-and-lift", {}, GraspError, "no fingertip touches.*grasp.opening = 0"),
        ("finger-only", {"joints": "controller"}, ControllerError, "sum over time"),
    ],
)
def test_what_cannot_be_answered_is_refused(name, values, error, message):
    with pytest.raises(error, match=message):
        softhand.grasp_stiffness(load_scenario(name), **values)


def test_it_can_be_read_by_people_and_programs():
    found = softhand.grasp_stiffness(scenario_of("point"), joints=5.0)
    table = json.loads(found.to_json())
    assert np.shape(table["stiffness"]) == (6, 6) and table["units"]["translation"] == "N/m"
    assert table["names"][3] == "turn about x" and table["joint_stiffness"] == [5.0] * 9
    assert f"{1e-3 * found.translation[0]:.4g} N/mm" in repr(found)
    assert "rotation, stiffest" in found._repr_html_() and "joints held by springs" in found._repr_html_()


def test_the_command_prints_the_principal_stiffnesses(tmp_path):
    found = softhand.grasp_stiffness(load_scenario("target-a"), joints=20.0)
    shown = run_command("grasp", "--stiffness", "--joints", "20", folder=tmp_path, width=120)
    assert shown.returncode == 0
    for _, value, direction in found.rows():
        assert value in shown.stdout and direction in shown.stdout
    table = json.loads(run_command("grasp", "--stiffness", "--json", folder=tmp_path).stdout)
    assert table["margin"] > 0.0
    assert_allclose(table["stiffness"]["stiffness"], softhand.grasp_stiffness(load_scenario("target-a")).stiffness)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--joints", "3"], "--joints: is for --stiffness"),
        (["--stiffness", "--joints", "lokced"], "did you mean 'locked'"),
        (["grasp-and-lift", "--stiffness"], "no fingertip touches"),
        (["finger-only", "--stiffness", "--joints", "controller"], "sum over time"),
    ],
)
def test_the_command_refuses_in_one_line(arguments, words, tmp_path):
    result = run_command("grasp", *arguments, folder=tmp_path)
    assert result.returncode == 1 and words in result.stderr
    assert (
        sum(line.startswith("error: ") for line in result.stderr.splitlines()) == 1 and "Traceback" not in result.stderr
    )
