"""Laws in surface coordinates: contact frame, kinematics, start, faults and recording."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from energy import task_with
from hands import STEPPERS, Array, Task, numerical_jacobian, random_state, start_acceleration

from softhand.assembly.build import simulate
from softhand.errors import GraspError, SimulationStopped
from softhand.laws.conservative import Conservative
from softhand.laws.parallel_distributed import ParallelDistributed
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.references.goal import Goal
from softhand.references.reference import resting
from softhand.scenario.scenario import load_scenario, with_law
from softhand.sensing.observation import Observation
from softhand.sensing.sensor import Sensor

R = 0.010  # [m]
LAWS = {"conservative": Conservative(radius=R), "parallel-distributed": ParallelDistributed(radius=R)}


@pytest.fixture(params=list(LAWS), scope="module")
def task(request: pytest.FixtureRequest) -> Task:
    """The reference grasp with each of two laws."""
    return task_with(LAWS[request.param])


@pytest.fixture
def state(task: Task, rng: np.random.Generator) -> State:
    """A moving state near the grasp, with displacements of half a millimetre."""
    state = random_state(task, rng)
    state.z[:] = task.grasp.state.z + rng.normal(0.0, 1.0, state.z.shape) * [2e-4, 2e-4, 0.05]
    return state


@pytest.fixture
def moving(task: Task, state: State) -> Plant:
    """A plant at that state."""
    plant = task.plant()
    plant.snapshot.update(state.q, state.v)
    plant.touch(state.v, state.z, with_stiffness=True)
    return plant


def observe(task: Task, state: State) -> Observation:
    """The observation at a state."""
    nothing = resting(Goal((0.0,) * 6, task.internal_force))
    return Sensor(task.plant(), nothing.desired).observe(state, 0.0)


def test_contact_frame_is_fixed_in_the_face(task: Task, state: State, moving: Plant) -> None:
    """x_C is the tangent of the face, z_C its inward normal, and the frame is right-handed."""
    rotation = pin.XYZQUATToSE3(state.q[-7:]).rotation
    for fingertip, contact in zip(task.fingertips, moving.contacts, strict=True):
        frame = contact["rotation"]
        np.testing.assert_allclose(frame[:, 0], rotation @ fingertip.face.tangent, atol=1e-14)
        np.testing.assert_allclose(frame[:, 2], -rotation @ fingertip.face.normal, atol=1e-14)
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-14)
        assert np.linalg.det(frame) == pytest.approx(1.0)


def test_lean_is_the_axis_of_the_tip_in_the_face(task: Task, moving: Plant) -> None:
    """`lean` are the components of x_F along the axes of the face; its length is cos Phi."""
    for tip, contact in zip(task.world.tips, moving.contacts, strict=True):
        pose = moving.snapshot.poses[tip.joint]
        axis = pose[:9].reshape(3, 3).T @ tip.rotation[:, 0]
        np.testing.assert_allclose(contact["lean"], contact["rotation"][:, :2].T @ axis, atol=1e-14)
        assert np.linalg.norm(contact["lean"]) == pytest.approx(contact["cos_Phi"], rel=1e-12)


def test_displacement_is_the_integral_of_the_velocity(moving: Plant) -> None:
    """dr' = v_z, s' = v_xy, psi' = w_z; nothing spins."""
    velocity, rate = moving.contacts["velocity"], moving.contacts["deformation_rate"]
    np.testing.assert_array_equal(rate, velocity[:, [2, 0, 1, 3]])


def test_contact_force_is_the_laws(task: Task, moving: Plant) -> None:
    """f_x, f_y are f_1, f_2 in the axes of the face, f_z is f_n; power is that of the law."""
    for fingertip, contact in zip(task.fingertips, moving.contacts, strict=True):
        bearing = math.atan2(contact["lean"][1], contact["lean"][0])
        f_n, f_1, f_2, tau = fingertip.law(contact["deformation"], contact["angles"][1], bearing)
        np.testing.assert_allclose(contact["force"], [f_1, f_2, f_n, tau], rtol=1e-10, atol=1e-13)
        power = contact["deformation_force"] @ contact["deformation_rate"]
        assert contact["force"] @ contact["velocity"] == pytest.approx(power, rel=1e-12)


def test_stiffness_is_the_derivative_of_the_force(task: Task, moving: Plant) -> None:
    """`stiffness` is d force / d displacement in C_F, for analytic and for differenced laws."""
    size = np.array([R, R, R, 1.0])
    for fingertip, contact in zip(task.fingertips, moving.contacts, strict=True):
        where = contact["angles"][1], math.atan2(contact["lean"][1], contact["lean"][0])
        at, law = contact["deformation"].copy(), fingertip.law
        columns = [
            (law(at + move, *where) - law(at - move, *where))[[1, 2, 0, 3]] / 2e-6
            for move in (1e-6 * size * np.eye(4))[[1, 2, 0, 3]]
        ]
        expected = np.array(columns).T
        tolerance = 1e-6 * np.max(np.abs(expected))
        np.testing.assert_allclose(contact["stiffness"] * size, expected, rtol=1e-5, atol=tolerance)


def test_start_answers_the_forces_without_torsion(task: Task) -> None:
    """At the start each tip gives the force that was asked for, psi is zero, and nothing accelerates."""
    plant, grasp = task.plant(), task.grasp
    plant.update(grasp.state.q, grasp.state.v, grasp.state.z)
    np.testing.assert_allclose(plant.contacts["force"], grasp.force, rtol=1e-7, atol=1e-8)
    np.testing.assert_allclose(plant.contacts["deformation"], grasp.deformation, atol=1e-12)
    np.testing.assert_array_equal(grasp.state.z[:, 2], 0.0)
    np.testing.assert_allclose(start_acceleration(task), 0.0, atol=1e-5)


def test_start_takes_the_deeper_of_two_answers() -> None:
    """A tip that softens as it is relieved has a second equilibrium with little depth and much shear; not that one."""
    grasp = task_with(Conservative(radius=R, growth=5.1)).grasp
    assert np.all(grasp.deformation[:, 0] > 0.17 * R)
    assert np.max(np.abs(grasp.deformation[:, 1:3])) < 0.2 * R


def test_force_in_the_world_does_not_depend_on_the_tangent(task: Task, state: State, moving: Plant) -> None:
    """The axes in the face are arbitrary: turned, with s turned along, they give the same force in the world."""
    plant, angle = task.plant(), 0.9
    turned = state.copy()
    c, s = math.cos(angle), math.sin(angle)
    for pad, z in zip(plant.pads, turned.z, strict=True):
        tangent, normal = pad["face_tangent"].copy(), pad["face_normal"]
        pad["face_tangent"] = c * tangent + s * np.cross(-normal, tangent)
        z[:2] = [[c, s], [-s, c]] @ z[:2]
    plant.update(turned.q, turned.v, turned.z)
    for contact, expected in zip(plant.contacts, moving.contacts, strict=True):
        found = contact["rotation"] @ contact["force"][:3]
        np.testing.assert_allclose(found, expected["rotation"] @ expected["force"][:3], rtol=1e-9, atol=1e-10)
        assert contact["force"][3] == pytest.approx(expected["force"][3], rel=1e-12)


def test_coordinates_are_those_of_the_deformed_tip(task: Task, state: State) -> None:
    """eta is (Theta, Phi, alpha_o, Psi), and (38)-(40) are its rates along the motion."""

    def coordinates(time: Array) -> Array:
        moved = state.copy()
        moved.q[:] = pin.integrate(task.world.model, state.q, time[0] * state.v)
        return observe(task, moved).eta.copy()

    seen = observe(task, state)
    np.testing.assert_array_equal(seen.eta[:, :2], seen.contact_angles)
    expected = numerical_jacobian(coordinates, 1)[..., 0]
    scale = np.array([1.0, 1.0, R, R, 1.0])
    np.testing.assert_allclose(seen.eta_rate / scale, expected / scale, rtol=1e-6, atol=1e-6)


def test_eta_agrees_with_the_polar_law(reference: Task, state: State, task: Task) -> None:
    """Under a polar law without polar deformation eta is the same."""
    polar, bare = state.copy(), state.copy()
    polar.z[:] = 0.0
    np.testing.assert_allclose(observe(task, bare).eta, observe(reference, polar).eta, rtol=1e-9, atol=1e-12)


# --------------------------------------------------------------------------------------------------------------- runs


@pytest.mark.parametrize("stepper", list(STEPPERS))
def test_every_stepper_carries_a_surface_law(stepper: str) -> None:
    """All steppers agree on 0.2 s of target A."""
    scenario = with_law(load_scenario("target-a", {"duration": 0.2}), "conservative")
    expected = simulate(scenario.with_values({"stepper": {"name": "adaptive", "step": 1e-3}}))
    found = simulate(scenario.with_values({"stepper": {"name": stepper, "step": 2.5e-4}}))
    limit = 3e-6 if stepper == "semi-implicit-euler" else 2e-8
    np.testing.assert_allclose(found.object_position, expected.object_position, rtol=0.0, atol=limit)


OVER_THE_APEX = {
    "object.position": [0.0, 0.010, 0.112],
    "reference.object_position": [0.0, 0.010, 0.104],
    "reference.object_rpy": [0.0, 0.0, 0.0],
    "duration": 1.0,
}


def test_a_run_rolls_over_the_apex_without_a_jump() -> None:
    """Two tips roll past Phi = 90 deg; Theta turns by 180 deg there, forces and deformations go on smoothly."""
    recording = simulate(with_law(load_scenario("target-a", OVER_THE_APEX), "conservative"))
    Phi = np.degrees(recording.contact_angles[:, :2, 1])
    assert recording.complete
    assert np.all(Phi.max(axis=0) > 89.9) and np.all(Phi[-1] < 83.0) and np.all(Phi[0] > 89.0)
    assert np.max(np.abs(np.diff(recording.contact_angles[:, :2, 0], axis=0))) > 3.0
    assert np.max(np.abs(np.diff(recording.contact_force[..., :3], axis=0))) < 0.01
    assert np.max(np.abs(np.diff(recording.deformation, axis=0))) < 1e-3
    assert np.all(np.isfinite(recording.contact_coordinates_rate))


def test_the_papers_law_cannot_start_there() -> None:
    """The same start is refused for a law in polar coordinates, so that the test above can fail."""
    with pytest.raises(GraspError, match="at the apex, where the paper's coordinates are singular"):
        simulate(load_scenario("target-a", OVER_THE_APEX))


def test_rim_ends_a_run_of_a_surface_law_too() -> None:
    """A tip that rolls over the rim of its flat face ends the run with finger and time."""
    values = {"reference.object_rpy": [0.0, 1.4, 0.0], "reference.duration": 1.0, "fingertip.friction": 5.0}
    with pytest.raises(SimulationStopped) as stop:
        simulate(with_law(load_scenario("target-a", values), "conservative"))
    assert stop.value.reason == "rim"
    assert "rolls over its rim (phi = -" in str(stop.value)


def test_recorded_deformation_has_angles_for_displacements() -> None:
    """`deformation` records (dr, s1 / R, s2 / R, psi): metres, then radians, as for the paper's law."""
    scenario = with_law(load_scenario("target-a", {"duration": 0.01}), "conservative")
    recording = simulate(scenario)
    grasp = task_with(Conservative(radius=R)).grasp
    distance = R - grasp.deformation[:, :1]
    np.testing.assert_allclose(recording.deformation[0, :, 1:3], grasp.deformation[:, 1:3] / distance, rtol=1e-6)
    np.testing.assert_allclose(recording.deformation[0, :, 0], grasp.deformation[:, 0], rtol=1e-9)


def test_fingers_may_have_laws_of_both_kinds(reference: Task, rng: np.random.Generator) -> None:
    """A polar law at one finger and a surface law at the next each answer in their own coordinates."""
    state = random_state(reference, rng)
    law = LAWS["conservative"]
    mixed = Plant(
        reference.world, [replace(tip, law=law) if i == 1 else tip for i, tip in enumerate(reference.fingertips)]
    )
    polar = reference.plant()
    state.z[1] = [1e-4, 2e-4, 0.1]
    for plant in (mixed, polar):
        plant.update(state.q, state.v, state.z)
    for i in (0, 2):
        np.testing.assert_array_equal(mixed.contacts["force"][i], polar.contacts["force"][i])
    contact = mixed.contacts[1]
    bearing = math.atan2(contact["lean"][1], contact["lean"][0])
    expected = law(contact["deformation"], contact["angles"][1], bearing)
    np.testing.assert_allclose(contact["deformation_force"], expected, rtol=1e-12)
