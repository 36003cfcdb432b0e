"""The rate and the delay of taxels: which sample is read when, in both loops, in saved runs and in environments."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import softhand
from softhand.errors import ScenarioError
from softhand.recording.recording import Recording
from softhand.tactile.taxels import Taxels

FIELDS = ("tactile_normal_force", "tactile_shear_force", "tactile_slip", "penetration_depth")
SLIPPING = {
    "fingertip.contact": "coulomb",
    "fingertip.friction": 0.42,
    "reference.duration": 0.04,
    "duration": 0.03,
    "tactile.count": 20,
}
ERRING = {"tactile.noise": 0.01, "tactile.shear_noise": 0.004, "tactile.dead": [3], "tactile.seed": 4}
TIMES = {"late": (0.003, None), "slow": (0.0, 250.0), "both": (0.003, 250.0), "long": (0.011, 500.0)}


def timed(delay: float, rate: float | None) -> dict[str, Any]:
    """Keys."""
    return {"tactile.delay": delay} | ({"tactile.rate": rate} if rate else {})


def sources(delay: float, rate: float | None, count: int = 31) -> Any:
    """In which control period the sample was taken that is read in each; before the run there were some as well."""
    stride = round(1e3 / rate) if rate else 1
    return (np.arange(count) - round(1e3 * delay)) // stride * stride


def run(**more: Any) -> Recording:
    """Of the main job with tips that slip."""
    return softhand.simulate("target-a", overrides=SLIPPING | more)


@pytest.fixture(scope="module")
def ideal() -> Recording:
    """At once."""
    return run()


@pytest.mark.parametrize("times", TIMES)
def test_what_is_read_is_the_last_sample_that_has_arrived(ideal, times):
    """All four numbers of each taxel, to the last bit; before the first sample arrives, it; the run is the same."""
    late = run(**timed(*TIMES[times]))
    taken = np.maximum(sources(*TIMES[times]), 0)
    for name in FIELDS:
        assert np.array_equal(late[name], ideal[name][taken])
        assert not np.array_equal(late[name], ideal[name])
    assert all(np.array_equal(late[name], ideal[name]) for name in set(ideal.variables) - set(FIELDS))


def test_noise_belongs_to_the_sample(ideal):
    """It is that of the control period in which it was taken; samples from before the run have noise of their own."""
    at_once, late = run(**ERRING), run(**ERRING, **timed(*TIMES["both"]))
    taken = sources(*TIMES["both"])
    for name in FIELDS:
        assert np.array_equal(late[name][taken >= 0], at_once[name][taken[taken >= 0]])
    before = late.tactile_normal_force[taken < 0] - ideal.tactile_normal_force[0]
    alive = np.arange(20) != 2
    assert taken[0] == -4 and np.all(before[0] == before[-1])
    assert 0.006 < np.std(before[0][:, alive]) < 0.014
    assert np.all(before[0][:, alive] != (at_once.tactile_normal_force - ideal.tactile_normal_force)[0][:, alive])


def test_hysteresis_is_of_the_skin_and_goes_on_between_samples():
    """What a slow taxel reads is what one at once read when its sample was taken."""
    held = {"tactile.hysteresis": 0.3}
    at_once, slow = run(**held), run(**held, **timed(*TIMES["both"]))
    assert np.any(at_once.tactile_normal_force != run().tactile_normal_force)
    for name in FIELDS:
        assert np.array_equal(slow[name], at_once[name][np.maximum(sources(*TIMES["both"]), 0)])


def test_the_compiled_loop_reads_the_same():
    """`rollout` and `simulate`, samples further apart as well, and other delays in a run after it: within 1e-10."""
    scenario = softhand.load_scenario("target-a", SLIPPING | ERRING | timed(*TIMES["both"]))
    delays = [0.003, 0.0, 0.007, 0.003]
    runs = softhand.rollout(scenario, {"tactile.delay": delays}, variables=FIELDS, every=0.002, threads=1)
    assert runs.compiled.all()
    for k, delay in enumerate(delays):
        recording = softhand.simulate(scenario.replace({"tactile.delay": delay}))
        for name in FIELDS:
            np.testing.assert_allclose(runs[name][k], recording[name][::2], atol=1e-10)


def test_a_run_that_is_saved_goes_on_with_the_samples_on_their_way():
    """To the last bit, wherever it is cut; with other samples on their way it cannot."""
    overrides = SLIPPING | ERRING | timed(0.005, 250.0) | {"tactile.hysteresis": 0.2}
    simulation = softhand.build("target-a", overrides=overrides)
    whole, other = simulation.run(), softhand.build("target-a", overrides=overrides)
    simulation.reset()
    for k in range(11):
        if k in (1, 9):
            rest = other.run(start=simulation.save())
            assert all(np.array_equal(rest[name], whole[name][k:]) for name in FIELDS)
        simulation.sample()
        if k == 10:
            rest = other.run(start=simulation.save())
            assert all(np.array_equal(rest[name], whole[name][k:]) for name in FIELDS)
        simulation.step()
    with pytest.raises(ScenarioError, match=r"\[tactile\]"):
        softhand.build("target-a", overrides=SLIPPING | timed(0.02, None)).reset(simulation.save())


def test_a_second_run_begins_without_the_slip_of_the_first():
    """All variables, to the last bit, though the first run ended in slip."""
    simulation = softhand.build("target-a", overrides=SLIPPING)
    first, second = simulation.run(), simulation.run()
    assert first.is_slipping[-1].any() and first.tactile_slip[-1].max() > 0.0
    assert all(np.array_equal(first[name], second[name]) for name in first.variables)


def test_a_sample_that_is_asked_for_again_is_the_same():
    """Twice in one control period, at the start and later."""
    simulation = softhand.build("target-a", overrides=SLIPPING | ERRING | timed(*TIMES["both"]))
    for _ in range(6):
        first, second = (simulation.sample().copy() for _ in range(2))
        assert all(np.array_equal(getattr(first, name), getattr(second, name)) for name in FIELDS)
        simulation.step()


@pytest.mark.parametrize("more", [{}, {"sensing.contact_force.noise": 0.1}], ids=["plain", "seen"])
def test_a_controller_sees_what_has_arrived(more):
    """As a recording has it, through instruments as well."""
    seen = []

    class Feeling(softhand.Controller):
        def torque(self, observation, memory):
            seen.append([getattr(observation, name).copy() for name in FIELDS])
            return observation.gravity_torque, memory

    overrides = SLIPPING | timed(*TIMES["both"]) | {"duration": 0.01} | more
    recording = softhand.simulate("target-a", Feeling(), overrides=overrides)
    for k, name in enumerate(FIELDS):
        assert np.array_equal(np.array([row[k] for row in seen[-11:]]), recording[name])


class Touchy(softhand.Controller):
    """A formula of a user that reads taxels."""

    @staticmethod
    def formula(observed: Any, settings: Any, memory: Any, torque: Any) -> None:
        for j in range(torque.shape[0]):
            torque[j] = 0.02 * observed.tactile_normal_force[j % 3, 2 * j]


@pytest.mark.parametrize("more", [{}, {"sensing.contact_force.noise": 0.1}], ids=["plain", "seen"])
def test_a_compiled_law_reads_what_has_arrived_in_both_loops(more):
    """The torque is told by the taxels that are recorded, though samples of the batch lie further apart."""
    scenario = softhand.load_scenario("target-a", SLIPPING | ERRING | timed(0.003, 500.0) | {"duration": 0.01} | more)
    recording = softhand.build(scenario, Touchy()).run()
    felt = recording.tactile_normal_force
    expected = 0.02 * np.stack([felt[:, j % 3, 2 * j] for j in range(recording.joint_torque.shape[1])], axis=1)
    np.testing.assert_allclose(recording.joint_torque, expected, atol=1e-15)
    names = ("joint_torque", *FIELDS)
    runs = softhand.rollout(scenario, {"mass": [0.2]}, Touchy(), variables=names, every=0.005)
    single = softhand.build(scenario.replace({"object.mass": 0.2}), Touchy()).run()
    assert runs.compiled.all()
    for name in names:
        np.testing.assert_allclose(runs[name][0], single[name][::5], atol=1e-10)


def test_environments_observe_what_has_arrived():
    """What an environment with late taxels sees after a step, one at once saw a step before."""
    gymnasium = pytest.importorskip("gymnasium", reason="needs the extra gym: pip install 'softhand[gym]'")
    pytest.importorskip("softhand.envs")
    options: dict[str, Any] = {"overrides": {"tactile.count": 12}, "randomise": {}}
    rows = []
    for delay in (0.0, 0.02):
        options["overrides"]["tactile.delay"] = delay
        env: Any = gymnasium.make("softhand/HoldBoxTactile-v0", action_period=0.02, **options).unwrapped
        env.reset(seed=3)
        env.action_space.seed(3)
        seen = [env.episodes.worlds.seen["tactile_normal_force"].copy()]
        for _ in range(4):
            env.step(env.action_space.sample())
            seen.append(env.episodes.worlds.seen["tactile_normal_force"].copy())
        rows.append(np.array(seen))
        env.close()
    at_once, late = rows
    assert np.array_equal(late[1:], at_once[:-1]) and np.array_equal(late[0], at_once[0])
    assert not np.array_equal(at_once[1:], at_once[:-1])


@pytest.mark.parametrize(("key", "value", "names"), [
    ("delay", -0.001, "tactile.delay"), ("delay", 0.0015, "tactile.delay: got 0.0015 s, but it must be a whole number"),
    ("delay", 11.0, "it may be at most 10 s, 10000 control periods"), ("rate", 0.0, "tactile.rate"),
    ("rate", 2000.0, "tactile.rate: got 2000 Hz, but the controller asks 1000 times"),
    ("rate", 300.0, "the nearest good value is 333.3"), ("dealy", 0.1, "Did you mean tactile.delay"),
    ("delay", 10.0, "samples of 60 taxels"),
])  # fmt: skip
def test_wrong_times_are_named(key, value, names, monkeypatch):
    """The key, the value and what is good; a line that would take all memory as well."""
    monkeypatch.setattr("softhand.assembly.taxels.MOST_NUMBERS", 1_000_000)
    with pytest.raises(ScenarioError, match=names) as error:
        softhand.build("target-a", overrides=SLIPPING | {f"tactile.{key}": value})
    assert "\n" not in str(error.value)


def test_no_more_samples_are_kept_than_are_on_their_way():
    """None at once; with a rate one more than fit into the delay."""
    places, dead = np.zeros((12, 3)), np.zeros((1, 12), bool)
    for stride, delay, rows in ((1, 0, 0), (4, 0, 1), (1, 3, 4), (4, 3, 2), (4, 4, 2), (4, 5, 3)):
        assert Taxels(places, dead, stride=stride, delay=delay).reading().line.shape[0] == rows
