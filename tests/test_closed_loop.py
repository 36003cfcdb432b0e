"""The plant as a linear model, any controller on top of it, and how fast small motions grow."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from test_attitude import turned

import softhand
from softhand.checks.scenario import fastest_frequency
from softhand.closed_loop.gain_loop import close_gain_loop, held
from softhand.closed_loop.linearize import LinearModel, beside, linearize_plant
from softhand.closed_loop.start import HeldStart, held_start
from softhand.controllers.controller import Controller
from softhand.controllers.regulation import Regulation
from softhand.errors import GraspError
from softhand.margins.loop import Loop, close_loop, without_sampling
from softhand.margins.place import Place, find_place
from softhand.numerics.spatial import rotation_of
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.plugins import plugin_names
from softhand.scenario.scenario import Scenario, load_scenario, with_law
from softhand.steppers.rk4 import RungeKutta4

FINE = RungeKutta4(step=1e-4)
SCENARIOS = {
    "target-a": {},
    "kelvin-voigt": {"fingertip.damping": {"name": "kelvin-voigt", "radial": 3.0}},
    "fung": {"fingertip.damping": {"name": "fung", "shares": (0.3, 0.2), "rates": (20.0, 300.0)}},
}


def scenario_of(name: str) -> Scenario:
    """One of `SCENARIOS`, or one that ships."""
    if name == "conservative":
        return with_law(load_scenario("target-a"), "conservative")
    known = name in SCENARIOS
    return load_scenario("target-a" if known else name, SCENARIOS.get(name, {}))


def start_of(name: str) -> HeldStart:
    return held_start(scenario_of(name))


def place_of(name: str) -> Place:
    return find_place(scenario_of(name))


def away(plant: Plant, state: State, base: State, model: LinearModel | Loop) -> np.ndarray:
    """x of a state beside another one that has gone on for the same time."""
    memory = [(state.z - base.z)[i, 3:] for i in range(len(plant.contacts))]
    x = np.concatenate([pin.difference(plant.world.model, base.q, state.q), state.v - base.v, *memory])
    return x[: len(model.A)]


# ------------------------------------------------------------------------------------------------ the plant by itself


@pytest.mark.parametrize("name", [*SCENARIOS, "conservative", "can", "gripper", "grasp-and-lift", "arm-pick-and-place"])
def test_the_model_is_the_plant_for_small_motions(name):
    """Displacement, rates, memory and torque in a random direction: 8 ms of the plant are expm(A t) x + Gamma u.

    Held objects, round ones, slides, tips that relax, and open fingers about an object that stands on its corners.
    """
    start = start_of(name)
    plant, state, rng = start.probe.plant, start.state, np.random.default_rng(1)
    observation = start.probe.at(state, 0.0)
    torque = observation.gravity_torque + observation.hand_jacobian.T @ observation.contact_force.ravel()
    model = linearize_plant(plant, state, torque)
    assert np.max(np.abs(model.acceleration)) < 1e-6
    move, push = held(model, 8e-3)
    x, u = 1e-8 * rng.normal(size=len(model.states)), rng.normal(size=len(model.inputs))
    u *= np.linalg.norm(move @ x) / np.linalg.norm(push @ u)
    ends = []
    for moved, pushed in ((beside(plant, state, x), torque + u), (state.copy(), torque)):
        integration = FINE.start(plant)
        for _ in range(80):
            integration.advance(moved, pushed)
        ends.append(moved)
    expected = move @ x + push @ u
    assert np.linalg.norm(away(plant, *ends, model) - expected) < 3e-4 * np.linalg.norm(expected)


def test_the_states_are_named(tmp_path):
    """Joints and object, their rates, and what relaxes: as many names as entries, none twice."""
    loop, start = close_loop(place_of("fung")), start_of("fung")
    for model in (loop, linearize_plant(start.probe.plant, start.state, np.zeros(9))):
        assert len(set(model.states)) == len(model.states) == len(model.A) == 30 + 24
        assert model.states[0] == "finger_1_abduction" and model.states[14] == "object turn about z"
        assert model.states[15] == "finger_1_abduction, rate" and model.states[30] == "finger_1_tip, memory 1, radial"
        assert model.inputs == model.states[:9]


def test_the_fastest_motion_is_that_of_the_contacts():
    """The largest eigenvalue of A is the fastest frequency of hand and object on their contacts, found another way."""
    start = start_of("conservative")
    model = linearize_plant(start.probe.plant, start.state, np.zeros(9))
    fastest = np.max(np.abs(np.linalg.eigvals(model.A)))
    assert fastest == pytest.approx(fastest_frequency(start.probe.plant, start.state), rel=0.01)


# ------------------------------------------------------------------------------------------------- controllers on top


class Delayed(Regulation):
    """(59) for the grasp of two samples ago."""

    def start(self, observation: Any) -> Any:
        return super().start(observation), [observation.copy(), observation.copy()]

    def torque(self, observation: Any, memory: Any) -> Any:
        law, (older, old) = memory
        return super().torque(older, law)[0].copy(), (law, [old, observation.copy()])


class Slow(Controller):
    """Joint torques that follow a spring on the joints by a third each sample: the memory is the torque."""

    def start(self, observation: Any) -> Any:
        holding = observation.gravity_torque + observation.hand_jacobian.T @ observation.contact_force.ravel()
        return {"at": observation.joint_position.copy(), "holding": holding, "torque": holding}

    def torque(self, observation: Any, memory: Any) -> Any:
        wanted = memory["holding"] + 3.0 * (memory["at"] - observation.joint_position)
        torque = memory["torque"] + (wanted - memory["torque"]) / 3.0
        return torque, {**memory, "torque": torque}


AT_REST = ["target-a", "finger-only", "object-impedance", "computed-torque", "pinch-angle-feedback", "pinch-two-phase",
           "grasp-and-lift", "arm-pick-and-place", "allegro-box"]  # fmt: skip


@pytest.mark.parametrize("name", [*AT_REST, Delayed, Slow], ids=str)
def test_the_loop_is_the_run_for_small_motions(name):
    """From a random disturbance, 12 samples of plant and controller are so many powers of the linear loop.

    Every controller whose start is at rest, one that is late, and one that is slow.
    """
    start = start_of(name if isinstance(name, str) else "target-a")
    if not isinstance(name, str):
        start = replace(start, controller=name())
    probe, controller, period = start.probe, start.controller, start.period
    place = place_of(name if isinstance(name, str) else "target-a")
    loop = close_loop(place if isinstance(name, str) else place.with_controller(name()))
    step, states = loop.step, len(loop.A)
    x = 1e-7 * np.random.default_rng(2).normal(size=states)
    y = np.concatenate([x, np.zeros(len(step) - states)])
    first = probe.at(start.state, 0.0)
    _, memory = controller.torque(first, controller.start(first))
    ends = []
    for moved in (beside(probe.plant, start.state, x), start.state.copy()):
        remembered = memory
        integration = FINE.start(probe.plant)
        for k in range(12):
            torque, remembered = controller.torque(probe.at(moved, (k + 1) * period), remembered)
            pushed = torque.copy()
            for _ in range(round(period / FINE.step)):
                integration.advance(moved, pushed)
        ends.append(moved)
    expected = (np.linalg.matrix_power(step, 12) @ y)[:states]
    assert np.linalg.norm(away(probe.plant, *ends, loop) - expected) < 2e-3 * np.linalg.norm(expected)


def test_without_sampling_a_torque_must_not_depend_on_earlier_samples():
    """The growth without sampling is that of ever shorter periods; late and slow controllers have none."""
    place = place_of("object-impedance")
    limit = without_sampling(close_loop(place), place)
    away_from_it = [abs(close_loop(place, period).growth - limit) for period in (1e-3, 2e-4, 4e-5)]
    assert away_from_it[2] < 2e-2 and away_from_it[0] > 4.0 * away_from_it[1] > 16.0 * away_from_it[2]
    late = place_of("target-a").with_controller(Slow())
    slow = close_loop(late)
    assert np.isnan(without_sampling(slow, late)) and len(slow.N) == 9


def test_a_controller_without_memory_of_change_has_none_in_the_loop():
    """The memory of (59) is its gains and the posture of the start: nothing of it changes with the state."""
    assert len(close_loop(place_of("target-a")).N) == 0


def test_K_O_enters_the_feedback_of_59_in_proportion():
    """The torque is affine in K_O, which the scan uses: half of one gain and double of another, on their own."""
    start = start_of("target-a")
    loop = close_gain_loop(start)
    K_O = loop.K_O * [0.5, 1.0, 2.0, 3.0, 0.2, 1.0]
    law = Regulation(K_O_position=K_O[:3].tolist(), K_O_orientation=K_O[3:].tolist())
    place = place_of("target-a").with_controller(law)
    other = close_loop(place)
    assert loop.growth(K_O) == pytest.approx(without_sampling(other, place), abs=1e-6)
    assert loop.held_growth([K_O], 1e-3)[0] == pytest.approx(other.growth, abs=5e-3)


# -------------------------------------------------------------------------------------------------------- the figures


def test_every_shipped_controller_has_a_growth_rate():
    """Of each scenario that ships with a controller of its own; those not at rest at the start say so."""
    found = {}
    for name in ("blind", "computed-torque", "finger-only", "object-impedance", "point-contact",
                 "pinch-angle-feedback", "pinch-opposing", "pinch-two-phase", "grasp-and-lift",
                 "arm-pick-and-place"):  # fmt: skip
        found[name] = softhand.stability(load_scenario(name), with_scan=False)
    others = {"regulation", "state-feedback", "least-squeeze", "set-points"}  # the last one is nothing without servos
    assert {result.controller for result in found.values()} | others == set(plugin_names("controllers"))
    assert all(np.isfinite(result.held_growth) and result.scan is None for result in found.values())
    without = {name for name, result in found.items() if np.isnan(result.growth)}
    assert without == {"finger-only", "pinch-two-phase"}
    restless = {name for name, result in found.items() if "not at rest there" in dict(result.rows())}
    assert restless == {"blind", "point-contact", "pinch-opposing"}
    assert found["finger-only"].held_growth == pytest.approx(5.24, abs=0.01)  # as that of (59) with a sensor


def test_idle_joints_are_held_by_the_posture_of_the_start():
    """The Allegro hand has more joints than contacts need: without K_posture some motion stays, with it none."""
    held_still = softhand.stability(load_scenario("allegro-box"), with_scan=False)
    free = softhand.stability(load_scenario("allegro-box", {"controller.K_posture": 0.0}), with_scan=False)
    assert held_still.held_growth < -1.0 and abs(free.held_growth) < 1e-6


def test_regulation_needs_a_grasp():
    """Open fingers are refused, with the remedy."""
    controller = {"name": "regulation"}
    with pytest.raises(GraspError, match="start open"):
        softhand.stability(load_scenario("grasp-and-lift", {"controller": controller}))


@pytest.mark.parametrize("turn", [pytest.param("pitch 90", marks=pytest.mark.slow), "general"])
@pytest.mark.parametrize("name", ["target-a", "finger-only"])
def test_growth_and_share_have_no_attitude(name, turn):
    """However the whole is turned, a pitch of 90 deg included, where roll, pitch and yaw are singular."""
    here = load_scenario(name, {"controller.orientation_error": "rotation-vector"})
    Q = {"pitch 90": rotation_of((0.0, 0.5 * np.pi, 0.0)), "general": rotation_of((2.0, -1.1, 0.7))}[turn]
    one, other = (softhand.stability(scenario, with_scan=False) for scenario in (here, turned(here, Q)))
    assert other.held_growth == pytest.approx(one.held_growth, rel=1e-4)
    np.testing.assert_allclose([other.growth, other.use], [one.growth, one.use], rtol=1e-4)
