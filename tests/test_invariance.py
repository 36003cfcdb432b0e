"""What must not matter: how the world is turned, a second run, and how many fingers the hand has."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hands import GRAVITY, LAYOUTS, STEPPERS, Array, Task, holding_torque, make_fingertips, make_law, run

from softhand.plant import Plant, State
from softhand.references import MinimumJerk
from softhand.steppers.stepper import Stepper

TURNS = {
    "about x": pin.rpy.rpyToMatrix(0.9, 0.0, 0.0),
    "about all": pin.rpy.rpyToMatrix(-2.0, 0.7, 1.3),
    "upside down": pin.rpy.rpyToMatrix(np.pi, 0.0, 0.4),
}
SHIFT = np.array([0.3, -0.2, 0.5])  # [m]


def ride(plant: Plant, state: State, torque: Array, stepper: Stepper, duration: float) -> list[State]:
    """States after each millisecond under given torques: those that hold, and a small wave on each joint."""
    state, integration, states = state.copy(), stepper.start(plant), []
    joints = np.arange(len(torque))
    for k in range(round(duration / 1e-3)):
        wave = 1e-3 * np.sin(40.0 * k * 1e-3 + joints)  # [N m]
        for _ in range(round(1e-3 / stepper.step)):
            integration.advance(state, torque + wave)
        states.append(state.copy())
    return states


def turned(task: Task, name: str, turn: Array, folder: Path) -> Task:
    """The same grasp with hand, object and gravity turned, and hand and object moved."""
    world = LAYOUTS[name].load(folder, turn, SHIFT, tuple(turn @ GRAVITY))
    start = task.grasp.state.copy()
    start.q[-7:-4] = turn @ start.q[-7:-4] + SHIFT
    start.q[-4:] = pin.Quaternion(turn @ pin.Quaternion(start.q[-4:]).matrix()).coeffs()
    fingertips = make_fingertips(world, make_law(), task.contact_points)
    return replace(task, world=world, fingertips=fingertips, grasp=replace(task.grasp, state=start))


def compare(task: Task, name: str, turn: Array, stepper: Stepper, folder: Path) -> None:
    """Both worlds move alike for 0.2 s: joints, deformations, object pose and velocities."""
    other = turned(task, name, turn, folder)
    plants = (task.plant(), other.plant())
    torque = holding_torque(plants[0], task.grasp.state)
    rides = [
        ride(plant, each.grasp.state, torque, stepper, 0.2) for plant, each in zip(plants, (task, other), strict=True)
    ]
    start = task.grasp.state
    assert np.max(np.abs(rides[0][-1].q - start.q)) > 1e-3, "the ride should move something"
    for here, there in zip(*rides, strict=True):
        np.testing.assert_allclose(there.q[:-7], here.q[:-7], rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(there.z, here.z, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(turn.T @ (there.q[-7:-4] - SHIFT), here.q[-7:-4], rtol=0.0, atol=1e-9)
        rotations = [pin.Quaternion(state.q[-4:]).matrix() for state in (here, there)]
        np.testing.assert_allclose(turn.T @ rotations[1], rotations[0], rtol=0.0, atol=1e-9)
    plants[0].update(rides[0][-1].q, rides[0][-1].v, rides[0][-1].z)
    plants[1].update(rides[1][-1].q, rides[1][-1].v, rides[1][-1].z)
    compressions = [plant.contacts["deformation"][:, 0] for plant in plants]
    np.testing.assert_allclose(compressions[1], compressions[0], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("turn", list(TURNS))
@pytest.mark.parametrize("stepper", list(STEPPERS))
def test_turning_the_world_changes_nothing(reference: Task, tmp_path: Path, stepper: str, turn: str) -> None:
    """With hand, object and gravity turned, the same torques give the same motion to 1e-9, by every stepper."""
    step = {"semi-implicit-euler": 2.5e-4}.get(stepper, 1e-3)
    compare(reference, "reference", TURNS[turn], STEPPERS[stepper](step=step), tmp_path)


def test_turning_the_world_changes_nothing_for_any_hand(task: Task, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    """The same for two and four fingers, a wrist and continuous joints."""
    name = request.node.callspec.params["task"]
    compare(task, name, TURNS["about all"], STEPPERS["midpoint"](), tmp_path)


def test_turning_gravity_alone_does_change_the_motion(reference: Task, tmp_path: Path) -> None:
    """The comparison can fail: without turning the gravity along, the motions differ."""
    world = LAYOUTS["reference"].load(tmp_path, gravity=(0.0, 1e-3, -9.81))
    other = replace(reference, world=world)
    torque = holding_torque(reference.plant(), reference.grasp.state)
    stepper = STEPPERS["midpoint"]()
    here, there = (ride(each.plant(), each.grasp.state, torque, stepper, 0.2)[-1] for each in (reference, other))
    assert np.max(np.abs(here.q - there.q)) > 1e-6


def test_continuous_joints_move_as_revolute_ones(make_task: Callable[[str], Task]) -> None:
    """A hand with continuous joints runs as the same hand with revolute joints."""
    results = []
    for name in ("reference", "continuous"):
        recording = moved(make_task(name))
        results.append((recording.joint_position, recording.object_position, recording.deformation))
    for here, there in zip(*results, strict=True):
        np.testing.assert_allclose(there, here, rtol=0.0, atol=1e-9)


def moved(task: Task, stepper: str = "midpoint") -> object:
    """A run of 0.2 s in which Eq. (59) lifts the object by 2 mm and presses a little harder, within 0.15 s."""
    start = np.array([*task.grasp.state.q[-7:-4], 0.0, 0.0, 0.0])
    force = np.array(task.internal_force)
    reference = MinimumJerk(start, start + [5e-4, 1e-3, 2e-3, 0.0, 0.0, 0.0], force, 1.1 * force, 0.15)
    step = {"semi-implicit-euler": 2.5e-4}.get(stepper, 1e-3)
    return run(task, STEPPERS[stepper](step=step), 0.2, reference=reference)


@pytest.mark.parametrize("stepper", list(STEPPERS))
def test_two_runs_are_bit_equal(reference: Task, stepper: str) -> None:
    """The same run twice gives the same bits in every array, by every stepper."""
    first, second = moved(reference, stepper), moved(reference, stepper)
    for name, values in first.variables.items():
        np.testing.assert_array_equal(second[name], values, err_msg=name)


def test_every_hand_moves_the_object(task: Task) -> None:
    """Hands of two, three and four fingers, with a wrist or continuous joints, move the object and keep it."""
    recording = moved(task)
    assert recording.complete
    assert np.min(recording.contact_force[..., 2]) > 1.0  # [N]
    assert np.max(recording.friction_use) < 1.0
    asked = recording.object_position_desired[-1] - recording.object_position[0]
    went = recording.object_position[-1] - recording.object_position[0]
    assert np.linalg.norm(went - asked) < 0.3 * np.linalg.norm(asked)
    assert np.max(np.abs(recording.object_rpy)) < 0.05


def test_sizes_are_counted(task: Task) -> None:
    """Joints, contacts and pairs of contacts of a recording are those of the hand."""
    n, nc = task.world.n_joints, task.world.n_tips
    recording = run(task, STEPPERS["midpoint"](), 0.01)
    assert recording.joint_position.shape == (11, n)
    assert recording.deformation.shape == (11, nc, 4)
    assert recording.internal_force.shape == (11, nc * (nc - 1) // 2)
    assert recording.contact_coordinates.shape == (11, nc, 5)


def test_resting_start_stays_under_the_controller(task: Task) -> None:
    """With its starting pose as target, (59) commands the holding torques, and nothing moves."""
    recording = run(task, STEPPERS["midpoint"](), 0.2)
    torque = holding_torque(task.plant(), task.grasp.state)
    np.testing.assert_allclose(recording.joint_torque[0], torque, rtol=0.0, atol=1e-8)
    moved_by = np.abs(recording.object_position - recording.object_position[0])
    assert np.max(moved_by) < 1e-8
