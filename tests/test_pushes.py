"""Pushes from outside: what they do to the motion, when they act, what is recorded of them, which are refused."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hands import STEPPERS, Array, Task, random_state
from numpy.testing import assert_allclose

from softhand import ModelError, Push, Recording, ScenarioError, Simulation, State, build, load_scenario
from softhand.analysis.energy import energy_ledger
from softhand.assembly.parts import read_controller, read_stepper
from softhand.scenario.scenario import with_law
from softhand.simulation.pushes import Pushes
from softhand.steppers.stepper import Stepper

FORCE, MOMENT, POINT = (1.3, -0.8, 0.6), (0.02, -0.01, 0.03), (0.011, -0.007, 0.016)


# ------------------------------------------------------------------------------------------------------- acceleration


def jacobian_at(task: Task, q: Array, on: str, point: Sequence[float]) -> Array:
    """Velocity of a point of a body, and its angular velocity, from those of the model, by Pinocchio, (6, nv)."""
    model = task.world.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    if on == "object":
        index = next(k for k in range(model.nframes) if model.frames[k].parentJoint == model.njoints - 1)
        joint_pose = data.oMi[model.njoints - 1]
        place = joint_pose.act(np.array(point))
    else:
        index = model.getFrameId(on)
        place = data.oMf[index].act(np.array(point))
    J = pin.computeFrameJacobian(model, data, q, index, pin.LOCAL_WORLD_ALIGNED)
    arm = place - data.oMf[index].translation
    return np.vstack([J[:3] - pin.skew(arm) @ J[3:], J[3:]])


def bodies(task: Task) -> list[str]:
    """The object and all links of the hand that a joint moves."""
    model = task.world.model
    links = [frame.name for frame in model.frames if frame.type == pin.FrameType.BODY]
    moving = [name for name in links if 0 < model.frames[model.getFrameId(name)].parentJoint < model.njoints - 1]
    return ["object", *moving]


def test_a_push_accelerates_by_the_jacobian_of_its_point(task: Task, state: State) -> None:
    """What it adds to dv/dt is M^-1 J^T (F, moment), on the object and on every link, of every hand in motion."""
    plant, model = task.plant(), task.world.model
    plant.update(state.q, state.v, state.z)
    without, pushed = np.zeros((2, model.nv))
    torque = np.full(task.world.n_joints, 0.1)
    plant.acceleration(torque, without)
    M = plant.rigid.mass_matrix(state.q)
    for on in bodies(task):
        push = Push(FORCE, MOMENT, on, POINT)
        Pushes(plant, [push]).apply(0.0, state.q)
        wrench = np.concatenate([FORCE, MOMENT])
        generalized = jacobian_at(task, state.q, on, POINT).T @ wrench
        assert_allclose(plant.external, generalized, rtol=0.0, atol=1e-12, err_msg=on)
        plant.update(state.q, state.v, state.z)
        plant.acceleration(torque, pushed)
        expected = np.linalg.solve(M, generalized)
        assert_allclose(pushed - without, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max(), err_msg=on)


def test_pushes_at_one_time_add_up(reference: Task) -> None:
    """By schedule and by call; one that has ended or not begun adds nothing."""
    plant, state = reference.plant(), random_state(reference, np.random.default_rng(4))
    single = []
    first, second = Push(FORCE, start=0.1, duration=0.2), Push(moment=MOMENT, on="finger_2_distal", start=0.2)
    for push in (first, second, Push(FORCE, on="finger_1_middle", point=POINT)):
        Pushes(plant, [push]).apply(0.25, state.q)
        single.append(plant.external.copy())
    together = Pushes(plant, [first, second])
    together.add(Push(FORCE, on="finger_1_middle", point=POINT))
    for time, share in ((0.05, (0, 0, 1)), (0.1, (1, 0, 1)), (0.25, (1, 1, 1)), (0.3, (0, 1, 1))):
        together.apply(time, state.q)
        assert_allclose(plant.external, np.array(share) @ single, rtol=0.0, atol=1e-14, err_msg=f"{time}")
    together.clear()
    together.apply(0.05, state.q)
    assert not plant.external.any()


# ------------------------------------------------------------------------------------------------------------ motion


def free(stepper: Stepper, pushes: Sequence[Push] = (), duration: float = 0.05) -> Simulation:
    """The reference hand without torques, its box half a metre off, both in free fall."""
    made = build(load_scenario("target-a", {"fingertip.contact": "coulomb"}))
    state = made.state.copy()
    state.q[-7:-4] += (0.5, -0.4, 0.6)
    state.q[-4:] = pin.Quaternion(pin.rpy.rpyToMatrix(0.3, -0.7, 1.1)).coeffs()
    state.v[-6:] = (0.1, -0.2, 0.3, 0.4, 0.2, -0.5)
    state.z[:] = 0.0
    return Simulation(made.plant, state, None, stepper, made.reference, duration, 0.001, made.scenario, pushes)


def momenta(simulation: Simulation) -> tuple[Array, Array, Array]:
    """Of the box: place of its centre of mass, momentum, and moment of momentum about the centre, world axes."""
    model, state = simulation.plant.world.model, simulation.state
    inertia = model.inertias[model.njoints - 1]
    R, p = pin.Quaternion(state.q[-4:]).matrix(), state.q[-7:-4]
    v, w = R @ state.v[-6:-3], R @ state.v[-3:]
    lever = R @ inertia.lever
    return p + lever, inertia.mass * (v + np.cross(w, lever)), R @ inertia.inertia @ R.T @ w


@pytest.mark.parametrize("name", list(STEPPERS))
def test_momentum_grows_by_what_pushes_give(name: str) -> None:
    """Of a box in flight: m dv = (F + m g) t, and the spin by the moment about its centre, with every stepper."""
    simulation = free(STEPPERS[name](step=2.5e-4), [Push(FORCE, MOMENT, point=POINT, start=0.01, duration=0.02)])
    weight = 0.2 * np.array([0.0, 0.0, -9.81])
    _, before, spin_before = momenta(simulation)
    given, turned, steps = np.zeros(3), np.zeros(3), round(0.05 / 0.001)
    for k in range(steps):
        here, *_ = momenta(simulation)
        arm_here = simulation.state.q[-7:-4] + pin.Quaternion(simulation.state.q[-4:]).matrix() @ POINT - here
        simulation.sample()
        simulation.step()
        there, *_ = momenta(simulation)
        arm_there = simulation.state.q[-7:-4] + pin.Quaternion(simulation.state.q[-4:]).matrix() @ POINT - there
        pushing = 10 <= k < 30
        given += 0.001 * (weight + pushing * np.array(FORCE))
        turned += 0.001 * pushing * (np.array(MOMENT) + np.cross(0.5 * (arm_here + arm_there), FORCE))
    _, after, spin_after = momenta(simulation)
    assert np.linalg.norm(turned) > 5e-4  # a turn through half a radian
    # the push is held in the axes of the box over a step of 0.25 ms, in which it turns by a few mrad
    assert_allclose(after - before, given, rtol=0.0, atol=3e-3 * np.linalg.norm(given))
    assert_allclose(spin_after - spin_before, turned, rtol=0.0, atol=5e-3 * np.linalg.norm(turned))


@pytest.mark.parametrize("name", list(STEPPERS))
def test_a_push_acts_from_its_first_step_to_its_last(name: str) -> None:
    """F = m dv / dt holds in each single step: nothing lags behind, nothing is left over."""
    step = 1e-3 if name == "midpoint" else 2.5e-4
    simulation = free(STEPPERS[name](step=step), [Push(FORCE, start=0.003, duration=0.002)], 0.01)
    dv = []
    for _ in range(8):
        _, before, _ = momenta(simulation)
        simulation.sample()
        simulation.step()
        _, after, _ = momenta(simulation)
        dv.append((after - before) / 0.001 - 0.2 * np.array([0.0, 0.0, -9.81]))
    size = np.linalg.norm(FORCE)
    for k, found in enumerate(dv):
        assert_allclose(found, np.array(FORCE) * (k in (3, 4)), rtol=0.0, atol=2e-3 * size, err_msg=f"{k}")


def test_the_hand_gives_way_to_a_push() -> None:
    """A fingertip pushed along the world's y goes there: the direction of a force is that of the world."""
    simulation = free(STEPPERS["midpoint"](step=1e-3))
    still = free(STEPPERS["midpoint"](step=1e-3))
    for run, force in ((simulation, (0.0, 0.5, 0.0)), (still, (0.0, 0.0, 0.0))):
        run.state.v[:] = 0.0
        for _ in range(5):
            run.push(force, on="finger_1_tip")
            run.sample()
            run.step()
    moved = simulation.sample().tip_position[0] - still.sample().tip_position[0]
    assert moved[1] > 5e-5 and moved[1] > 2.0 * np.abs(moved[[0, 2]]).max()
    assert_allclose(simulation.observation.tip_position[1:], still.observation.tip_position[1:], atol=1e-12)


# ------------------------------------------------------------------------------------------- by call, and what is kept


def held(pushes: Sequence[Push] = (), **values: Any) -> Simulation:
    """Target A for 40 ms, pushed."""
    scenario = load_scenario("target-a", {"duration": 0.04, **{k.replace("__", "."): v for k, v in values.items()}})
    made = build(scenario)
    return Simulation(made.plant, made.state, read_controller(scenario), read_stepper(scenario), made.reference,
                      scenario.duration, scenario.control_period, made.scenario, pushes)  # fmt: skip


def test_a_push_by_call_is_one_by_schedule_for_a_control_period() -> None:
    """The same motion to the last bit, and after the period it is over."""
    push = Push(FORCE, MOMENT, "object", POINT, start=0.005, duration=0.002)
    on_link = Push(FORCE, MOMENT, "finger_2_middle", POINT, start=0.006, duration=0.001)
    planned, called = held([push, on_link], stepper__step=5e-4), held(stepper__step=5e-4)
    for k in range(20):
        if k in (5, 6):
            called.push(FORCE, MOMENT, "object", POINT)
        if k == 6:
            called.push(FORCE, MOMENT, "finger_2_middle", POINT)
        for simulation in (planned, called):
            simulation.sample()
            simulation.step()
        assert all(map(np.array_equal, planned.state.arrays, called.state.arrays)), k
    assert not called.plant.external.any()


def test_a_push_after_the_sample_acts_too() -> None:
    """Whether `push` is called before or after `sample`, the next step has it."""
    runs = [held(), held()]
    for simulation, early in zip(runs, (True, False), strict=True):
        if early:
            simulation.push(FORCE)
        simulation.sample()
        if not early:
            simulation.push(FORCE)
        simulation.step()
    assert all(map(np.array_equal, runs[0].state.arrays, runs[1].state.arrays))
    untouched = held()
    untouched.sample()
    untouched.step()
    assert not np.array_equal(untouched.state.v, runs[0].state.v)


def test_what_pushed_is_recorded(tmp_path: Path) -> None:
    """J^T (F, moment) at each sample that a push acts from, zero at the others; labels and file included."""
    pushes = [Push(FORCE, MOMENT, "object", POINT, 0.005, 0.003), Push(FORCE, on="finger_2_tip", start=0.02)]
    simulation = held(pushes)
    recording = simulation.run()
    assert recording.external_force.shape == (41, 15)
    expected, plant = np.zeros((41, 15)), simulation.plant
    data, model = plant.world.model.createData(), plant.world.model
    for k in range(41):
        q = np.concatenate([recording.joint_position[k], recording.object_position[k],
                            pin.Quaternion(pin.rpy.rpyToMatrix(*recording.object_rpy[k])).coeffs()])  # fmt: skip
        pin.framesForwardKinematics(model, data, q)
        if 5 <= k < 8:
            R, arm = data.oMi[model.njoints - 1].rotation, data.oMi[model.njoints - 1].rotation @ POINT
            expected[k, 9:12], expected[k, 12:] = R.T @ FORCE, R.T @ (np.array(MOMENT) + np.cross(arm, FORCE))
        if k >= 20:
            J = pin.computeFrameJacobian(model, data, q, model.getFrameId("finger_2_tip"), pin.LOCAL_WORLD_ALIGNED)
            expected[k] += J[:3].T @ FORCE
    assert_allclose(recording.external_force, expected, rtol=0.0, atol=1e-12)
    assert recording.labels["velocity"][8:11] == ("finger_3_distal_flexion", "object x", "object y")
    recording.save(tmp_path / "run.nc")
    again = Recording.load(tmp_path / "run.nc")
    assert np.array_equal(again.external_force, recording.external_force)
    assert again.labels["velocity"] == recording.labels["velocity"]


def test_without_a_push_there_is_no_variable() -> None:
    """Nothing pushed: not scheduled, or scheduled for after the end."""
    for pushes in ((), [Push(FORCE, start=1.0)]):
        recording = held(pushes).run()
        assert "external_force" not in recording.variables and "velocity" not in recording.labels


def test_a_reset_ends_pushes_by_call() -> None:
    """And not those by schedule."""
    simulation = held([Push(FORCE, start=0.0, duration=0.002)])
    first = simulation.run()
    simulation.reset()
    simulation.push((5.0, 0.0, 0.0))
    simulation.sample()
    assert np.array_equal(simulation.run().joint_position, first.joint_position)


# ------------------------------------------------------------------------------------------------------------- energy


@pytest.mark.parametrize("values", [{}, {"fingertip.contact": "coulomb", "fingertip.friction": 0.6}])
def test_the_energy_ledger_has_the_work_of_pushes(values: dict[str, Any]) -> None:
    """On object and link, in the grasp: the residual falls with the square of the step, and without the account it
    would be the work of the pushes.
    """
    pushes = [Push((1.5, 0.0, -1.0), (0.0, 0.02, 0.0), "object", POINT, 0.02, 0.1),
              Push((0.0, 0.6, 0.3), (0.0, 0.0, 0.0), "finger_3_distal", (0.02, 0.0, 0.0), 0.05, 0.1)]  # fmt: skip
    ledgers = []
    for step in (1e-3, 5e-4):
        scenario = with_law(load_scenario("target-a"), "conservative").with_values(
            {**values, "stepper.step": step, "control_period": step, "duration": 0.2}
        )
        made = build(scenario)
        simulation = Simulation(made.plant, made.state, read_controller(scenario), read_stepper(scenario),
                                made.reference, 0.2, step, made.scenario, pushes)  # fmt: skip
        ledgers.append(energy_ledger(simulation.run(), simulation.plant))
    coarse, fine = ledgers
    assert abs(coarse.residual[-1] / fine.residual[-1]) == pytest.approx(4.0, rel=0.25)
    assert abs(fine.residual[-1]) < 0.02 * abs(fine.pushed[-1]) and fine.pushed[-1] > 1e-5
    assert dict(fine.rows())["work of pushes"] == f"{1e3 * fine.pushed[-1]:.4g} mJ"


def test_a_ledger_without_pushes_does_not_speak_of_them() -> None:
    """The account is there, zero, and no row."""
    simulation = held()
    ledger = energy_ledger(simulation.run(), simulation.plant)
    assert not ledger.pushed.any() and "work of pushes" not in dict(ledger.rows())


# ----------------------------------------------------------------------------------------------------------- mistakes


def test_an_unknown_link_is_named() -> None:
    """With the links that there are, before anything runs."""
    with pytest.raises(ModelError, match=r"no link or frame is called 'thumb'.*finger_1_proximal"):
        held([Push(FORCE, on="thumb")])
    simulation = held()
    with pytest.raises(ModelError, match="'thumb'"):
        simulation.push(FORCE, on="thumb")
    simulation.sample()
    simulation.step()  # goes on as if nothing had been said


@pytest.mark.parametrize(
    ("push", "key"),
    [
        ({"force": (1.0, np.nan, 0.0)}, "force"),
        ({"force": (1.0, 2.0)}, "force"),
        ({"force": "hard"}, "force"),
        ({"moment": (0.0, 0.0, np.inf)}, "moment"),
        ({"moment": (1j, 0.0, 0.0)}, "moment"),
        ({"point": 0.1}, "point"),
        ({"start": np.nan}, "duration"),
        ({"duration": 0.0}, "duration"),
        ({"duration": -1.0}, "duration"),
        ({"duration": "long"}, "duration"),
    ],
)
def test_numbers_that_make_no_push_are_refused(push: dict[str, Any], key: str) -> None:
    """By schedule and by call, with the name of what is wrong and its value."""
    with pytest.raises(ScenarioError, match=f"a push: .*{key}") as caught:
        held([Push(**push)])
    assert caught.value.key == key
    if key != "duration":
        with pytest.raises(ScenarioError, match=f"a push: {key}"):
            held().push(**push)
