"""A simulation without a controller, and torques that the caller gives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from softhand import Controller, ScenarioError, Simulation, build, load_scenario
from softhand.assembly.parts import read_stepper


def bare(name: str = "target-a", **values: Any) -> Simulation:
    """A scenario without its controller, for 30 ms."""
    scenario = load_scenario(name, {"duration": 0.03, **{k.replace("__", "."): v for k, v in values.items()}})
    made = build(scenario)
    return Simulation(made.plant, made.state, None, read_stepper(scenario), made.reference, scenario.duration,
                      scenario.control_period, made.scenario)  # fmt: skip


def wave(time: float, n: int = 9) -> np.ndarray:
    """Torques that change, other at each joint [N m]."""
    return 0.3 * np.sin(40.0 * time + np.arange(n))


class Waving(Controller):
    """The same by a controller."""

    def torque(self, observation: Any, memory: Any) -> Any:
        return wave(observation.time), memory


def test_given_torques_do_what_those_of_a_controller_do() -> None:
    """The same states to the last bit, several steps a period, with and without asking to observe in between."""
    values = {"stepper.step": 2.5e-4, "fingertip.contact": "coulomb", "duration": 0.03}
    driven = build(load_scenario("target-a", values), Waving())
    runs = [bare(stepper__step=2.5e-4, fingertip__contact="coulomb") for _ in range(2)]
    for k in range(20):
        driven.sample()
        driven.step()
        for i, simulation in enumerate(runs):
            if i == 0:
                simulation.sample()
            simulation.step(wave(simulation.time))
            assert np.array_equal(simulation.torque, driven.torque)
            assert all(map(np.array_equal, simulation.state.arrays, driven.state.arrays)), (k, i)
            assert simulation.time == driven.time


def test_given_torques_take_the_place_of_the_controllers() -> None:
    """`step(torque)` after a sample holds what is given; the next sample asks the controller again."""
    simulation, other = build(load_scenario("target-a", {"duration": 0.03})), bare()
    asked = simulation.sample().copy()
    command = simulation.torque.copy()
    simulation.step(command + 0.1)
    other.step(command + 0.1)
    assert all(map(np.array_equal, simulation.state.arrays, other.state.arrays))
    simulation.sample()
    assert np.abs(simulation.torque - command).max() < 0.09  # its own again
    assert asked.time == 0.0


def test_no_torque_is_given_no_torque_is_there() -> None:
    """A run without a controller: zero torques, all samples, and the fingers let the object fall."""
    simulation = bare(fingertip__contact="coulomb", duration=0.05)
    recording = simulation.run()
    assert recording.complete and len(recording) == 51
    assert not recording.joint_torque.any() and not recording.torque_limited.any()
    away = bare(duration=0.05, fingertip__contact="coulomb")
    away.state.q[-7:-4] += (0.5, 0.0, 0.0)
    away.state.z[:] = 0.0
    start = away.state.q[-5]
    for _ in range(50):
        away.sample()
        away.step()
    assert_allclose(away.state.q[-5] - start, -0.5 * 9.81 * 0.05**2, rtol=1e-9)  # in free fall
    fallen = recording.object_position[-1, 2] - recording.object_position[0, 2]
    assert -0.5 * 9.81 * 0.05**2 < fallen < -0.002


def test_the_last_torque_is_held_until_another_is_given() -> None:
    """`step()` without an argument holds what was given before; `reset` takes it away."""
    simulation, other = bare(), bare()
    simulation.step(wave(0.0))
    simulation.step()
    for _ in range(2):
        other.step(wave(0.0))
    assert all(map(np.array_equal, simulation.state.arrays, other.state.arrays))
    simulation.reset()
    assert not simulation.torque.any()


def test_effort_limits_hold_for_given_torques() -> None:
    """Beyond the limit of the URDF they are cut and marked; the array that was given stays as it is."""
    simulation, given = bare(), np.array([5.0, -5.0, 1.5, *np.zeros(6)])
    kept = given.copy()
    simulation.step(given)
    assert_allclose(simulation.torque[:3], [2.0, -2.0, 1.5])
    assert simulation.torque_limited.tolist() == [1, 1, 0, *[0] * 6]
    assert np.array_equal(given, kept)
    given[:] = 0.0  # of the caller: what is held does not follow
    assert simulation.torque[2] == 1.5
    simulation.step(list(wave(0.0)))
    assert np.array_equal(simulation.torque, wave(0.0)) and not simulation.torque_limited.any()


@pytest.mark.parametrize(
    "given",
    [np.zeros(8), np.zeros((9, 1)), 0.5, [], np.full(9, np.nan), [np.inf, *[0.0] * 8], "full power", [None] * 9,
     np.zeros(9, complex), [[1.0], [2.0, 3.0]]],
    ids=str,
)  # fmt: skip
def test_what_is_no_torque_is_refused(given: Any) -> None:
    """One message with what was given and how many joints there are; nothing has moved."""
    simulation = bare()
    simulation.step(wave(0.0))
    before = simulation.save()
    with pytest.raises(
        ScenarioError, match=r"(?s)torque: got .*; the hand has 9 joints, give a finite number for each"
    ):
        simulation.step(given)
    assert all(map(np.array_equal, simulation.state.arrays, before.arrays))
    assert np.array_equal(simulation.torque, wave(0.0)) and simulation.time == before.time
