"""The linear loop with instruments and drives in it, against runs, against delayed torques, and without them."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from commands import run_command
from nudged import grown, rate_of
from numpy.testing import assert_allclose

import softhand
from softhand.errors import ScenarioError
from softhand.margins.built import actuation_at, channel_at
from softhand.margins.delay import delay_margin, delayed_step
from softhand.margins.gains import gain_margin
from softhand.margins.groups import Groups
from softhand.margins.loop import Loop, close_loop, growth_of
from softhand.margins.modes import find_modes
from softhand.margins.place import Place, find_place
from softhand.scenario.scenario import Scenario, load_scenario
from softhand.sensing.quantities import QUANTITIES, Channel, Sensing, components
from softhand.simulation.actuation import Actuation

FINE = {"stepper.step": 1e-4}
"""Of runs that are to go as the plant does, not as its steps do."""


@lru_cache(1)
def ideal() -> tuple[Place, Loop]:
    place = find_place(load_scenario("hold"))
    return place, close_loop(place)


def pose(**values: float) -> dict[str, Any]:
    """Both instruments of a camera."""
    return {f"sensing.object_{name}": dict(values) for name in ("position", "orientation")}


# --------------------------------------------------------------------------------------------------------- against runs


def settled(loop: Loop, x: np.ndarray) -> np.ndarray:
    """(x, m) where instruments and drives have seen x for long, as before a run."""
    size, m = len(loop.step), loop.carried
    found, rows = np.zeros(size), loop.N[len(loop.N) - m :]
    found[: len(x)] = x
    found[size - m :] = np.linalg.solve(np.eye(m) - rows[:, size - m :], rows[:, : len(x)] @ x)
    return found


def velocities(scenario: Scenario, nudge: np.ndarray, count: int) -> np.ndarray:
    """Of a run from its start with other velocities."""
    simulation = softhand.build(scenario)
    start = simulation.save()
    simulation.reset(softhand.State(start.q, start.v + nudge, start.z))
    found = []
    for _ in range(count):
        simulation.sample()
        simulation.step()
        found.append(simulation.state.v.copy())
    return np.array(found)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("hold", {"actuation.delay": 2e-3}),
        ("hold", {"actuation.lag": 2e-3}),
        ("hold", {"actuation": {"delay": 1e-3, "lag": [5e-4, 0.0, 1e-3] * 3}}),
        ("hold", {"sensing.joint_velocity.delay": 3e-3}),
        ("hold", {"sensing.joint_position": {"filter": 100.0, "delay": 1e-3}}),
        ("hold", {"sensing.contact_force.filter": 50.0, "controller.K_N": 1.3}),
        ("hold", {"sensing.contact_normal.delay": 3e-3, "sensing.contact_compression.rate": 250.0}),
        pytest.param("hold", pose(rate=100.0, delay=4e-3, filter=80.0), marks=pytest.mark.slow),
        ("hold", {"sensing.object_velocity.delay": 2e-3, "sensing.object_angular_velocity.rate": 500.0,
                  "sensing.contact_torsion.delay": 1e-3, "sensing.joint_velocity.rate": 500.0}),
        ("hold", {"control_period": 2e-4, "controller.period": 1e-3, "actuation": {"lag": 5e-4, "delay": 4e-4},
                  "sensing.joint_velocity": {"rate": 2500.0, "filter": 300.0}}),
        ("object-impedance", {"sensing.object_orientation.delay": 2e-3, "sensing.object_velocity.filter": 100.0}),
        ("allegro-box", {"sensing.joint_velocity.filter": 100.0, "actuation.lag": 1e-3}),
        pytest.param(
            "finger-only", {"sensing.joint_velocity.delay": 2e-3, "actuation.lag": 1e-3}, marks=pytest.mark.slow
        ),
    ],
)  # fmt: skip
def test_a_run_goes_as_the_loop_says(name: str, values: dict[str, Any]) -> None:
    """The difference that random velocities make, over 30 control periods, to 0.1 % of the largest."""
    scenario = load_scenario(name, {**values, **FINE})
    loop = close_loop(find_place(scenario))
    nudge = 1e-6 * np.random.default_rng(2).normal(size=loop.moving)
    run = velocities(scenario, nudge, 30) - velocities(scenario, np.zeros(loop.moving), 30)
    begin = np.zeros(len(loop.A))
    begin[loop.moving : 2 * loop.moving] = nudge
    state, told = settled(loop, begin), np.empty_like(run)
    for k in range(30):
        state = loop.steps[k % len(loop.turns)] @ state
        told[k] = state[loop.moving : 2 * loop.moving]
    assert_allclose(run, told, rtol=0.0, atol=1e-3 * np.max(np.abs(told)))


@pytest.mark.parametrize(
    ("values", "grows", "seconds"),
    [
        ({"actuation.delay": 1e-3}, False, 1.0),
        ({"actuation.delay": 2e-3}, True, 0.35),
        ({"actuation.lag": 1e-3}, False, 1.0),
        ({"actuation.lag": 6e-3}, True, 1.5),
        pytest.param({"sensing.joint_velocity.delay": 1e-3}, False, 1.0, marks=pytest.mark.slow),
        pytest.param({"sensing.joint_velocity.delay": 2e-3}, True, 0.35, marks=pytest.mark.slow),
        (pose(filter=25.0), False, 1.5),
        (pose(filter=15.0), True, 1.5),
        pytest.param(pose(rate=100.0), False, 1.5, marks=pytest.mark.slow),
        pytest.param(pose(rate=40.0), True, 1.5, marks=pytest.mark.slow),
    ],
)
def test_a_small_motion_grows_or_dies_out_as_told(values: dict[str, Any], grows: bool, seconds: float) -> None:
    """Delay, lag, filter and hold on either side of where `hold` is lost: the rate of a run, to 5 %."""
    scenario = load_scenario("hold", {**values, **FINE})
    told = softhand.stability(scenario).held_growth
    measured = rate_of(grown(scenario, seconds), 1e-3, 0.3 * seconds)
    assert (told > 0.0) == (measured > 0.0) == grows and measured == pytest.approx(told, rel=0.05)


# -------------------------------------------------------------------------------------------------- against one another


TURNED = {"sensing.object_orientation.bias": [0.02, -0.03, 0.05], "sensing.contact_normal.bias": [-0.05, 0.02, 0.03]}


@pytest.mark.parametrize("biases", [{}, TURNED], ids=["exact", "turned by biases"])
@pytest.mark.parametrize("periods", [1, 3])
def test_a_delay_is_that_of_the_delay_margin(periods: int, biases: dict[str, Any]) -> None:
    """Of the drives, of all instruments, and of the torques that `delay_margin` has on their way: one growth."""
    place = find_place(load_scenario("hold", biases))
    told = growth_of(delayed_step(close_loop(place), place, 1e-3 * periods), place.period)
    drives = close_loop(find_place(load_scenario("hold", {**biases, "actuation.delay": 1e-3 * periods})))
    delays = {f"sensing.{name}.delay": 1e-3 * periods for name in QUANTITIES}
    instruments = close_loop(find_place(load_scenario("hold", {**biases, **delays})))
    assert drives.growth == pytest.approx(told, rel=1e-9)
    assert instruments.growth == pytest.approx(told, rel=1e-7)


def test_instruments_and_drives_that_take_no_time_change_nothing() -> None:
    """Filters that let all through, lags of no length, samples held for no time: the ideal loop, to 1e-9."""
    place, loop = ideal()
    world = place.setup.world
    sizes = components(world.n_joints, world.n_tips)
    channels = {name: Channel(np.zeros(size), np.zeros(size), share=1.0 - 1e-14) for name, size in sizes.items()}
    n = len(loop.inputs)
    drives = Actuation(0, np.full(n, np.inf), np.zeros(n), np.full(n, 1e-14), np.zeros(n))
    built = close_loop(replace(place, setup=replace(place.setup, sensing=Sensing(channels), actuation=drives)))
    size = len(loop.step)
    assert built.carried == sum(sizes.values()) + n
    assert_allclose(built.step[: len(loop.A), : len(loop.A)], loop.step[: len(loop.A), : len(loop.A)], atol=1e-9)
    values = sorted(np.linalg.eigvals(built.step), key=abs, reverse=True)[:size]
    assert_allclose(np.sort_complex(values), np.sort_complex(np.linalg.eigvals(loop.step)), atol=1e-9)
    assert built.growth == pytest.approx(loop.growth, abs=1e-9 / loop.period)
    bias = softhand.load_scenario("hold", {"sensing.joint_position.bias": 0.0, "actuation.delay": 0.0})
    assert_allclose(close_loop(find_place(bias)).step, loop.step, atol=1e-9)


def test_another_control_period_leaves_seconds_as_they_are() -> None:
    """Half as long: twice the periods, the same cut-off and lag; what comes between two is there at the later."""
    channel = Channel(np.zeros(1), np.zeros(1), delay=3, stride=2, share=1.0 - np.exp(-0.4))
    half = channel_at(channel, 0.5)
    assert (half.delay, half.stride) == (6, 4) and half.share == pytest.approx(1.0 - np.exp(-0.2))
    longer = channel_at(channel, 1.25)
    assert (longer.delay, longer.stride) == (3, 2) and longer.share == pytest.approx(1.0 - np.exp(-0.5))
    one, none = np.ones(1), np.zeros(1)
    drives = actuation_at(Actuation(2, np.inf * one, np.exp(-1.0 / 3.0) * one, one, none), 0.5)
    assert drives.delay == 4 and drives.decay[0] == pytest.approx(np.exp(-1.0 / 6.0))
    assert drives.mean[0] == pytest.approx(6.0 * (1.0 - np.exp(-1.0 / 6.0)))
    values = {**pose(delay=4e-3), "sensing.joint_velocity.filter": 150.0, "actuation.lag": 5e-4}
    slow = find_place(load_scenario("hold", values))
    fast = find_place(load_scenario("hold", {**values, "control_period": 5e-4, "stepper.step": 5e-4}))
    assert close_loop(slow, 5e-4).growth == pytest.approx(close_loop(fast).growth, rel=1e-6)


# -------------------------------------------------------------------------------------------------------------- scatter


@pytest.mark.parametrize(
    "values",
    [
        pytest.param(
            {"sensing.joint_velocity.filter": 200.0, "sensing.joint_position.filter": 50.0},
            marks=pytest.mark.slow,
            id="filtered",
        ),
        pytest.param(pose(rate=100.0), marks=pytest.mark.slow, id="held"),
    ],
)
def test_noisy_runs_scatter_as_told(values: dict[str, float]) -> None:
    """Position, attitude, internal force and torque of 32 runs, each axis, to 12 %."""
    noise = {
        "sensing.object_position.noise": 2e-5, "sensing.object_orientation.noise": 2e-4,
        "sensing.joint_position.noise": 1e-4, "sensing.joint_velocity.noise": 2e-3, "actuation.noise": 2e-4,
    }  # fmt: skip
    scenario = load_scenario("hold", {**noise, "duration": 3.0}).with_values(values)
    told = softhand.stability(scenario).scatter
    plain = softhand.stability(load_scenario("hold", noise)).scatter
    assert not np.allclose(told.torque, plain.torque, rtol=0.12)  # it matters
    seeds = {"sensing.seed": range(1, 33), "actuation.seed": range(1, 33)}
    expected = {"object_position": told.position, "object_rpy": told.turn, "internal_force": told.internal_force,
                "joint_torque": told.torque}  # fmt: skip
    runs = softhand.rollout(scenario, seeds, every=0.007, variables=list(expected))
    assert runs.finished.all()
    for name, std in expected.items():
        assert_allclose(getattr(runs, name)[:, 143:].std(axis=(0, 1)), std, rtol=0.12)


# -------------------------------------------------------------------------------------------------------- what is told


def test_what_is_kept_has_names_and_its_share_of_the_modes() -> None:
    """A number each, all shares of a mode add up to 1, those that are over in some periods among them."""
    values = {**pose(delay=2e-3, rate=500.0), "sensing.joint_velocity.filter": 150.0, "actuation": {"delay": 1e-3}}
    place = find_place(load_scenario("hold", values))
    loop = close_loop(place)
    assert len(loop.states) == len(loop.state_units) == len(loop.step) and loop.carried == 6 * 3 + 9 + 9
    assert "object_position x: 2 control periods ago" in loop.states
    assert "torque of finger_1_abduction: 1 control period ago" in loop.states
    modes = find_modes(loop, Groups(place.plant, place.state.q))
    assert_allclose([sum(mode.shares.values()) for mode in modes], 1.0, atol=1e-9)
    assert any(mode.shares.get("instruments and drives", 0.0) > 0.5 for mode in modes)
    rate = complex(modes[0].growth, 2.0 * np.pi * modes[0].frequency)
    assert np.exp(rate * loop.cycle) == pytest.approx(complex(*modes[0].multiplier), rel=1e-9)
    assert loop.cycle == 2e-3 and not loop.is_smooth


def test_rounding_and_rate_limits_are_told_as_left_out(tmp_path) -> None:
    """Those alone; the table is the command's, and JSON has the loop."""
    values = {"sensing.joint_position": {"quantisation": 1e-5, "filter": 200.0}, "actuation.rate_limit": 50.0}
    rows = dict(softhand.stability(load_scenario("hold", values)).rows())
    assert rows["left out of the loop"] == "sensing.joint_position.quantisation, actuation.rate_limit"
    arguments = ["--set", "sensing.joint_velocity.filter=200", "--json"]
    result = run_command("stability", "hold", *arguments, folder=tmp_path)
    assert result.returncode == 0, result.stderr
    told = json.loads(result.stdout)
    assert told["loop"]["carried"] == 9 and told["period"] == 1e-3 and told["growth"] is None


def test_margins_are_those_of_the_built_loop() -> None:
    """What a lag leaves of the delay, in quarters of a period: the last below dies out, the next grows."""
    values = {"control_period": 2.5e-4, "controller.period": 1e-3, "stepper.step": 2.5e-4, "actuation.lag": 1e-3}
    place = find_place(load_scenario("hold", values))
    loop = close_loop(place)
    margin = delay_margin(loop, place)
    below = int(margin / 2.5e-4)
    assert margin == pytest.approx(6.9e-4, rel=0.01)  # 1.48 ms without the lag
    for late in (below, below + 1):
        growth = close_loop(find_place(load_scenario("hold", {**values, "actuation.delay": 2.5e-4 * late}))).growth
        assert (growth > 0.0) == (late > below)
        assert growth == pytest.approx(growth_of(delayed_step(loop, place, 2.5e-4 * late), loop.cycle), rel=1e-6)


def test_gains_may_go_as_far_as_the_built_loop_lets_them() -> None:
    """K_v behind a filter, whose memory has the gain in it too: 1 % below is stable, 1 % above is not."""
    values = {"sensing.joint_velocity.filter": 200.0}
    place = find_place(load_scenario("hold", values))
    loop = close_loop(place)
    high = gain_margin(loop, place, "K_v").factors.high
    assert high > 6.0  # 3.8 without the filter
    for factor in (0.99 * high, 1.01 * high):
        scenario = load_scenario("hold", {**values, "controller.K_v": 0.03 * factor})
        assert (close_loop(find_place(scenario)).growth > 0.0) == (factor > high)


def test_samples_that_hardly_ever_meet_are_refused(tmp_path) -> None:
    """With the keys, and what helps."""
    rates = {"object_position": 1e3 / 37, "object_orientation": 1e3 / 41}
    values = {f"sensing.{name}.rate": rate for name, rate in rates.items()}
    with pytest.raises(ScenarioError, match=r"every 37, 41 control periods are together only every 1517"):
        softhand.stability(load_scenario("hold", values))
    arguments = [word for key, rate in values.items() for word in ("--set", f"{key}={rate!r}")]
    result = run_command("stability", "hold", *arguments, folder=tmp_path)
    assert result.returncode == 1 and result.errors.startswith("error: sensing.object_position.rate")
    assert "give rates that divide one another" in result.stderr and "Traceback" not in result.stderr
