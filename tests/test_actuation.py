"""What drives make of a commanded torque, against formulas; both loops with all of it are in test_sensing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from softhand import ControllerError, Recording, ScenarioError, build, load_scenario
from softhand.assembly.instruments import read_actuation
from softhand.controllers.regulation import Regulation
from softhand.simulation.asking import Actuators

Array = NDArray[np.float64]

PERIOD = 0.001  # [s]
N = 9  # joints


def drives(limit: float = 100.0, **settings: Any) -> Actuators:
    """Those of the reference hand."""
    scenario = load_scenario("target-a", {"actuation": settings})
    simulation = build("target-a")
    world = simulation.plant.world
    made = read_actuation(scenario, world, Regulation())
    return Actuators(np.zeros(N), np.full(N, limit), world.joints, simulation.state.arrays, made)


def answers(actuators: Actuators, commands: Any) -> Array:
    """Torques of one joint in control periods, shape (periods,)."""
    found = []
    for k, command in enumerate(commands):
        actuators.command[:] = command
        assert actuators.apply()
        actuators.act(k)
        found.append(actuators.torque[2])
    return np.array(found)


STEP = np.concatenate([[0.0], np.ones(30)])


def test_a_command_arrives_so_many_control_periods_later() -> None:
    """And before the run the first one has been held for long."""
    found = answers(drives(delay=0.003), np.arange(5.0, 15.0))
    assert found.tolist() == [5.0, 5.0, 5.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0]


def test_a_lag_answers_a_step_with_the_mean_of_each_control_period() -> None:
    """Of 1 - exp(-t / lag), so that the impulse is exact."""
    lag = 0.004
    found = answers(drives(lag=lag), STEP)
    t = PERIOD * np.arange(31)
    integral = t + lag * np.exp(-t / lag)  # of the answer to a step at t = 0
    assert found[1:] == pytest.approx(np.diff(integral) / PERIOD, abs=1e-14)
    assert found[0] == 0.0


def test_a_rate_limit_makes_a_ramp_of_a_step() -> None:
    """Upwards and downwards."""
    found = answers(drives(rate_limit=250.0), [0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0])
    assert found == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0, 1.0, 0.75, 0.5], abs=1e-14)


def test_noise_is_that_of_the_torque_of_each_period_and_joint() -> None:
    """Mean, deviation, independence; beyond the lag and the limits."""
    made = drives(noise=(0.01 * np.arange(1, N + 1)).tolist(), lag=0.01)
    rows = []
    for k in range(4000):
        made.command[:] = 1.0
        made.apply()
        made.act(k)
        rows.append((made.torque - 1.0) / (0.01 * np.arange(1, N + 1)))
    units = np.array(rows)
    count = len(units)
    assert np.abs(units.mean(axis=0)).max() < 5.0 / np.sqrt(count)
    assert np.abs(units.T @ units / count - np.eye(N)).max() < 5.0 * np.sqrt(2.0 / count)
    assert np.abs(units[1:].T @ units[:-1] / count).max() < 5.0 / np.sqrt(count)


def test_effort_limits_cut_what_arrives() -> None:
    """After the delay, before the rate limit; the flag belongs to the torque that is cut."""
    made = drives(limit=0.5, delay=0.002)
    flags, torques = [], []
    for k, command in enumerate([0.1, 2.0, 0.2, 0.2, 0.2]):
        made.command[:] = command
        made.apply()
        made.act(k)
        flags.append(int(made.limited[0]))
        torques.append(float(made.torque[0]))
    assert torques == [0.1, 0.1, 0.1, 0.5, 0.2]
    assert flags == [0, 0, 0, 1, 0]


def test_a_period_that_is_asked_for_twice_gives_the_same() -> None:
    """The second time with another command, as where torques are given in place of the controller's."""
    made, other = (drives(delay=0.001, lag=0.003, noise=0.1, rate_limit=100.0) for _ in range(2))
    for k in range(8):
        made.command[:] = 7.0
        made.apply()
        made.act(k)
        for one in (made, other):
            one.command[:] = 0.1 * k
            one.apply()
            one.act(k)
        assert np.array_equal(made.torque, other.torque)


def run(**settings: Any) -> Recording:
    """Target A for 20 ms."""
    return build(load_scenario("target-a", {"actuation": settings, "reference.kind": "step"}, duration=0.02)).run()


def test_the_recording_has_the_torque_that_was_commanded_and_that_which_was_applied() -> None:
    """One is the other, so many samples later."""
    recording = run(delay=0.004)
    assert np.array_equal(recording.joint_torque[4:], recording.joint_torque_commanded[:-4])
    assert np.all(recording.joint_torque[:4] == recording.joint_torque_commanded[0])
    assert np.ptp(recording.joint_torque_commanded, axis=0).max() > 1e-3
    assert recording.units("joint_torque_commanded") == recording.units("joint_torque")


def test_the_drives_go_on_between_two_calls_of_a_slow_controller() -> None:
    """The torque of a lag changes in each control period, the command in every fifth."""
    scenario = load_scenario(
        "target-a", {"actuation.lag": 0.005, "controller.period": 0.005, "reference.kind": "step"}, duration=0.02
    )
    recording = build(scenario).run()
    changes = np.any(np.diff(recording.joint_torque_commanded, axis=0) != 0.0, axis=1)
    assert np.flatnonzero(changes).tolist() == [4, 9, 14, 19]
    assert np.all(np.any(np.diff(recording.joint_torque[5:], axis=0) != 0.0, axis=1))


def test_torques_that_are_given_go_through_the_drives() -> None:
    """`step(torque)` is a command."""
    simulation = build(load_scenario("target-a", {"actuation.delay": 0.002}))
    held = []
    for k in range(5):
        simulation.sample()
        if k == 0:
            first = simulation.torque.copy()
        simulation.step(first + 1e-3 * k)
        held.append(float(simulation.torque[0] - first[0]))
    assert held == pytest.approx([0.0, 0.0, 0.0, 1e-3, 2e-3], abs=1e-15)


def test_a_command_that_is_no_number_is_still_an_error() -> None:
    """It does not wait for the delay."""
    from softhand import Controller

    class Broken(Controller):
        def torque(self, observation: Any, memory: Any) -> Any:
            return np.full(N, np.nan), memory

    with pytest.raises(ControllerError, match="NaN or infinity"):
        build(load_scenario("target-a", {"actuation.delay": 0.002}), Broken()).run()


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        ({"actuation.delay": 0.0005}, r"actuation\.delay: got 0\.0005 s, but it must be a whole number of control"),
        ({"actuation.lag": -1.0}, r"actuation\.lag: got -1\.0, but it must be .*>= 0"),
        ({"actuation.lag": [0.001, 0.002]}, r"actuation\.lag: .* of length 2, but 9 joints need one number, or 9\."),
        ({"actuation.rate_limit": 0.0}, r"actuation\.rate_limit: got 0\.0, but it must be .*> 0"),
        ({"actuation.dely": 0.001}, r"actuation\.dely: unknown key .* Did you mean actuation\.delay\?"),
        (
            {"record.variables": ["time", "joint_torque_commanded"]},
            r"'joint_torque_commanded' is there under \[actuation\]",
        ),
    ],
)
def test_a_mistake_is_one_line_with_key_value_and_remedy(overrides: dict[str, Any], message: str) -> None:
    """And nothing runs."""
    with pytest.raises(ScenarioError, match=message) as caught:
        build(load_scenario("target-a", overrides))
    assert "\n" not in str(caught.value)
