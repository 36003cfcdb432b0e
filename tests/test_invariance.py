"""What must not matter: how the world is turned, a second run, and how many fingers the hand has."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hands import GRAVITY, LAYOUTS, STEPPERS, Array, Task, holding_torque, make_fingertips, make_law, run

from softhand.plant.state import State
from softhand.recording.recording import Recording
from softhand.references.goal import Goal
from softhand.references.straight import MinimumJerk

TURNS = {
    "about x": pin.rpy.rpyToMatrix(0.9, 0.0, 0.0),
    "about all": pin.rpy.rpyToMatrix(-2.0, 0.7, 1.3),
    "upside down": pin.rpy.rpyToMatrix(np.pi, 0.0, 0.4),
}
SHIFT = np.array([0.3, -0.2, 0.5])  # [m]
STEP = {"semi-implicit-euler": 2.5e-4}
"""Steps that are not 1 ms [s]."""


def moved(task: Task, stepper: str = "midpoint") -> Recording:
    """A run of 0.2 s in which Eq. (59) lifts the object by 2 mm and presses a little harder, within 0.15 s."""
    start = np.array([*task.grasp.state.q[-7:-4], 0.0, 0.0, 0.0])
    force = np.array(task.internal_force)
    lifted = start[:3] + np.array([5e-4, 1e-3, 2e-3])
    reference = MinimumJerk(
        object_position=lifted, object_rpy=start[3:], internal_force=1.1 * force, duration=0.15
    ).start(Goal(start, force))
    return run(task, STEPPERS[stepper](step=STEP.get(stepper, 1e-3)), 0.2, reference=reference)


def replay(task: Task, torques: Array, stepper: str) -> list[State]:
    """States after each millisecond under given torques, one row a millisecond."""
    settings = STEPPERS[stepper](step=STEP.get(stepper, 1e-3))
    state, integration, states = task.grasp.state.copy(), settings.start(task.plant()), []
    for torque in torques:
        for _ in range(round(1e-3 / settings.step)):
            integration.advance(state, torque)
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


def assert_same_motion(task: Task, name: str, turn: Array, stepper: str, folder: Path) -> None:
    """Under the same torques both worlds move alike: joints, deformations and the object's pose in the turned world."""
    other, torques = turned(task, name, turn, folder), moved(task).joint_torque[:-1]
    here, there = (replay(each, torques, stepper) for each in (task, other))
    assert np.linalg.norm(here[-1].q[-7:-4] - task.grasp.state.q[-7:-4]) > 1e-3, "the ride should move the object"
    for a, b in zip(here, there, strict=True):
        np.testing.assert_allclose(b.q[:-7], a.q[:-7], rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(b.z, a.z, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(turn.T @ (b.q[-7:-4] - SHIFT), a.q[-7:-4], rtol=0.0, atol=1e-9)
        rotation_a, rotation_b = (pin.Quaternion(state.q[-4:]).matrix() for state in (a, b))
        np.testing.assert_allclose(turn.T @ rotation_b, rotation_a, rtol=0.0, atol=1e-9)
    compressions = []
    for each, states in ((task, here), (other, there)):
        plant = each.plant()
        plant.update(states[-1].q, states[-1].v, states[-1].z)
        compressions.append(plant.contacts["deformation"][:, 0].copy())
    np.testing.assert_allclose(compressions[1], compressions[0], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("turn", list(TURNS))
@pytest.mark.parametrize("stepper", list(STEPPERS))
def test_turning_the_world_changes_nothing(reference: Task, tmp_path: Path, stepper: str, turn: str) -> None:
    """With hand, object and gravity turned, the same torques give the same motion to 1e-9, by every stepper."""
    assert_same_motion(reference, "reference", TURNS[turn], stepper, tmp_path)


def test_turning_the_world_changes_nothing_for_any_hand(
    task: Task, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """The same for two and four fingers, a wrist, continuous joints, canted tips and a mass off the middle."""
    assert_same_motion(task, request.node.callspec.params["task"], TURNS["about all"], "midpoint", tmp_path)


def test_turning_gravity_alone_does_change_the_motion(reference: Task, tmp_path: Path) -> None:
    """The comparison can fail: with gravity turned by 0.1 mrad alone, the motions differ by far more than 1e-9."""
    world = LAYOUTS["reference"].load(tmp_path, gravity=(0.0, 1e-3, -9.81))
    torques = moved(reference).joint_torque[:-1]
    here, there = (replay(each, torques, "midpoint")[-1] for each in (reference, replace(reference, world=world)))
    assert np.max(np.abs(here.q - there.q)) > 1e-6


def test_continuous_joints_move_as_revolute_ones(make_task: Callable[[str], Task]) -> None:
    """A hand with continuous joints runs as the same hand with revolute joints."""
    results = []
    for name in ("reference", "continuous"):
        recording = moved(make_task(name))
        results.append((recording.joint_position, recording.object_position, recording.deformation))
    for here, there in zip(*results, strict=True):
        np.testing.assert_allclose(there, here, rtol=0.0, atol=1e-9)


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
    assert np.linalg.norm(went - asked) < 0.4 * np.linalg.norm(asked)
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
