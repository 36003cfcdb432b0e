"""Controllers: each formula against plain numpy or a potential, its sign, its rest, and what it reaches on a run."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hands import ARM_IN_THE_AIR, Array
from numpy.testing import assert_allclose

from softhand import Controller, Recording, ScenarioError, Simulation, build, load_scenario, simulate
from softhand.contact.pairs import contact_pairs
from softhand.controllers.angle_feedback import AngleFeedback, contact_forces
from softhand.controllers.blind import Blind
from softhand.controllers.blind import virtual_frame as set_frame
from softhand.controllers.blind import virtual_turning as set_turning
from softhand.controllers.computed_torque import ComputedTorque
from softhand.controllers.object_impedance import ObjectImpedance
from softhand.controllers.opposing import Opposing
from softhand.controllers.point_contact import PointContact
from softhand.controllers.two_phase import TwoPhase
from softhand.numerics.rotations import rotation_vector
from softhand.numerics.spatial import rotation_of
from softhand.plant.state import State
from softhand.plugins import SHIPPED, find_plugin
from softhand.references.reference import Desired
from softhand.sensing.fields import FIELDS
from softhand.sensing.observation import Observation
from softhand.sensing.sensor import Sensor

SCENARIOS = {
    "regulation": "target-a",
    "finger-only": "finger-only",
    "point-contact": "point-contact",
    "object-impedance": "object-impedance",
    "computed-torque": "computed-torque",
    "blind": "blind",
    "opposing": "pinch-opposing",
    "angle-feedback": "pinch-angle-feedback",
    "two-phase": "pinch-two-phase",
    "pick-and-place": "grasp-and-lift",
    "arm-pick-and-place": "arm-pick-and-place",
}
"""A scenario that ships for each controller that ships."""

STEP = 1e-6


def virtual_frame(x: Array) -> tuple[Array, Array]:
    """Centre and axes of the virtual frame."""
    centre, axes = np.empty(3), np.empty((3, 3))
    set_frame(x, centre, axes)
    return centre, axes


def virtual_turning(x: Array, axes: Array) -> Array:
    """Its angular velocity from the velocities of the tips."""
    B = np.empty((3, 3, 3))
    set_turning(x, axes, B)
    return B


class Stage:
    """The start of a scenario, and observations of states near it."""

    def __init__(self, name: str, values: dict[str, Any] | None = None) -> None:
        self.simulation: Simulation = build(load_scenario(name, {"duration": 0.001, **(values or {})}))
        self.model = self.simulation.plant.world.model
        self.start = self.simulation.state.copy()
        pairs = len(contact_pairs(self.simulation.plant.world.n_tips))
        self.desired = Desired(*np.zeros((3, 6)), np.full(pairs, 5.0))
        self._sensor = Sensor(self.simulation.plant, self.desired)
        seen = self.at(self.start)
        self.desired.coordinates[:] = seen.q_O
        self.desired.internal_force[:] = seen.internal_force

    def at(self, state: State, time: float = 0.0) -> Observation:
        """An observation of its own, which can be changed."""
        return self._sensor.observe(state, time).copy()

    def near(self, seed: int, size: float = 0.01) -> State:
        """A moving state near the start."""
        rng = np.random.default_rng(seed)
        n = self.model.nv - 6
        away = np.concatenate([rng.normal(0.0, size, n), rng.normal(0.0, 1e-4, 3), rng.normal(0.0, 0.05, 3)])
        v = np.concatenate([rng.normal(0.0, 0.5, n), rng.normal(0.0, 0.1, 3), rng.normal(0.0, 1.0, 3)])
        z = self.start.z + rng.normal(0.0, 0.01, self.start.z.shape)
        return State(pin.integrate(self.model, self.start.q, away), v, z)

    def moved(self, state: State, joint: int, step: float) -> State:
        """The same with one joint moved."""
        direction = np.zeros(self.model.nv)
        direction[joint] = step
        return State(pin.integrate(self.model, state.q, direction), state.v, state.z)


@pytest.fixture(scope="module")
def hand() -> Stage:
    return Stage("target-a")


@pytest.fixture(scope="module")
def pinch() -> Stage:
    return Stage("pinch")


@pytest.fixture(scope="module")
def runs() -> dict[str, Recording]:
    """Each controller in its scenario, run when first asked for."""

    class Runs(dict[str, Recording]):
        def __missing__(self, name: str) -> Recording:
            self[name] = simulate(load_scenario(SCENARIOS[name]))
            return self[name]

    return Runs()


def holding(seen: Observation) -> Array:
    """Torques that hold the grasp as it is."""
    return seen.N_F + seen.J_CF.T @ seen.contact_force.ravel()


def make(name: str, stage: Stage) -> Controller:
    """The controller with the settings of its scenario, or its defaults on another hand."""
    scenario = load_scenario(SCENARIOS[name])
    return find_plugin("controllers", name, "controller.name")(**scenario.controller.parameters)


@cache
def arm() -> Stage:
    """The hand on an arm, with the box in the air."""
    return Stage("arm-pick-and-place", ARM_IN_THE_AIR)


def stage_of(name: str, hand: Stage, pinch: Stage) -> Stage:
    if name.startswith("arm"):
        return arm()
    return pinch if SCENARIOS[name].startswith("pinch") else hand


# ------------------------------------------------------------------------------------------------------- all of them


def test_each_controller_has_a_scenario() -> None:
    """The scenario of each controller uses it; of a further controller one is welcome, but need not be there."""
    assert set(SCENARIOS) <= set(SHIPPED["controllers"])
    for name, scenario in SCENARIOS.items():
        assert load_scenario(scenario).controller.name == name


@pytest.mark.parametrize("name", list(SCENARIOS))
def test_the_scenario_has_the_default_gains(name: str) -> None:
    """What the scenario writes out, and explains, is what the controller has by itself."""
    written = load_scenario(SCENARIOS[name]).controller.parameters
    controller = find_plugin("controllers", name, "controller.name")
    paper = {"orientation_error": "euler"} if name == "regulation" else {}  # target A is a task of the paper
    assert controller(**written) == controller(**paper)


@pytest.mark.parametrize(
    "name", ["regulation", "finger-only", "object-impedance", "computed-torque", "angle-feedback", "two-phase"]
)
def test_at_rest_on_the_target_the_torques_are_those_that_hold(name: str, hand: Stage, pinch: Stage) -> None:
    """Nothing changes where nothing has to."""
    stage = stage_of(name, hand, pinch)
    controller, seen = make(name, stage), stage.at(stage.start)
    tau, _ = controller.torque(seen, controller.start(seen))
    assert_allclose(tau, holding(seen), rtol=0.0, atol=1e-8)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] if name == "arm-pick-and-place" else [])
        for name in SCENARIOS
        if name != "two-phase"
    ],
)
def test_more_desired_force_squeezes(name: str, hand: Stage, pinch: Stage) -> None:
    """What a larger f_Nd adds to the torques pushes every tip towards the middle of the tips."""
    stage = stage_of(name, hand, pinch)
    controller, seen = make(name, stage), stage.at(stage.start)
    memory = controller.start(seen)
    before = np.array(controller.torque(seen, memory)[0])
    seen.internal_force_desired += 1.0
    more = np.array(controller.torque(seen, memory)[0]) - before
    x = seen.tip_position
    for J, inward in zip(seen.tip_jacobian, x.mean(axis=0) - x, strict=True):
        force = np.linalg.pinv(J.T, rcond=1e-6) @ more
        assert force @ inward > 0.5 * np.linalg.norm(force) * np.linalg.norm(inward) > 0.0


@pytest.mark.parametrize("name", list(SCENARIOS))
def test_a_controller_leaves_the_observation_alone(name: str, hand: Stage, pinch: Stage) -> None:
    """No array of the observation is written to."""
    stage = stage_of(name, hand, pinch)
    controller, seen = make(name, stage), stage.at(stage.near(0), 0.001)
    before = seen.copy()
    controller.torque(seen, controller.start(stage.at(stage.start)))
    controller.start(seen)
    for key in FIELDS:
        assert np.array_equal(getattr(seen, key), getattr(before, key)), key
    assert seen.time == before.time


@pytest.mark.parametrize("name", list(SCENARIOS))
def test_a_memory_can_be_used_twice(name: str, hand: Stage, pinch: Stage) -> None:
    """The torque depends on observation and memory alone: asked again, the controller says the same."""
    stage = stage_of(name, hand, pinch)
    controller = make(name, stage)
    memory = controller.start(stage.at(stage.start))
    seen = stage.at(stage.near(1), 0.001)
    first = np.array(controller.torque(seen, memory)[0])
    assert np.array_equal(controller.torque(seen, memory)[0], first)


@pytest.mark.parametrize(
    ("name", "scenario", "words"),
    [("opposing", "target-a", "needs 2 fingers"), ("angle-feedback", "target-a", "needs 2 fingers"),
     ("two-phase", "target-a", "needs 2 fingers"), ("blind", "pinch", "at least 3 fingers")],
)  # fmt: skip
def test_a_hand_of_another_kind_is_refused(name: str, scenario: str, words: str) -> None:
    """A controller for so many fingers names itself, what it needs and what there is."""
    with pytest.raises(ScenarioError, match=words) as caught:
        simulate(load_scenario(scenario, {"controller": {"name": name}, "duration": 0.002}))
    assert caught.value.key == "controller.name"


def test_a_gain_of_the_wrong_length_is_named() -> None:
    """One number or one each."""
    with pytest.raises(ScenarioError, match=r"controller\.K_int has 2 entries; give one number or 3"):
        simulate(load_scenario("object-impedance", {"controller.K_int": [1.0, 1.0], "duration": 0.002}))


# ------------------------------------------------------------------------------------------------- formulas and signs


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("compensate", [True, False])
def test_object_impedance_is_its_formula(hand: Stage, seed: int, compensate: bool) -> None:
    """Against numpy's pseudo-inverse, at a moving state with moving references."""
    controller = ObjectImpedance(orientation_error="euler", torsion_compensation=compensate, D_position=(1.0, 2.0, 3.0))
    memory = controller.start(hand.at(hand.start))
    seen, rng = hand.at(hand.near(seed)), np.random.default_rng(seed)
    desired = Desired(*rng.normal(0.0, 0.4, (3, 6)), rng.normal(size=3), *rng.normal(size=(2, 6)))
    seen.desired = desired
    tau, _ = controller.torque(seen, memory)
    M, D, K = np.repeat([0.2, 1e-4], 3), np.array([1.0, 2.0, 3.0, *[0.002] * 3]), np.repeat([100.0, 0.3], 3)
    rate = np.linalg.inv(seen.T_O) @ seen.object_twist
    wrench = M * desired.coordinates_acceleration - D * (rate - desired.coordinates_rate)
    wrench += seen.N_O - K * (seen.q_O - desired.coordinates) - compensate * seen.J_O_tau.T @ seen.tau_C
    f_C = np.linalg.pinv(seen.J_O_f.T) @ wrench + seen.K @ desired.internal_force
    expected = seen.J_CF_f.T @ f_C + seen.N_F - 0.005 * seen.joint_velocity
    assert_allclose(tau, expected + compensate * seen.J_CF_tau.T @ seen.tau_C, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("seed", range(3))
def test_computed_torque_is_that_of_the_textbook(hand: Stage, seed: int) -> None:
    """G J_h^-T tau = M~ t' + C~ t + N~ with M~ = M_o + G J_h^-T M_f J_h^-1 G^T; the rest of tau is in ker G."""
    controller = ComputedTorque(torsion_compensation=False, K_v=0.0)
    near = hand.near(seed)
    before = State(pin.integrate(hand.model, near.q, -1e-5 * near.v), near.v, near.z)
    behind, seen = hand.at(before, 1.0), hand.at(near, 1.0 + 1e-5)
    tau, _ = controller.torque(seen, controller.start(behind))
    G, J_h, twist, R = seen.object_force_jacobian.T, seen.J_CF_f, seen.object_twist, seen.object_rotation
    A = np.linalg.inv(J_h) @ G.T
    missing = hand.desired.coordinates[:3] - seen.object_position
    turn = rotation_vector(R, rotation_of(hand.desired.coordinates[3:]))
    # e'' + K_d e' + K_p e = 0, all gains the same about all axes
    a = np.concatenate([200.0 * missing, 200.0 * turn]) - np.repeat([15.0, 12.0], 3) * twist
    up = G @ np.linalg.inv(J_h).T
    M = seen.object_mass_matrix + up @ seen.M_F @ A
    C = seen.object_velocity_terms + up @ seen.velocity_terms_F
    N = seen.object_gravity + up @ seen.N_F
    turning = up @ seen.M_F @ ((A - np.linalg.inv(behind.J_CF_f) @ behind.object_force_jacobian) / 1e-5) @ twist
    assert_allclose(up @ tau, M @ a + C + turning + N, rtol=1e-7, atol=1e-9)


def test_computed_torque_makes_the_error_a_linear_oscillator() -> None:
    """On tips a hundred times stiffer, a small step of the height follows e'' + K_d e' + K_p e = 0."""
    stiff = {f"fingertip.{key}": 100.0 * value for key, value in
             {"k_r": 0.377e6, "k_phi": 0.166e6, "k_theta": 0.0266e9, "k_psi": 0.0488e9}.items()}  # fmt: skip
    values = {"reference.kind": "step", "reference.object_position": [0.0, 0.010, 0.143], "duration": 0.3,
              "reference.object_rpy": [0.0, 0.0, 0.0], "reference.internal_force": [4.0, 4.0, 3.0],
              "controller.K_v": 0.0, "control_period": 0.0005, "stepper.step": 0.00025}  # fmt: skip
    recording = simulate(load_scenario("computed-torque", {**stiff, **values}))
    error = 1e3 * (recording.object_position[:, 2] - 0.143)
    decay, swing = 7.5, np.sqrt(200.0 - 7.5**2)
    t = recording.time
    expected = -np.exp(-decay * t) * (np.cos(swing * t) + decay / swing * np.sin(swing * t))
    assert_allclose(error, expected, rtol=0.0, atol=0.03)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("compensate", [True, False])
def test_point_contact_is_its_formula(hand: Stage, seed: int, compensate: bool) -> None:
    """Virtual work: tau q_F' is the power of f_d and tau_C on tips that touch the whole radius before x_i."""
    controller = PointContact(torsion_compensation=compensate, K_v=0.0)
    memory = controller.start(hand.at(hand.start))
    seen = hand.at(hand.near(seed))
    tau, _ = controller.torque(seen, memory)
    n, p = seen.contact_rotation[:, :, 2], seen.tip_position + 0.010 * seen.contact_rotation[:, :, 2]
    arms = p - seen.object_position
    force = np.array([0.0, 0.0, 0.2 * 9.81]) + 100.0 * (hand.desired.coordinates[:3] - seen.object_position)
    missing = pin.log3(rotation_of(hand.desired.coordinates[3:]) @ seen.object_rotation.T)
    moment = 0.3 * missing - 0.001 * seen.object_twist[3:]
    wrench = np.concatenate([force - 1.0 * seen.object_twist[:3], moment - compensate * seen.tau_C @ n])
    G = np.hstack([np.vstack([np.eye(3), pin.skew(arm)]) for arm in arms])
    f_d = (np.linalg.pinv(G) @ wrench).reshape(3, 3)
    for (i, j), f in zip([(1, 2), (0, 2), (0, 1)], hand.desired.internal_force, strict=True):
        e = (p[j] - p[i]) / np.linalg.norm(p[j] - p[i])
        f_d[i] += f * e
        f_d[j] -= f * e
    power = 0.0
    for i in range(3):
        v, w = seen.tip_jacobian[i] @ seen.joint_velocity, seen.tip_angular_jacobian[i] @ seen.joint_velocity
        power += f_d[i] @ (v + np.cross(w, 0.010 * n[i])) + compensate * seen.tau_C[i] * (n[i] @ w)
    assert (tau - seen.N_F) @ seen.joint_velocity == pytest.approx(power, rel=1e-9)


def gradient(stage: Stage, state: State, potential: Any) -> Array:
    """Slope of a potential of an observation in the joint angles."""
    n = stage.model.nv - 6
    sides = [[potential(stage.at(stage.moved(state, k, s))) for s in (STEP, -STEP)] for k in range(n)]
    return np.array([(up - down) / (2.0 * STEP) for up, down in sides])


@pytest.mark.parametrize("seed", range(3))
def test_opposing_pulls_down_a_potential(pinch: Stage, seed: int) -> None:
    """u = N_F - C q' - grad V; the pull is a spring of length zero between the tips, so V falls as they close.

    The weight of the object, which the tips push up, is a potential that falls with the height of the tips.
    """
    controller = Opposing(gamma=1e-3)
    seen = pinch.at(pinch.start)
    memory = controller.start(seen)
    q_start, distance = seen.joint_position.copy(), np.linalg.norm(seen.tip_position[0] - seen.tip_position[1])
    state = pinch.near(seed)
    seen = pinch.at(state)
    tau = controller.torque(seen, memory)[0] - seen.N_F + 0.005 * seen.joint_velocity

    def potential(seen: Observation) -> float:
        x, away = seen.tip_position, seen.joint_position - q_start
        pull = 0.5 * 5.0 / distance * float(np.sum((x[0] - x[1]) ** 2))
        turns = np.array([away[:3].sum(), away[3:].sum()])
        return pull + 0.5 * 0.010**2 / 1e-3 * float(turns @ turns) + 0.5 * 0.2 * float(x.sum(axis=0) @ seen.gravity)

    assert_allclose(tau, -gradient(pinch, state, potential), rtol=0.0, atol=1e-7)


@pytest.mark.parametrize("seed", range(3))
def test_blind_pulls_down_a_potential(hand: Stage, seed: int) -> None:
    """Springs between all tips, and of the virtual frame against its desired pose: the law is passive."""
    controller = Blind()
    seen = hand.at(hand.start)
    memory = controller.start(seen)
    x0, (centre, axes) = seen.tip_position.copy(), virtual_frame(seen.tip_position)
    pairs = contact_pairs(3)
    per_newton = np.mean([1.0 / np.linalg.norm(x0[j] - x0[i]) for i, j in pairs])
    pull = per_newton * np.mean(hand.desired.internal_force)
    turn = rotation_of((0.05, -0.08, 0.1))
    wanted = seen.object_position + np.array([0.01, 0.02, -0.01])
    x_d = wanted + turn @ (centre - seen.object_position)
    state = hand.near(seed)
    seen = hand.at(state)
    seen.object_coordinates_desired = [*wanted, 0.05, -0.08, 0.1]
    tau = controller.torque(seen, memory)[0] - seen.N_F + 0.005 * seen.joint_velocity

    def potential(seen: Observation) -> float:
        x = seen.tip_position
        x_v, now = virtual_frame(x)
        value = 0.5 * pull * sum(float(np.sum((x[j] - x[i]) ** 2)) for i, j in pairs)
        value += 0.5 * 200.0 * float(np.sum((x_d - x_v) ** 2)) + 0.2 * float(x_v @ seen.gravity)
        return value + 0.3 / 2.0 * float(np.sum(rotation_vector(now, turn @ axes) ** 2))

    assert_allclose(tau, -gradient(hand, state, potential), rtol=0.0, atol=1e-7)


@pytest.mark.parametrize("seed", range(3))
def test_virtual_turning_is_the_rate_of_the_virtual_frame(seed: int) -> None:
    """R' = w x R with w = sum B_i x_i', against differences."""
    rng = np.random.default_rng(seed)
    x, rate = rng.normal(size=(3, 3)), rng.normal(size=(3, 3))
    w = np.einsum("iab,ib->a", virtual_turning(x, virtual_frame(x)[1]), rate)
    slope = (virtual_frame(x + STEP * rate)[1] - virtual_frame(x - STEP * rate)[1]) / (2.0 * STEP)
    assert_allclose(np.cross(w[:, None], virtual_frame(x)[1], axis=0), slope, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_angle_feedback_leaves_a_spring_about_the_normal(pinch: Stage, seed: int) -> None:
    """The forces carry the weight, and their moment about b at the centre of mass is K e - D w; no more, no less."""
    controller = AngleFeedback()
    b, forces = controller.start(pinch.at(pinch.start)), np.empty((2, 3))
    assert_allclose(np.abs(b), [0.0, 1.0, 0.0], atol=1e-12)
    seen = pinch.at(pinch.near(seed))
    seen.object_rpy_desired[1] = 0.2
    contact_forces(seen._views, controller.constants(seen), b, forces)
    assert_allclose(forces.sum(axis=0), [0.0, 0.0, 0.2 * 9.81] + 5.0 * seen.contact_rotation[:, :, 2].sum(axis=0),
                    rtol=0.0, atol=1e-9)  # fmt: skip
    moment = b @ np.cross(seen.contact_point - seen.object_position, forces).sum(axis=0)
    e = b @ rotation_vector(seen.object_rotation, rotation_of((0.0, 0.2, 0.0)))
    assert moment == pytest.approx(0.3 * e - 0.002 * (b @ seen.object_twist[3:]), abs=1e-10)


def test_two_phase_moves_the_tips_so_that_the_object_turns(pinch: Stage) -> None:
    """For a missing angle of 1 rad about b, tip 1 goes K_P along b x u, tip 2 as far against it."""
    controller, seen = TwoPhase(K_P=0.02, K_I=0.0, K_d=0.0), pinch.at(pinch.start)
    memory = controller.start(seen)
    seen.object_rpy_desired[1] = 0.01
    shift = (controller.torque(seen, memory)[0] - holding(seen)) / 2.0  # K_q
    ways = seen.tip_jacobian @ shift
    # pitch is about +y, so a tip at +x goes down
    assert_allclose(ways, 0.02 * 0.01 * np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]), atol=1e-9)


def test_two_phase_integrates_the_error(pinch: Stage) -> None:
    """A constant error of 0.01 rad for 0.5 s adds K_I times 0.005 rad s to the set points."""
    controller, seen = TwoPhase(K_P=0.0, K_I=0.4, K_d=0.0), pinch.at(pinch.start)
    memory = controller.start(seen)
    seen.object_rpy_desired[1], seen.time = 0.01, 0.5
    tau, memory = controller.torque(seen, memory)
    ways = seen.tip_jacobian @ ((tau - holding(seen)) / 2.0)
    assert_allclose(ways[:, 2], 0.4 * 0.5 * 0.01 * np.array([-1.0, 1.0]), atol=1e-9)


# ------------------------------------------------------------------------------------------------------------- runs


def final(recording: Recording) -> tuple[float, float, float]:
    """Errors at the end: position [mm], largest of the angles [deg], largest of the internal forces [N]."""
    position = recording.object_position[-1] - recording.object_position_desired[-1]
    angles = recording.object_rpy[-1] - recording.object_rpy_desired[-1]
    force = recording.internal_force[-1] - recording.internal_force_desired[-1]
    return 1e3 * float(np.linalg.norm(position)), float(np.degrees(np.abs(angles).max())), float(np.abs(force).max())


@pytest.mark.parametrize("name", ["regulation", "finger-only", "object-impedance", "computed-torque"])
def test_these_go_to_the_target(runs: dict[str, Recording], name: str) -> None:
    """Pose and internal force, without a steady error, inside the friction cone."""
    position, angle, force = final(runs[name])
    assert position < 0.02 and angle < 0.06 and force < 0.001
    assert runs[name].friction_use.max() < 1.0


def test_regulation_goes_to_the_target_of_the_pinch() -> None:
    """Two fingers: K is one column, the grasp map singular about the line between the contacts."""
    recording = simulate(load_scenario("pinch"))
    position, angle, force = final(recording)
    assert position < 0.02 and angle < 0.02 and force < 0.001
    assert recording.friction_use.max() < 0.55


@pytest.mark.parametrize("kick", [("y", -5, 0.1), ("roll", -3, 1.0), ("yaw", -1, 1.0)])
def test_the_pinch_is_stable_out_of_its_plane(kick: tuple[str, int, float]) -> None:
    """No joint moves the box along y, in roll or in yaw; the tips hold it there: after a push it swings and stays."""
    values = {"duration": 1.0, "reference.object_position": [0.0, 0.0, 0.142], "reference.object_rpy": [0.0, 0.0, 0.0]}
    simulation = build(load_scenario("pinch", values))
    _, index, speed = kick
    simulation.state.v[index] = speed
    path = []
    while simulation.time < 1.0:
        path.append(simulation.sample().q_O.copy())
        simulation.step()
    away = np.abs(np.array(path) - path[0]).max(axis=0)
    assert away.max() > 1e-4 and away[:3].max() < 0.003 and away[3:].max() < 0.1


@pytest.mark.parametrize(
    ("name", "position", "angle", "force"),
    [("point-contact", 1.88, 1.82, 0.108), ("blind", 4.86, 1.08, 2.30), ("opposing", 0.055, 0.0, 0.117),
     ("angle-feedback", 7.44, 0.006, 0.016), ("two-phase", 3.98, 0.003, 0.023)],
)  # fmt: skip
def test_these_end_where_the_docs_say(
    runs: dict[str, Recording], name: str, position: float, angle: float, force: float
) -> None:
    """Laws that know less keep an error; what it is, is pinned."""
    recording = runs[name]
    assert recording.complete
    assert final(recording) == pytest.approx((position, angle, force), rel=0.03, abs=0.003)
    assert np.abs(recording.joint_velocity[-1]).max() < 0.02


def test_opposing_squeezes_harder_when_told(runs: dict[str, Recording]) -> None:
    """The squeeze goes from 5 N to 8 N, and the tips give way by the square root of it."""
    recording = runs["opposing"]
    assert recording.internal_force[[0, -1], 0] == pytest.approx([5.0, 8.0], abs=0.2)
    depth = recording.deformation[:, :, 0]
    assert_allclose(depth[-1] / depth[0], np.sqrt(8.0 / 5.0), rtol=0.02)


def test_angle_is_reached_from_the_other_side_too() -> None:
    """Both laws of the angle turn the box back as well."""
    for scenario in ("pinch-angle-feedback", "pinch-two-phase"):
        recording = simulate(load_scenario(scenario, {"reference.object_rpy": [0.0, -0.1, 0.0]}))
        assert np.degrees(recording.object_rpy[-1, 1]) == pytest.approx(np.degrees(-0.1), abs=0.02)


def test_the_paper_without_compensation_is_regulation_without(runs: dict[str, Recording]) -> None:
    """Object impedance without compensation keeps the steady error that (59) keeps without it."""
    values = {"controller.torsion_compensation": False}
    impedance = final(simulate(load_scenario("object-impedance", values)))
    paper = final(simulate(load_scenario("target-a", values)))
    assert impedance[:2] == pytest.approx(paper[:2], rel=0.05)
    assert impedance[1] > 0.5
