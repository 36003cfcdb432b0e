"""Steppers: orders of convergence, stability with stiff tips, torques held over several steps."""

from __future__ import annotations

from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from hands import (
    STEPPERS,
    Array,
    Task,
    deviations,
    holding_torque,
    read_reference,
    reference_task,
    run_reference,
)

from softhand.plant.state import State
from softhand.steppers.stepper import Stepper

ORDERS = {"semi-implicit-euler": 1, "midpoint": 2, "rk4": 4}
STEPS = {
    "semi-implicit-euler": (0.1, 0.05, 0.025, 0.0125),
    "midpoint": (0.25, 0.125, 0.0625, 0.03125),
    "rk4": (0.5, 0.25, 0.125, 0.0625),
}
"""Steps of the fit [ms]: small enough for the leading term, large enough to stay above rounding."""

SAMPLES = np.arange(1, 11) * 5e-3  # [s]


def pushed(task: Task) -> State:
    """The start with small velocities, so that all tips roll and ring and stay in contact."""
    state, rng = task.grasp.state.copy(), np.random.default_rng(0)
    n = task.world.n_joints
    state.v[:] = np.concatenate([rng.normal(0.0, 0.05, n), rng.normal(0.0, 0.002, 3), rng.normal(0.0, 0.05, 3)])
    return state


def ride(stepper: Stepper) -> list[State]:
    """States at `SAMPLES` after a push, under the torques that hold the start."""
    task = reference_task()
    plant, state = task.plant(), pushed(task)
    torque = holding_torque(plant, task.grasp.state)
    integration, states = stepper.start(plant), []
    for _ in SAMPLES:
        for _ in range(round(SAMPLES[0] / stepper.step)):
            integration.advance(state, torque)
        states.append(state.copy())
    return states


@cache
def exact_ride() -> list[State]:
    """The same by the adaptive stepper at the tightest tolerance."""
    return ride(STEPPERS["adaptive"](step=1e-3, rtol=1e-13, atol=1e-15))


def errors(states: list[State]) -> Array:
    """Largest error of q, v and z over the ride, shape (3,)."""
    model = reference_task().world.model
    rows = [
        [
            np.max(np.abs(pin.difference(model, exact.q, state.q))),
            np.max(np.abs(exact.v - state.v)),
            np.max(np.abs(exact.z - state.z)),
        ]
        for exact, state in zip(exact_ride(), states, strict=True)
    ]
    return np.max(rows, axis=0)


def test_every_stepper_has_an_order_here() -> None:
    """Each stepper that ships is measured below, or is the one measured against."""
    assert set(STEPPERS) == {*ORDERS, "adaptive"}


@pytest.mark.parametrize("name", list(ORDERS))
def test_order_of_convergence(name: str) -> None:
    """Halving the step divides the error of the velocities by 2, 4 or 16."""
    steps = np.array(STEPS[name]) * 1e-3
    found = [errors(ride(STEPPERS[name](step=step)))[1] for step in steps]
    slope = np.polyfit(np.log(steps), np.log(found), 1)[0]
    assert slope == pytest.approx(ORDERS[name], abs=0.25)


@pytest.mark.parametrize("name", list(ORDERS))
def test_positions_and_memory_converge_at_least_as_fast(name: str) -> None:
    """Positions and deformations converge with the order or better (semi-implicit Euler is of second order in them)."""
    steps = np.array(STEPS[name]) * 1e-3
    found = np.array([errors(ride(STEPPERS[name](step=step))) for step in steps])
    slopes = np.polyfit(np.log(steps), np.log(found[:, [0, 2]]), 1)[0]
    assert np.all(slopes > ORDERS[name] - 0.25)


FAST_STEPS = {
    "semi-implicit-euler": (4e-5, 2e-5, 1e-5),
    "midpoint": (4e-5, 2e-5, 1e-5),
    "rk4": (2e-4, 1e-4, 5e-5),
}


def fling(stepper: Stepper) -> Array:
    """Velocities 4 ms after the joints were set in motion at up to 7 rad/s, so that velocity terms count."""
    task = reference_task()
    plant, state = task.plant(), task.grasp.state.copy()
    torque = holding_torque(plant, state)
    n = task.world.n_joints
    state.v[:n] = 60.0 * pushed(task).v[:n]
    integration = stepper.start(plant)
    for _ in range(round(4e-3 / stepper.step)):
        integration.advance(state, torque)
    return state.v


@pytest.mark.parametrize("name", list(ORDERS))
def test_order_of_convergence_of_fast_joints(name: str) -> None:
    """The order holds where Coriolis and centrifugal terms matter."""
    exact = fling(STEPPERS["adaptive"](step=1e-3, rtol=1e-13, atol=1e-15))
    steps = np.array(FAST_STEPS[name])
    found = [np.max(np.abs(fling(STEPPERS[name](step=step)) - exact)) for step in steps]
    slope = np.polyfit(np.log(steps), np.log(found), 1)[0]
    assert slope == pytest.approx(ORDERS[name], abs=0.25)


def test_adaptive_error_follows_its_tolerance() -> None:
    """Tightening the tolerance of the adaptive stepper lowers its error, and its default is below 1e-7 rad/s."""
    adaptive = STEPPERS["adaptive"]
    loose, tight = (errors(ride(adaptive(step=5e-3, rtol=rtol, atol=1e-2 * rtol)))[1] for rtol in (1e-5, 1e-9))
    assert loose > 100.0 * tight
    assert errors(ride(adaptive(step=1e-3)))[1] < 1e-7


@pytest.mark.parametrize("name", list(STEPPERS))
def test_start_stays_at_rest(name: str) -> None:
    """Under the torques that hold it, the start does not move."""
    task = reference_task()
    plant, state = task.plant(), task.grasp.state.copy()
    torque = holding_torque(plant, state)
    integration = STEPPERS[name](step=2.5e-4).start(plant)
    for _ in range(200):
        integration.advance(state, torque)
    np.testing.assert_allclose(state.v, 0.0, atol=1e-9)
    np.testing.assert_allclose(state.q, task.grasp.state.q, rtol=0.0, atol=1e-11)


STIFF = 100.0
"""Factor of the tips' stiffness: the highest contact frequency is then ten times that of the reference hand."""


def shake(stepper: Stepper, duration: float = 0.06) -> tuple[Array, Array]:
    """Joint angles [rad] and largest speed at each millisecond after a push, stiff tips, torques of the start held.

    The grasp itself is unstable under held torques, so that the push grows after 0.1 s whatever the stepper.
    """
    task = reference_task(STIFF)
    plant, state = task.plant(), pushed(task)
    torque = holding_torque(plant, task.grasp.state)
    integration, angles, speeds = stepper.start(plant), [], []
    for _ in range(round(duration / stepper.step)):
        integration.advance(state, torque)
        angles.append(state.q[: task.world.n_joints].copy())
        speeds.append(np.max(np.abs(state.v)))
    return np.array(angles), np.array(speeds)


def test_midpoint_is_stable_with_stiff_tips() -> None:
    """With tips a hundred times stiffer, midpoint at 1 ms gets no faster than the exact motion and stays near it."""
    angles, speeds = shake(STEPPERS["midpoint"](step=1e-3))
    exact_angles, exact_speeds = shake(STEPPERS["adaptive"](step=1e-3))
    assert np.max(speeds) < 1.2 * np.max(exact_speeds)
    assert np.max(np.abs(angles - exact_angles)) < 1.5e-4  # [rad]; they move by 2e-3


@pytest.mark.parametrize("name", ["rk4", "semi-implicit-euler"])
def test_explicit_steppers_fail_with_stiff_tips(name: str) -> None:
    """The same push is too much for the explicit steppers at 1 ms, so that the test above can fail."""
    with np.errstate(all="ignore"):
        _, speeds = shake(STEPPERS[name](step=1e-3))
    assert not np.max(speeds) < 1e3


def test_torque_is_held_over_smaller_steps() -> None:
    """Steps of 1/8 ms within a control period of 1 ms come at least ten times nearer to the reference.

    The reference holds its torque for 1 ms: a torque that moved with the steps would not converge to it.
    """
    expected = read_reference("minimum-jerk", True)
    coarse, fine = (
        deviations(run_reference("midpoint", "minimum-jerk", True, step), expected) for step in (1e-3, 1.25e-4)
    )
    for group in ("position [m]", "orientation [rad]", "torque [N m]"):
        assert fine[group] < 0.1 * coarse[group]
