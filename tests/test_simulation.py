"""The loop: what it asks of controllers, what it records, how it ends."""

import numpy as np
import pytest

from softhand import Controller, ControllerError, ScenarioError, SimulationStopped, build, load_scenario, simulate

SHORT = {"duration": 0.02}


class Hold(Controller):
    """Gravity compensation and the contact forces of the start."""

    def start(self, observation):
        return observation.J_CF.T @ observation.contact_force.ravel()

    def torque(self, observation, memory):
        return memory + observation.N_F, memory


def scenario(**values):
    return load_scenario("target-a", {**SHORT, **values})


def controller(function, **fields):
    """A controller whose torque is `function(observation)`."""

    class Made(Controller):
        def torque(self, observation, memory):
            return function(observation), memory

    return Made(**fields)


def test_samples_lie_one_control_period_apart_and_include_both_ends():
    """A run of 20 ms at 1 ms has 21 samples, 0 to 20 ms."""
    recording = simulate(scenario())
    np.testing.assert_allclose(recording.time, np.arange(21) * 1e-3, atol=1e-15)
    assert recording.complete and recording.stop_time == pytest.approx(0.02)


def test_holding_torques_hold():
    """The torques of the start keep the grasp at rest."""
    recording = simulate(load_scenario("target-a", {"duration": 0.2}), Hold())
    assert np.max(np.abs(recording.object_position - recording.object_position[0])) < 1e-9
    assert np.max(np.abs(recording.joint_velocity)) < 1e-7


def test_running_twice_gives_the_same_bits():
    """`run` begins at the start each time."""
    simulation = build(scenario())
    first, second = simulation.run(), simulation.run()
    for name, values in first.variables.items():
        assert np.array_equal(values, second[name]), name


def test_the_resolved_scenario_repeats_the_run(tmp_path):
    """A run from the recording's own scenario text gives the same bits."""
    first = simulate(scenario(**{"object.mass": 0.25}))
    file = tmp_path / "again.toml"
    file.write_text(first.scenario)
    second = simulate(load_scenario(file))
    assert np.array_equal(first.object_position, second.object_position)
    assert np.array_equal(first.joint_torque, second.joint_torque)


def test_torque_is_held_over_a_control_period():
    """With four steps a period the controller is still called once a period."""
    calls = []

    def count(observation):
        calls.append(observation.time)
        return np.zeros(9)

    simulate(scenario(duration=0.004, **{"stepper.step": 0.00025}), controller(count))
    np.testing.assert_allclose(calls, [0.0, 0.001, 0.002, 0.003, 0.004])


def test_a_controller_may_have_a_slower_rate():
    """A controller with a period of 5 ms is called every fifth control period and its torque is held."""
    calls = []

    def count(observation):
        calls.append(observation.time)
        return np.full(9, 0.01 * len(calls))

    recording = simulate(scenario(duration=0.012), controller(count, period=0.005))
    np.testing.assert_allclose(calls, [0.0, 0.005, 0.010])
    np.testing.assert_allclose(recording.joint_torque[:, 0], [0.01] * 5 + [0.02] * 5 + [0.03] * 3)


def test_a_rate_that_does_not_fit_is_refused():
    """A controller period that is no whole number of control periods is an error with the key."""
    with pytest.raises(ScenarioError, match=r"controller\.period.*0\.0015"):
        build(scenario(), controller(lambda observation: np.zeros(9), period=0.0015))


def test_memory_goes_in_and_comes_back():
    """What `torque` returns as memory is what it gets at the next call."""

    class Count(Controller):
        def start(self, observation):
            return 0

        def torque(self, observation, memory):
            assert memory == round(observation.time / 1e-3)
            return np.zeros(9), memory + 1

    assert simulate(scenario(), Count()).complete


def test_effort_limits_are_applied_and_recorded():
    """A torque beyond the URDF's limit is cut to it, and marked."""
    recording = simulate(scenario(duration=0.001), controller(lambda observation: np.array([5.0, -5.0] + [0.0] * 7)))
    np.testing.assert_array_equal(recording.joint_torque[0, :3], [2.0, -2.0, 0.0])
    np.testing.assert_array_equal(recording.torque_limited[0, :3], [1, 1, 0])


@pytest.mark.parametrize(
    ("result", "words"),
    [
        (lambda seen: np.full(9, np.nan), "NaN"),
        (lambda seen: np.zeros(8), r"shape \(8,\)"),
        (lambda seen: "full power", "no array of real numbers"),
        (lambda seen: 1 / 0, "ZeroDivisionError"),
        (lambda seen: np.add(seen.q_F, 1.0, out=seen.q_F), "ValueError: .*read-only"),
    ],
)
def test_a_wrong_torque_is_named(result, words):
    """A controller that returns NaN, the wrong shape, no numbers, or raises, is named with the time."""
    with pytest.raises(ControllerError, match=rf"'Made'.*{words}.*t = 0\.005 s") as caught:
        simulate(scenario(), controller(lambda seen: np.zeros(9) if seen.time < 0.0045 else result(seen)))
    assert caught.value.time == pytest.approx(0.005)
    assert len(caught.value.recording) == 5 and not caught.value.recording.complete


def test_a_controller_without_memory_in_its_result_is_told_so():
    """Returning the torque alone gives a message that says what is missing."""

    class Forgetful(Controller):
        def torque(self, observation, memory):
            return np.zeros(9)

    with pytest.raises(ControllerError, match="torque and its memory"):
        simulate(scenario(), Forgetful())


def test_an_interrupted_run_keeps_its_samples():
    """Ctrl-C ends a run with the samples so far, marked with reason and time."""

    def interrupt(observation):
        if observation.time > 0.0095:
            raise KeyboardInterrupt
        return np.zeros(9)

    with pytest.raises(SimulationStopped) as caught:
        simulate(scenario(), controller(interrupt))
    recording = caught.value.recording
    assert caught.value.reason == "interrupted"
    assert len(recording) == 10 and not recording.complete and "interrupted" in recording.reason


def test_a_diverging_run_stops_with_the_last_good_time():
    """Explicit Euler at 1 ms leaves the model and says when; all samples before are there."""
    with pytest.raises(SimulationStopped) as caught:
        simulate(load_scenario("target-a", {"stepper": {"name": "semi-implicit-euler", "step": 0.001}}))
    recording = caught.value.recording
    assert 0.0 < recording.stop_time < 2.0
    assert np.all(np.isfinite(recording.object_position))
    assert f"t = {recording.stop_time:g} s" in str(caught.value)


def test_velocities_beyond_reason_count_as_divergence():
    """A torque that flings the fingers ends in an error that says diverged or names the finger that left."""
    push = controller(lambda observation: np.full(9, 2.0))
    with pytest.raises(SimulationStopped) as caught:
        simulate(load_scenario("target-a", {"duration": 1.0}), push)
    assert caught.value.reason in {"diverged", "flat", "apex", "rim"}


def test_progress_is_reported_to_the_end():
    """The progress function gets rising times, the last the duration."""
    times = []
    simulate(scenario(duration=0.1), progress=times.append)
    assert times == sorted(times) and times[-1] == pytest.approx(0.1)


def test_observation_arrays_agree_with_each_other():
    """J_CF and J_O put the rows of forces and moments of each contact together; M_F and M_O are symmetric."""
    simulation = build(scenario())
    simulation.run()
    seen = simulation.observation
    rows = seen.J_CF.reshape(3, 4, 9)
    np.testing.assert_array_equal(rows[:, :3].reshape(9, 9), seen.J_CF_f)
    np.testing.assert_array_equal(rows[:, 3], seen.J_CF_tau)
    np.testing.assert_array_equal(seen.J_O.reshape(3, 4, 6)[:, 3], seen.J_O_tau)
    np.testing.assert_array_equal(seen.M_F, seen.M_F.T)
    np.testing.assert_allclose(seen.M_O[:3, :3], 0.2 * np.eye(3), atol=1e-12)
    assert np.all(np.linalg.eigvalsh(seen.M_F) > 0)


def test_driving_by_hand_is_what_run_does():
    """reset, sample and step, a period at a time, give the samples of `run`, also when begun anew."""
    simulation = build(scenario())
    recording = simulation.run()
    for _ in range(2):
        simulation.reset()
        for k in range(20):
            seen = simulation.sample()
            assert simulation.time == pytest.approx(1e-3 * k) and seen.time == simulation.time
            assert np.array_equal(seen.object_position, recording.object_position[k])
            assert np.array_equal(simulation.torque, recording.joint_torque[k])
            simulation.step()


def test_the_torque_is_open_to_the_caller_between_sample_and_step():
    """What the caller writes to `torque` after `sample` is what `step` holds."""
    simulation = build(scenario())
    simulation.sample()
    simulation.torque[:] = 0.0
    simulation.step()
    assert simulation.sample().joint_velocity[1] != 0.0


def test_a_step_that_cannot_be_made_ends_at_the_sample_before_it():
    """When the stepper gives up, the time in the error is that of the last sample in the recording."""
    simulation = build(scenario())
    advance = simulation.integration.advance

    def give_up_after_three(state, torque):
        if simulation.time > 0.0025:
            raise FloatingPointError("no step is short enough")
        advance(state, torque)

    simulation.integration.advance = give_up_after_three
    with pytest.raises(SimulationStopped, match=r"no step is short enough.*t = 0\.003 s") as caught:
        simulation.run()
    assert caught.value.time == caught.value.recording.stop_time == 0.003
