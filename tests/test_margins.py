"""Modes and margins of closed loops, against formulas, and against runs just within and just beyond each margin."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from commands import run_command
from numpy.testing import assert_allclose
from test_attitude import turned

import softhand
from softhand.controllers.controller import Controller
from softhand.controllers.regulation import Regulation
from softhand.errors import ControllerError, RecordingError, ScenarioError, SimulationStopped, SofthandError
from softhand.margins.delay import delay_margin, delayed_step
from softhand.margins.gains import joint_margins
from softhand.margins.groups import Groups
from softhand.margins.loop import Loop, close_loop, growth_of
from softhand.margins.mode_recording import beside
from softhand.margins.modes import find_modes
from softhand.margins.period import growth_at
from softhand.margins.place import Place, find_place
from softhand.margins.scatter import _answers
from softhand.margins.search import edge, first_edge, stable_range
from softhand.margins.stability import Stability
from softhand.numerics.spatial import rotation_of
from softhand.scenario.scenario import Scenario, load_scenario
from softhand.simulation.simulation import Simulation

FINE = {"stepper.step": 1e-4}
"""Of runs that are to grow as the plant does, not as its steps do."""


@lru_cache(2)
def of(name: str) -> Stability:
    return softhand.stability(name, with_margins=True)


@lru_cache(1)
def holding() -> Place:
    return find_place(load_scenario("hold"))


def first_order(a: float, k: float, period: float = 0.1) -> Loop:
    """x' = a x + u with u = -k x held for a period, in the shape of a loop with one joint and nothing else."""
    A, B = np.exp(a * period), (np.exp(a * period) - 1.0) / a
    return Loop(
        period=period, A=np.array([[A]]), B=np.array([[B]]), K=np.array([[-k]]), N=np.zeros((0, 1)), states=("x",),
        state_units=("rad",), inputs=("joint",), input_units=("N m",), moving=0, remembered=0, switches=(),
        C=np.eye(1), outputs=("x",), output_units=("rad",),
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------- against formulas


def test_torque_range_of_a_first_order_plant() -> None:
    """|A - B k g| < 1: g from (A - 1) / (B k) to (A + 1) / (B k), and all joints are the one joint."""
    loop = first_order(2.0, 5.0)
    A, B = loop.A[0, 0], loop.B[0, 0]
    every, joint = joint_margins(loop)
    assert_allclose(joint.factors, [(A - 1.0) / (5.0 * B), (A + 1.0) / (5.0 * B)], rtol=2e-4)
    assert every.factors == joint.factors and every.joint == "all joints" and np.isnan(every.disk)


def test_disk_margin_of_a_first_order_plant() -> None:
    """1 / max |S - 1/2| with S = (z - A) / (z - A + B k), on a circle of a million points."""
    loop = first_order(2.0, 5.0)
    z = np.exp(1j * np.linspace(0.0, np.pi, 1_000_001))
    S = (z - loop.A[0, 0]) / (z - loop.A[0, 0] + 5.0 * loop.B[0, 0])
    alpha = 1.0 / np.max(np.abs(S - 0.5))
    joint = joint_margins(loop)[1]
    assert joint.disk == pytest.approx(alpha, rel=1e-3)
    low, high = joint.factors
    assert low < 1.0001 / joint.gain and joint.gain < high  # what holds with any phase holds with none
    assert joint.phase == pytest.approx(2.0 * np.degrees(np.arctan(0.5 * joint.disk)))


def test_a_period_of_delay_of_a_first_order_plant() -> None:
    """z^2 - A z + B k = 0 with one period, z^3 - A z^2 + B k = 0 with two."""
    loop = first_order(2.0, 5.0)
    A, Bk = loop.A[0, 0], 5.0 * loop.B[0, 0]
    for periods, powers in ((0, [1.0, Bk - A]), (1, [1.0, -A, Bk]), (2, [1.0, -A, 0.0, Bk])):
        step = delayed_step(loop, holding(), periods * loop.period)
        found = np.sort_complex(np.linalg.eigvals(step).astype(complex))
        assert_allclose(found, np.sort_complex(np.roots(powers).astype(complex)), atol=1e-12)


def test_edges_are_found_from_either_side() -> None:
    """Of growth rates that are formulas; ranges that do not have 1 are the nearest."""
    assert edge(lambda x: x - 3.0, 1.0, 8.0) == pytest.approx(3.0, rel=2e-4)
    assert first_edge(lambda x: x - 3.0, [0.0, 1.0, 2.0, 4.0]) == pytest.approx(3.0, rel=2e-4)
    assert np.isnan(first_edge(lambda x: 1.0, [0.0, 1.0])) and np.isinf(first_edge(lambda x: -1.0, [0.0, 1.0]))
    assert_allclose(stable_range(lambda x: (x - 2.0) * (x - 9.0)), [2.0, 9.0], rtol=3e-4)
    assert stable_range(lambda x: -1.0) == (0.0, np.inf) and not stable_range(lambda x: np.nan).has_now
    assert str(stable_range(lambda x: x - 2.0)) == "below 2" and str(stable_range(lambda x: 1.0 - 2 * x)) == "above 0.5"


def test_the_share_of_the_object_is_its_energy() -> None:
    """m |v|^2 of the centre of mass and w^T I w about it; a finger has what is left; they add up to 1."""
    place = holding()
    plant, q = place.plant, place.state.q
    groups, n = Groups(plant, q), plant.world.n_joints
    inertia = plant.world.model.inertias[plant.world.object_joint]
    motion = np.random.default_rng(0).normal(size=(n + 6, 2)) @ [1.0, 1j]
    shares = groups.shares(motion)
    M = plant.rigid.mass_matrix(q)
    whole = (motion.conj() @ (np.tril(M) + np.tril(M, -1).T) @ motion).real
    v, w = motion[n : n + 3], motion[n + 3 :]
    centre = v + np.cross(w, inertia.lever)
    for axis, one in zip("xyz", inertia.mass * np.abs(centre) ** 2 / whole, strict=True):
        assert shares[f"object shifts along {axis}"] == pytest.approx(one, rel=1e-9)
    turns = sum(shares[f"object turns about {axis}"] for axis in "xyz")
    assert turns == pytest.approx((w.conj() @ inertia.inertia @ w).real / whole, rel=1e-9)
    assert sum(shares.values()) == pytest.approx(1.0, abs=1e-12)
    only = np.zeros(n + 6)
    only[n + 5] = 0.1
    assert groups.name(only, groups.shares(only)) == "object turns about its z axis 100 %"


# ------------------------------------------------------------------------------------------------------ names of modes


@pytest.mark.parametrize("name", ["hold", "pinch-two-phase", "allegro-box", "grasp-and-lift", "can"])
def test_shares_add_up_to_one(name: str) -> None:
    """Of all modes, those of memories among them; multiplier, growth, frequency and damping are of one another."""
    place = find_place(load_scenario(name))
    loop = close_loop(place)
    modes = find_modes(loop, Groups(place.plant, place.state.q))
    assert_allclose([sum(mode.shares.values()) for mode in modes], 1.0, atol=1e-9)
    assert len(loop.step) == sum(1 + (mode.multiplier[1] > 1e-12) for mode in modes)
    for mode in modes[:8]:
        rate = complex(mode.growth, 2.0 * np.pi * mode.frequency)
        assert np.exp(rate * loop.period) == pytest.approx(complex(*mode.multiplier), rel=1e-9)
        if abs(rate) > 1e-3:
            assert mode.damping == pytest.approx(-mode.growth / abs(rate), rel=1e-9)
    assert modes[0].growth == pytest.approx(loop.growth)


def test_names_do_not_depend_on_the_order_of_the_fingers() -> None:
    """Tips, contact points and internal forces in another order: the same modes under the same names."""
    here = load_scenario("hold")
    order = [2, 0, 1]
    points, force = here.grasp.contact_points, here.grasp.internal_force
    assert points is not None and force is not None
    there = here.with_values({
        "hand.tips": [here.hand.tips[k] for k in order],
        "grasp.contact_points": [points[k] for k in order],
        "grasp.internal_force": [force[k] for k in order],
    })  # fmt: skip
    one, other = (softhand.stability(scenario) for scenario in (here, there))
    for mine, yours in zip(one.modes[:8], other.modes[:8], strict=True):
        assert yours.growth == pytest.approx(mine.growth, rel=1e-5)
        assert yours.shares.keys() == mine.shares.keys()
        assert_allclose([yours.shares[key] for key in mine.shares], list(mine.shares.values()), atol=1e-5)
    assert one.modes[0].name.split(" %")[0] == other.modes[0].name.split(" %")[0]


def test_names_do_not_depend_on_how_the_scene_is_turned() -> None:
    """Hand, object and gravity turned: names and shares are in the axes of the object."""
    here = load_scenario("target-a", {"controller.orientation_error": "rotation-vector"})
    one, other = (softhand.stability(scenario) for scenario in (here, turned(here, rotation_of((2.0, -1.1, 0.7)))))
    for mine, yours in zip(one.modes[:8], other.modes[:8], strict=True):
        assert yours.growth == pytest.approx(mine.growth, rel=1e-3, abs=1e-3)
        assert_allclose(list(yours.shares.values()), list(mine.shares.values()), atol=1e-4)
        assert yours.name == mine.name


# --------------------------------------------------------------------------------------------------------- against runs


def grown(scenario: Scenario, seconds: float, delay: int = 0, step: np.ndarray | None = None) -> np.ndarray:
    """Velocities of a run that begins beside rest, nudged along the fastest growing mode, shape (periods, nv).

    Args:
        scenario: whose torques are `delay` control periods late; a controller with a period of its own is asked so
            often.
        seconds: of the run.
        delay: in control periods.
        step: of its loop, if that is not as the scenario has it.
    """
    loop = close_loop(find_place(scenario))
    values, vectors = np.linalg.eig(loop.step if step is None else step)
    shape = vectors[loop.moving : 2 * loop.moving, np.argmax(np.abs(values))].real
    simulation: Simulation = softhand.build(scenario)
    start = simulation.save()
    simulation.reset(softhand.State(start.q, start.v + 1e-7 * shape / np.linalg.norm(shape), start.z))
    period = scenario.control_period
    own = simulation._stride
    torques: list[np.ndarray] = []
    found = np.empty((round(seconds / period), loop.moving))
    for k in range(len(found)):
        simulation.sample()
        torques.append(simulation.torque.copy() if k % own == 0 else torques[-1])
        del torques[: -delay - 1]
        simulation.step(torques[0])
        found[k] = simulation.state.v
    return found


def rate_of(velocities: np.ndarray, period: float, begin: float) -> float:
    """Growth rate of the largest in windows of 50 ms, from a time [s] on."""
    count = round(0.05 / period)
    peaks = np.max(np.abs(velocities), axis=1)[round(begin / period) :]
    peaks = peaks[: len(peaks) // count * count].reshape(-1, count).max(axis=1)
    return float(np.polyfit(np.arange(len(peaks)) * count * period, np.log(peaks), 1)[0])


def test_a_small_motion_grows_as_fast_as_its_mode() -> None:
    """Target A asked to stay, with fine steps: 5.24 1/s by the loop and in the run."""
    scenario = load_scenario("target-a", {"reference": {"kind": "hold"}, **FINE})
    rate = softhand.stability(scenario).modes[0].growth
    assert rate == pytest.approx(5.24, abs=0.005)
    assert rate_of(grown(scenario, 1.2), 1e-3, 0.1) == pytest.approx(rate, rel=0.005)


def test_torques_may_be_as_late_as_the_delay_margin_says() -> None:
    """In tenths of a period: the last below the margin dies out, the first beyond grows, both at the rate told."""
    scenario = load_scenario("hold", {"controller.period": 1e-3, "control_period": 1e-4, **FINE})
    place = find_place(scenario)
    loop = close_loop(place)
    margin = delay_margin(loop, place)
    assert margin == pytest.approx(of("hold").margins.delay, rel=1e-3) and 1.4e-3 < margin < 1.5e-3
    for tenths, word in ((13, "dies out"), (17, "grows")):
        step = delayed_step(loop, place, 1e-4 * tenths)
        told = growth_of(step, 1e-3)
        measured = rate_of(grown(scenario, 0.8, tenths, step), 1e-4, 0.2)
        assert (measured > 0.0) == (word == "grows") == (1e-4 * tenths > margin)
        assert measured == pytest.approx(told, rel=0.1, abs=0.1)


def test_torques_may_be_held_as_long_as_the_longest_period_says() -> None:
    """Two per cent below it dies out, two beyond it grows, at the rates told."""
    longest = of("hold").margins.period
    for period, grows in ((0.98 * longest, False), (1.02 * longest, True)):
        values = {"control_period": period, "stepper.step": period / 10, "duration": 100 * period}
        scenario = load_scenario("hold", values)
        told = growth_at(holding(), period)
        measured = rate_of(grown(scenario, 0.6), period, 0.1)
        assert (measured > 0.0) == grows and measured == pytest.approx(told, rel=0.15)


def test_a_gain_may_be_as_large_as_its_margin_says() -> None:
    """K_N of `hold`: two hundredths below dies out, above grows."""
    (margin,) = (one for one in of("hold").margins.gains if one.name == "K_N")
    assert margin.factors.low == 0.0 and margin.value == 1.0
    for factor, grows in ((0.98 * margin.factors.high, False), (1.02 * margin.factors.high, True)):
        scenario = load_scenario("hold", {"controller.K_N": factor, **FINE})
        told = softhand.stability(scenario).held_growth
        measured = rate_of(grown(scenario, 1.0), 1e-3, 0.2)
        assert (told > 0.0) == (measured > 0.0) == grows and measured == pytest.approx(told, rel=0.1)


def test_the_torque_of_a_joint_may_be_as_large_as_its_margin_says() -> None:
    """A controller that gives one joint more than (59) does, beside what rest needs."""
    joint = of("hold").margins.joints[3]
    assert joint.joint == "finger_1_distal_flexion" and joint.factors.has_now
    place = holding()

    def with_factor(factor: float) -> float:
        return close_loop(place.with_controller(Stronger(**dict(place.controller), joint=2, factor=factor))).growth

    low, high = joint.factors
    assert with_factor(0.99 * high) < 0.0 < with_factor(1.01 * high)
    assert with_factor(1.01 * low) < 0.0 < with_factor(0.99 * low)


class Stronger(Regulation):
    """(59) with the torque of one joint multiplied, but for what it has at the start."""

    joint: int
    factor: float

    def start(self, observation: Any) -> Any:
        inner = super().start(observation)
        return inner, super().torque(observation, inner)[0].copy()

    def torque(self, observation: Any, memory: Any) -> Any:
        inner, rest = memory
        torque = super().torque(observation, inner)[0].copy()
        torque[self.joint] = rest[self.joint] + self.factor * (torque[self.joint] - rest[self.joint])
        return torque, memory


def test_an_unstable_loop_has_the_nearest_settings_that_are_stable() -> None:
    """Target A: K_N times 0.8 and less, K_v times eight and more, as the table of docs/stability.md has it."""
    margins = of("target-a").margins
    gains = {one.name: one.factors for one in margins.gains}
    assert np.isnan(margins.delay) and 1e-5 < margins.period < 2e-5
    assert 0.75 / 1.5 < gains["K_N"].high < 1.5 / 1.5 and 4.0 < gains["K_v"].low < 16.0 < gains["K_v"].high
    assert np.isnan(gains["K_O_position"]).all() and all(np.isnan(one.disk) for one in margins.joints)
    rows = dict(margins.rows())
    assert rows["controller.K_O_position times"].startswith("none from 0 to 64")
    assert rows["torques times"] == "none from 0 to 64, of any joint or all"


# ------------------------------------------------------------------------------------------------------- along a run


def test_along_a_run_the_recording_tells_what_the_scenario_does() -> None:
    """(59) remembers nothing that changes, so both have the same rates; those of single samples too."""
    scenario = load_scenario("target-a", {"duration": 0.2})
    run = softhand.simulate(scenario)
    computed, recorded = softhand.stability_along(scenario, 5), softhand.stability_along(run, 5)
    assert_allclose(computed.time, [0.0, 0.05, 0.1, 0.15, 0.2])
    assert_allclose(recorded.growth, computed.growth, rtol=1e-4, atol=1e-4)
    alone = softhand.stability(run, at=0.1)
    assert alone.time == 0.1 and alone.held_growth == pytest.approx(recorded.growth[2, 0], abs=1e-6)
    assert alone.modes[0].name == recorded.names[2]
    labels = dict(alone.rows())
    assert "not at rest there" in labels and "beside the motion" in labels["the rates are those"]


def test_start_and_end_of_a_run_stay_at_rest() -> None:
    """Of a scenario and its recording; where all rests, no row says otherwise."""
    scenario = load_scenario("hold", {"duration": 0.05})
    start, end = softhand.stability(scenario), softhand.stability(scenario, at="end")
    assert end.time == 0.05 and end.held_growth == pytest.approx(start.held_growth, rel=1e-5)
    assert softhand.stability(softhand.simulate(scenario), at="start").time == 0.0
    assert not {"not at rest there"} & {label for found in (start, end) for label, _ in found.rows()}


def test_phases_are_those_of_the_run() -> None:
    """As the reference has them, and a row for each that was looked at."""
    run = softhand.simulate("grasp-and-lift", duration=1.5)
    found = softhand.stability_along(run, 7)
    assert [name for name, _ in found.phases] == ["close", "squeeze", "take the weight"]
    assert "largest in phase squeeze" in dict(found.rows()) and np.all(found.growth[:, 0] < 0.0)


def test_a_lost_run_is_looked_at_as_far_as_it_goes() -> None:
    """Of its recording and of its scenario, which say why it ended; a time beyond is refused with the last good one."""
    push = [{"on": "object", "force": [0.0, 2.0, 1.0], "start": 0.0, "duration": 0.2}]
    scenario = load_scenario("hold", {"controller.K_N": 3.0, "duration": 2.0, "push": push})
    with pytest.raises(SimulationStopped) as stopped:
        softhand.simulate(scenario)
    run = stopped.value.recording
    found = softhand.stability_along(run, 4)
    assert len(found.time) == 4 and "the run ended early" in found.notes[0]
    computed = softhand.stability_along(scenario, 81)
    assert computed.time[-1] <= run.stop_time and str(stopped.value)[:30] in computed.notes[0]
    with pytest.raises(SimulationStopped, match=r"Samples up to t = .* give such a time with `at`"):
        softhand.stability(scenario, at=1.9)


class Raising(Controller):
    """It raises."""

    def torque(self, observation: Any, memory: Any) -> Any:
        raise ZeroDivisionError("no gain")


class Rooted(Controller):
    """Its torque has no derivative at rest, but NaN beside it."""

    def torque(self, observation: Any, memory: Any) -> Any:
        turned = np.sum(observation.joint_velocity)
        return observation.gravity_torque + np.sqrt(-abs(turned)), memory


def test_mistakes_are_named() -> None:
    """A time outside the run, no place, no mode, no count, a recording without samples or of a mode."""
    run = softhand.simulate("hold", duration=0.02)
    with pytest.raises(ScenarioError, match=r"at: got 3; .* times of the recording, 0 to 0.02 s; the nearest is 0.02"):
        softhand.stability(run, at=3)
    with pytest.raises(ScenarioError, match=r"at: got 'middle'; allowed are 'start', 'end' and times of the run"):
        softhand.stability("hold", at="middle")
    with pytest.raises(ScenarioError, match=r"at: got nan"):
        softhand.stability(run, at=float("nan"))
    with pytest.raises(ScenarioError, match=r"count: got 1"):
        softhand.stability_along(run, 1)
    with pytest.raises(ScenarioError, match=r"mode: got 40; this loop has modes 1"):
        of("hold").mode_recording(40)
    with pytest.raises(ScenarioError, match=r"with_scan: .* about the start of a scenario"):
        softhand.stability(run, with_scan=True)
    with pytest.raises(RecordingError, match="shows a mode"):
        softhand.stability(of("hold").mode_recording(1))


@pytest.mark.filterwarnings("ignore:invalid value")
def test_a_controller_at_fault_is_named() -> None:
    """One that raises, and one without a derivative."""
    with pytest.raises(ControllerError, match=r"controller 'Raising' raised ZeroDivisionError: no gain"):
        close_loop(holding().with_controller(Raising()))
    with pytest.raises(ControllerError, match=r"'Rooted' has a torque without a derivative along 'finger_1_abd"):
        close_loop(holding().with_controller(Rooted()))


# ----------------------------------------------------------------------------------------------- noise in, scatter out

NOISE = {
    "sensing.object_position.noise": 2e-5,
    "sensing.object_orientation.noise": 2e-4,
    "sensing.joint_position.noise": 1e-4,
    "sensing.joint_velocity.noise": 2e-3,
    "sensing.contact_force.noise": 0.01,
    "actuation.noise": 2e-4,
}
"""Of the scenario `hold`: every term counts but the force, which is not fed back with K_N = 1."""


@pytest.mark.parametrize(
    ("seeds", "within"), [(24, 0.15), pytest.param(200, 0.10, marks=pytest.mark.slow)], ids=["24 runs", "200 runs"]
)
def test_noisy_runs_scatter_as_told(seeds: int, within: float) -> None:
    """Position, attitude and internal force of runs with as many seeds, each axis, from the second second on."""
    scenario = load_scenario("hold", {**NOISE, "duration": 2.0})
    told = softhand.stability(scenario).scatter
    every = {"sensing.seed": range(1, seeds + 1), "actuation.seed": range(1, seeds + 1)}
    runs = softhand.rollout(scenario, every, every=0.05, variables=["object_position", "object_rpy", "internal_force"])
    assert runs.finished.all()
    for name, expected in (("position", told.position), ("rpy", told.turn)):
        measured = getattr(runs, f"object_{name}")[:, 20:].std(axis=(0, 1))
        assert_allclose(measured, expected, rtol=within)
    assert_allclose(runs.internal_force[:, 20:].std(axis=(0, 1)), told.internal_force, rtol=within)


def test_scatter_is_in_proportion_to_noise_and_the_sources_add_up() -> None:
    """Twice the noise, twice the scatter; shares are those of variances; nothing without noise."""
    place = find_place(load_scenario("hold", NOISE))
    one, twice = (
        softhand.stability(load_scenario("hold", {key: k * value for key, value in NOISE.items()})).scatter
        for k in (1.0, 2.0)
    )
    assert_allclose(twice.position, 2.0 * one.position, rtol=1e-6)
    assert_allclose(np.sum(list(one.sources.values()), axis=0), 1.0, rtol=1e-9)
    assert one.sources["contact_force"][0] < 1e-6 < one.sources["joint_position"][0]
    alone = softhand.stability("hold", at=None)
    assert alone.scatter is None and place.setup.sensing is not None


def test_scatter_of_the_commanded_torque_is_that_of_its_derivative() -> None:
    """A loop that noise enters for the first time: by `linearize` with the biases as parameters."""
    scenario = load_scenario("hold", {"sensing.object_position.noise": 1e-5})
    noise = softhand.measurement_noise(scenario)
    model = softhand.linearize(
        scenario, overrides=noise.biases, parameters=noise.biases, closed=True, outputs=["joint_torque"]
    )
    place = find_place(scenario)
    ((name, std, answer),) = _answers(close_loop(place, with_outputs=True), place)
    assert name == "object_position" and np.all(std == 1e-5)
    assert_allclose(answer[:9], model.closed.F, rtol=1e-5, atol=1e-6 * np.abs(model.closed.F).max())


def test_noise_in_a_loop_that_grows_has_no_bound() -> None:
    """Said in words, and delays of instruments as what the loop has not."""
    found = softhand.stability(load_scenario("target-a", {"sensing.object_position": {"noise": 1e-5, "delay": 0.002}}))
    rows = dict(found.rows())
    assert rows["scatter by noise"].startswith("without bound")
    assert rows["left out of the loop"] == "sensing.object_position.delay"
    assert json.loads(found.to_json())["scatter"]["position"] == [None, None, None]


# ------------------------------------------------------------------------------------------------ what comes out of it


def test_the_loop_goes_to_python_control() -> None:
    """Poles, names and sampling; a step response is the powers of the loop."""
    control = pytest.importorskip("control")
    found = of("hold")
    system = found.to_control()
    assert isinstance(system, control.StateSpace) and system.dt == found.period
    expected = np.sort_complex(np.linalg.eigvals(found.loop.step))
    assert_allclose(np.sort_complex(system.poles()), expected, atol=1e-9)
    assert system.input_labels[0] == "torque of finger_1_abduction" and "object turn z" in system.output_labels
    response = control.forced_response(system, inputs=np.eye(9)[:, :1] @ np.ones((1, 4)))
    x = np.zeros(len(found.loop.step))
    for _ in range(3):
        x = found.loop.step @ x + found.loop.B[:, 0]
    assert_allclose(response.outputs[:, 3], found.loop.C @ x, atol=1e-15)


def test_outputs_are_in_the_axes_of_the_world() -> None:
    """A run beside the start: object and internal forces move as C says, to first order."""
    found, size = of("hold"), 1e-7
    moved = found.place.situation()
    x = size * np.random.default_rng(3).normal(size=found.loop.moving)
    probe, plant = moved.probe, found.place.plant
    here, there = (probe.at(state, 0.0).copy() for state in (found.place.state, beside(found.place, x)))
    told = found.loop.C[:, : found.loop.moving] @ x
    n = plant.world.n_joints
    assert_allclose(there.object_position - here.object_position, told[n : n + 3], rtol=1e-4, atol=1e-12)
    assert_allclose(
        there.internal_force - here.internal_force, told[n + 6 :], atol=2e-3 * np.max(np.abs(told[n + 6 :]))
    )


@pytest.mark.parametrize("number", [1, 2])
def test_a_mode_to_look_at_moves_along_its_shape(number: int) -> None:
    """Joints move in the proportions of the mode, within bounds, about the state; no tip lets go."""
    found = of("hold")
    run, mode = found.mode_recording(number), found.modes[number - 1]
    moved = run.joint_position - found.place.state.q[:9]
    assert np.max(np.abs(moved)) <= 0.15 + 1e-9 and np.all(run.deformation[:, :, 0] > 0.0)
    span = np.linalg.matrix_rank(moved, tol=1e-9)
    assert span == (2 if mode.frequency else 1)
    along, _, _, _ = np.linalg.lstsq(mode.shape[:9, :span], moved.T, rcond=None)
    assert_allclose(mode.shape[:9, :span] @ along, moved.T, atol=1e-9)
    assert run.complete and str(mode) in run.attributes["mode"]
    size = np.linalg.norm(moved, axis=1)
    assert size[:25].max() > 1.5 * size[-25:].max() or number == 2  # a motion that dies out


def test_the_command_writes_figure_mode_and_json(tmp_path) -> None:
    """As its call in Python has them; along a run with its phases; a film or a page plays the mode."""
    result = run_command("stability", "hold", "--json", "--out", "m.svg", "--mode-out", "m.nc", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    told = json.loads(result.stdout)
    assert told["margins"] is None and told["modes"][0]["name"] == of("hold").modes[0].name
    assert "<svg" in (tmp_path / "m.svg").read_text() and softhand.load_recording(tmp_path / "m.nc").complete
    result = run_command("export", "m.nc", "--csv", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    softhand.simulate("target-a", duration=0.02).save(tmp_path / "run.nc")
    result = run_command("stability", "run.nc", "--along", folder=tmp_path)
    assert result.returncode == 0 and "largest growth" in result.stdout and (tmp_path / "stability.png").is_file()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--at", "99"], ["at: got 99", "0 to 10 s", "nearest is 10"]),
        (["--at", "soon"], ["at: got 'soon'", "start"]),
        (["--mode", "77", "--mode-out", "k.nc"], ["mode: got 77", "modes 1"]),
        (["--mode-out", "k.gif"], ["--mode-out", "k.gif", ".nc"]),
        (["--along", "--margins"], ["--along", "leave out --margins"]),
        (["--scan", "--controller", "object-impedance"], ["with_scan", "regulation"]),
    ],
)
def test_a_mistake_gives_one_message(tmp_path, arguments: list[str], words: list[str]) -> None:
    """The thing, its value, the remedy; nothing is written."""
    result = run_command("stability", "hold", *arguments, folder=tmp_path)
    assert result.returncode == 1 and result.errors.startswith("error:") and "Traceback" not in result.stderr
    assert all(word in result.stderr for word in words) and not list(tmp_path.rglob("*.n?"))


def test_without_python_control_the_extra_is_named(monkeypatch) -> None:
    """As an import that fails."""
    import sys

    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(SofthandError, match=r"softhand\[control\]"):
        of("hold").to_control()
    assert replace(of("hold"), scan=None).loop is of("hold").loop
