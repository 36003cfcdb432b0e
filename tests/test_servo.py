"""Servos and limits of motors: against what is known of one joint, in both loops, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from joint_rigs import AXES, Finger, inertia_about

import softhand
from softhand import Controller, build, load_scenario, rollout
from softhand.checks.scenario import check_scenario
from softhand.errors import ScenarioError
from softhand.numerics.spatial import rotation_of
from softhand.plant.state import State
from softhand.simulation.actuation import Actuation, act, drive_of
from softhand.simulation.servo import Servos
from softhand.steppers.midpoint import Midpoint

PERIOD, INERTIA = 1e-3, inertia_about(AXES[0])


class Driven:
    """A finger of one joint behind a drive, a control period at a time."""

    def __init__(
        self, servos: Servos | None = None, effort: float = 1.0, speed: float = np.inf, **options: Any
    ) -> None:
        self.finger = finger = Finger(**options)
        self.command, self.limited, none = np.zeros(1), np.zeros(1, np.int8), np.zeros(1)
        actuation = Actuation(0, np.full(1, np.inf), none, none, none, 0, np.array([speed]), servos)
        self.drive = drive_of(
            actuation, self.command, np.array([effort]), finger.torque, self.limited, finger.world.joints,
            finger.state.arrays,
        )  # fmt: skip
        self.integration, self.k = Midpoint(step=PERIOD).start(finger.plant), 0

    def run(self, duration: float) -> None:
        for _ in range(round(duration / PERIOD)):
            act(self.drive, np.array([self.k]))
            self.integration.advance(self.finger.state, self.finger.torque)
            self.k += 1


def servo(kind: str, K: float = 0.0, D: float = 0.0, rate: float = np.inf, most: float = np.inf, every: int = 1,
          commands: int = 1) -> Servos:  # fmt: skip
    return Servos(kind, *(np.array([x]) for x in (K, D, rate * PERIOD, most)), every, commands)


ROTOR = {"armature": 2e-4}


def test_a_position_servo_gives_way_by_load_over_stiffness() -> None:
    """At rest q = q_d + load / K, up to the torque limit of the servo."""
    load = 0.03
    driven = Driven(servo("position", K=2.0, D=0.03), **ROTOR)
    driven.finger.plant.external[0], driven.command[0] = load, 0.4
    driven.run(2.0)
    assert driven.finger.q[0] == pytest.approx(0.4 + load / 2.0, rel=1e-9)
    assert driven.finger.torque[0] == pytest.approx(-load, rel=1e-9)


def test_a_set_point_goes_no_faster_than_its_rate() -> None:
    """The joint follows a ramp behind by D rate / K; then it is at the set point."""
    driven = Driven(servo("position", K=2.0, D=0.03, rate=0.5), **ROTOR)
    driven.run(PERIOD)
    driven.command[0] = 1.0
    driven.run(1.0)
    assert driven.finger.v[0] == pytest.approx(0.5, rel=1e-6)
    assert driven.finger.q[0] == pytest.approx(0.5 - 0.03 * 0.5 / 2.0, abs=1.1 * 0.5 * PERIOD)
    driven.run(3.0)
    assert driven.finger.q[0] == pytest.approx(1.0, abs=1e-9)


def test_a_velocity_servo_gives_way_by_load_over_damping() -> None:
    """At rest q' = v_d + load / D."""
    driven = Driven(servo("velocity", D=0.05), limits=(-90.0, 90.0), **ROTOR)
    driven.finger.plant.external[0], driven.command[0] = 0.01, 1.5
    driven.run(1.0)
    assert driven.finger.v[0] == pytest.approx(1.5 + 0.01 / 0.05, rel=1e-9)


def test_an_impedance_servo_holds_where_the_command_came() -> None:
    """A constant torque that comes every 40 ms: between two of them the joint is on a spring about where it was."""
    driven = Driven(servo("impedance", K=5.0, D=0.05, commands=40), **ROTOR)
    driven.command[0], seen = 0.02, []
    for _ in range(120):
        act(driven.drive, np.array([driven.k]))
        seen.append((driven.finger.torque[0], driven.finger.q[0], driven.finger.v[0]))
        driven.integration.advance(driven.finger.state, driven.finger.torque)
        driven.k += 1
    torque, q, v = np.array(seen).T
    about = np.repeat(q[::40], 40)
    np.testing.assert_allclose(torque, 0.02 + 5.0 * (about - q) - 0.05 * v, rtol=0.0, atol=1e-15)
    assert q[40] > 1e-3 and q[80] - q[40] > 1e-3


def test_a_slow_servo_holds_its_torque_between_samples() -> None:
    """With a period of four control periods only every fourth torque is new, the feedforward apart."""
    driven = Driven(servo("position", K=2.0, D=0.03, every=4), **ROTOR)
    driven.command[0], torques = 0.0, []
    driven.run(PERIOD)
    driven.command[0] = 0.3
    for _ in range(40):
        driven.run(PERIOD)
        torques.append(driven.finger.torque[0])
    changes = np.flatnonzero(np.diff(torques)) + 2
    assert np.all(changes % 4 == 0) and len(changes) == 10


def test_a_motor_runs_at_the_speed_where_its_curve_meets_the_load() -> None:
    """All that is asked for cut to effort (1 - v / v_0): v = v_0 (1 - load / effort), either way round."""
    for way in (1.0, -1.0):
        driven = Driven(effort=0.5, speed=6.0, limits=(-90.0, 90.0), **ROTOR)
        driven.command[0], driven.finger.plant.external[0] = way * 10.0, -way * 0.2
        driven.run(1.0)
        assert driven.finger.v[0] == pytest.approx(way * 6.0 * (1.0 - 0.2 / 0.5), rel=1e-9)
        assert driven.finger.torque[0] == pytest.approx(way * 0.2, rel=1e-9) and driven.limited[0] == 1


def test_a_motor_brakes_with_all_its_torque() -> None:
    """Whatever its speed, and has none left to go faster beyond the limit."""
    driven = Driven(effort=0.5, speed=6.0, **ROTOR)
    driven.finger.v[0], driven.command[0] = 9.0, 10.0
    act(driven.drive, np.array([0]))
    assert driven.finger.torque[0] == 0.0
    driven.command[0] = -10.0
    act(driven.drive, np.array([1]))
    assert driven.finger.torque[0] == -0.5


class Still(Controller):
    """Positions, in plain Python."""

    @property
    def commands(self) -> Any:
        """Positions."""
        return "position"

    def torque(self, observation: Any, memory: Any) -> Any:
        return np.full(len(observation.joint_position), 0.1), memory


LOOPS = {
    "regulation over impedance": ("servo", {}),
    "late and lagging": ("servo", {"actuation.delay": 0.002, "actuation.lag": 0.001, "actuation.servo.period": 0.002,
                                   "controller.period": 0.004}),
    "positions": ("set-points", {"duration": 0.05}),
    "velocities": ("set-points", {"actuation.servo": {"kind": "velocity", "damping": 0.5, "rate_limit": 20.0},
                                  "controller": {"name": "set-points", "velocity": [0.1] * 9}}),
    "coupled": ("coupled-hand", {"hand.joints": {"armature": 1e-5, "damping": 1e-3, "friction": 1e-3,
                                                 "velocity_limit": 5.0, "stop_stiffness": 5.0}}),
    "euler": ("servo", {"stepper": {"name": "semi-implicit-euler", "step": 1e-4}}),
}  # fmt: skip


@pytest.mark.parametrize("name", list(LOOPS))
def test_both_loops_are_equal(name: str) -> None:
    """Python and compiled, to rounding, where all that is of joints and drives is at work."""
    base, values = LOOPS[name]
    scenario = load_scenario(base, {"duration": 0.04, "stepper.terms": "compiled", **values})
    recording = build(scenario).run()
    kept = ("joint_position", "joint_velocity", "object_position")
    runs = rollout(scenario, {"object.mass": [0.2, 0.21]}, variables=kept, every=PERIOD)
    for variable in kept:
        whole = getattr(recording, variable)
        scale = np.max(np.abs(whole))
        np.testing.assert_allclose(runs[variable][0], whole, rtol=0.0, atol=1e-9 * scale)
    assert np.all(runs.compiled)


@pytest.mark.parametrize("name", ["late and lagging", "positions", "coupled"])
def test_a_run_that_is_cut_goes_on_to_the_last_bit(name: str) -> None:
    """Saved in the middle, between two commands, and taken up by another simulation."""
    base, values = LOOPS[name]
    scenario = load_scenario(base, {"duration": 0.03, **values})
    whole = build(scenario).run()
    first, second = build(scenario), build(scenario)
    first.run(until=0.0131)
    np.testing.assert_array_equal(second.run(start=first.save()).joint_position, whole.joint_position[13:])


def test_the_command_is_recorded_as_what_it_is() -> None:
    """Positions in rad, torques in N m, each under its own name."""
    recording = build(load_scenario("set-points", {"duration": 0.005})).run()
    assert "joint_torque_commanded" not in recording.variables
    np.testing.assert_allclose(recording.joint_position_commanded[0] - recording.joint_position[0],
                               load_scenario("set-points").controller.parameters["offset"], atol=1e-12)  # fmt: skip
    assert set(recording.units("joint_position_commanded")) == {"rad"}
    recording = build(load_scenario("servo", {"duration": 0.005})).run()
    assert "joint_torque_commanded" in recording.variables


def test_regulation_needs_its_servos() -> None:
    """At 5 ms the loop is lost without them, and at its target with them."""
    recording = softhand.simulate("servo")
    target = load_scenario("servo").reference.object_position
    assert np.linalg.norm(recording.object_position[-1] - target) < 2e-3
    assert np.max(np.abs(recording.joint_velocity[-1])) < 0.02
    with pytest.raises(softhand.SimulationStopped):
        build(load_scenario("servo", {"actuation": None})).run()


def test_set_points_squeeze_and_lift() -> None:
    """8 mm up, at the squeeze of the start, with nothing measured but the joints."""
    recording = softhand.simulate("set-points")
    moved = recording.object_position[-1] - recording.object_position[0]
    np.testing.assert_allclose(moved, [0.0, 0.004, 0.008], atol=3e-4)
    np.testing.assert_allclose(recording.internal_force[-1], [4.0, 4.0, 3.0], atol=0.1)


def test_a_hand_of_set_points_that_is_turned_does_the_same() -> None:
    """Hand, object and gravity turned about the origin, off every axis."""
    scenario = load_scenario("set-points", {"duration": 0.1, "controller.duration": 0.1})
    Q = rotation_of((-2.0, 0.7, 1.3))
    here = build(scenario).run()
    turned = {
        "gravity": (Q @ scenario.gravity).tolist(),
        "hand.rpy": pin.rpy.matrixToRpy(Q).tolist(),
        "object.position": (Q @ scenario.object.position).tolist(),
        "object.rpy": pin.rpy.matrixToRpy(Q).tolist(),
    }
    there = build(scenario.replace(turned)).run()
    assert np.ptp(here.joint_position, axis=0).max() > 0.01
    np.testing.assert_allclose(there.joint_position, here.joint_position, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(there.object_position, here.object_position @ Q.T, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("base", "values", "message"),
    [
        ("set-points", {"actuation": None}, "commands a position of each joint; of servos it needs one"),
        ("servo", {"actuation.servo": {"kind": "position", "stiffness": 1.0}}, "commands a torque of each joint"),
        ("servo", {"actuation.servo.kind": "velocity"}, 'kind "velocity" has no stiffness'),
        ("servo", {"actuation.servo": {"kind": "position"}}, "does nothing without stiffness"),
        ("servo", {"actuation.servo.rate_limit": 1.0}, 'kind "impedance" has no set point'),
        ("servo", {"actuation.servo.stiffness": [1.0, 2.0]}, r"actuation\.servo\.stiffness: .* 9 joints need"),
        ("servo", {"actuation.servo.period": 0.0004}, r"actuation\.servo\.period: .*nearest good value is 0\.001"),
        ("set-points", {"controller.position": [0.1, 0.2]}, r"controller\.position: got 2 numbers"),
        ("set-points", {"record.variables": ["joint_torque_commanded"]}, "joint_torque_commanded"),
        ("servo", {"record.variables": ["joint_position_commanded"]}, "there under a position servo alone"),
        ("servo", {"stepper.name": "rk4", "stepper.step": 1e-4}, "does not know dry friction"),
        ("servo", {"hand.joints.armature": {"elbow": 1.0}}, r"hand\.joints\.armature: the hand has no joint"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told(base: str, values: dict[str, Any], message: str) -> None:
    """With the key and the remedy."""
    with pytest.raises((ScenarioError, softhand.ControllerError), match=message):
        build(load_scenario(base, values)).sample()


def test_a_motor_that_would_chatter_is_told() -> None:
    """By how much inertia is missing; with that it runs steadily, and without it does not."""
    for armature, chatters in ((1e-6, True), (2e-4, False)):
        scenario = load_scenario("target-a", {"hand.joints": {"armature": armature, "velocity_limit": 8.0}})
        told = [line for line in check_scenario(scenario).warnings if "chatters" in line]
        assert bool(told) == chatters
    steady = []
    for inertia in (1.05, 0.95):  # of what is needed, effort period / 2 v_0
        driven = Driven(effort=0.5, speed=6.0, limits=(-900.0, 900.0), armature=0.5 * PERIOD / 12.0 * inertia - INERTIA)
        driven.command[0], driven.finger.plant.external[0] = 10.0, -0.1
        driven.run(1.0)
        before = driven.finger.v[0]
        driven.run(PERIOD)
        steady.append(abs(driven.finger.v[0] - before) < 0.1)
    assert steady == [True, False]


def test_a_linear_model_has_rotors_damping_and_stops() -> None:
    """One column of A, the velocity of a joint, beside differences of the run itself."""
    joints = {"armature": 1e-4, "damping": 0.02, "stop_stiffness": 5.0, "stop_damping": 0.2}
    scenario = load_scenario("target-a", {"hand.joints": joints, "duration": 0.01})
    simulation = build(scenario)
    simulation.sample()
    torque, start, nv, move = simulation.torque.copy(), simulation.save(), len(simulation.state.v), 1e-5

    def end(change: float) -> Any:
        v = start.v.copy()
        v[1] += change
        simulation.reset(State(start.q, v, start.z))
        simulation.step(torque)
        return simulation.state.v.copy()

    expected = (end(move) - end(-move)) / (2.0 * move)
    found = softhand.linearize(scenario).A[nv : 2 * nv, nv + 1]
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-6)
    assert expected[1] < 0.95


NO_SERVO = {"actuation": None, "controller.period": 0.001}


@pytest.mark.parametrize(
    ("tool", "values", "key"),
    [
        (softhand.linearize, {}, "hand.joints.friction"),
        (softhand.linearize, {"hand.joints": None}, "actuation.servo"),
        (softhand.stability, {}, "hand.joints.friction"),
        (softhand.stability, {"hand.joints": None}, "actuation.servo"),
        (softhand.equilibrium, {}, "hand.joints.friction"),
        (lambda scenario: softhand.grasp_stiffness(scenario, joints="controller"), {}, "hand.joints.friction"),
        (lambda scenario: softhand.gradient(scenario, softhand.QuadraticCost("joint_torque"), ["object.mass"]),
         {**NO_SERVO, "hand.joints": {"damping": 0.1}}, "hand.joints.damping"),
        (lambda scenario: softhand.gradient(scenario, softhand.QuadraticCost("joint_torque"), ["object.mass"]),
         {**NO_SERVO, "hand.joints": {"velocity_limit": 8.0}}, "hand.joints.velocity_limit"),
    ],
)  # fmt: skip
def test_tools_say_what_they_do_not_model(tool: Any, values: dict[str, Any], key: str) -> None:
    """In the place of a number that belongs to another hand."""
    with pytest.raises(ScenarioError) as caught:
        tool(load_scenario("servo", values))
    assert caught.value.key == key
