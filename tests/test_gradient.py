"""What the cost of a whole run is by parameters and torques, against differences of whole runs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from commands import run_command

import softhand
from softhand import QuadraticCost

END = [
    QuadraticCost("object_position", "object_position_desired", 1e6, terminal=True),
    QuadraticCost("joint_torque"),
]
SHORT = {"duration": 0.05}
BULK = {"law": "bulk", "radius": 0.010, "friction": 0.9, "contact": "coulomb"}
SLIPPERY = {"fingertip.contact": "coulomb", "fingertip.friction": 0.36, "duration": 0.23}


def _cost(recording):
    off = recording.object_position[-1] - recording.object_position_desired[-1]
    return 1e6 * off @ off + 1e-3 * np.sum(recording.joint_torque**2)


def _differences(value, at, share):
    """Central ones of `value` at a number, extrapolated twice."""
    slopes = []
    for k in range(3):
        h = share * (abs(at) or 1.0) / 2**k
        slopes.append((value(at + h) - value(at - h)) / (2 * h))
    once = [(4 * slopes[k + 1] - slopes[k]) / 3 for k in range(2)]
    return (16 * once[1] - once[0]) / 15


@pytest.mark.parametrize(
    ("key", "share"), [("object.mass", 0.02), ("fingertip.k_r", 0.02), ("controller.K_O_position", 0.02)]
)
def test_a_closed_loop_in_stick_is_that_of_differences(key, share):
    found = softhand.gradient("target-a", END, ["mass", "k_r", "K_O_position"], overrides=SHORT)
    at = found.values[found.parameters.index(key)]
    wanted = _differences(lambda x: _cost(softhand.simulate("target-a", overrides={**SHORT, key: x})), at, share)
    assert found[key] == pytest.approx(wanted, rel=2e-7)
    assert found.value == pytest.approx(_cost(softhand.simulate("target-a", overrides=SHORT)), rel=1e-12)
    assert found.switches == ()


@pytest.mark.slow
def test_an_object_of_several_parts_is_followed():
    """A mug, whose nearest part is found anew at each contact; tangent and adjoint."""
    short = {"duration": 0.1, "fingertip.contact": "coulomb"}
    back = softhand.gradient("mug", END, ["mass", "k_r"], overrides=short)
    forth = softhand.gradient("mug", END, ["mass", "k_r"], mode="tangent", overrides=short)
    np.testing.assert_allclose(forth.slopes, back.slopes, rtol=1e-9)
    for key, at in zip(back.parameters, back.values, strict=True):
        wanted = _differences(lambda x, key=key: _cost(softhand.simulate("mug", overrides={**short, key: x})), at, 1e-3)
        assert back[key] == pytest.approx(wanted, rel=2e-7)


def test_the_start_and_the_reference_count_too():
    keys = ["grasp.contact_points[0][1]", "reference.object_position[1]"]
    found = softhand.gradient("target-a", END, keys, overrides=SHORT)
    points = [[0.028, 0.0, 0.0], [-0.028, 0.0, 0.0], [0.0, -0.018, -0.005]]

    def with_point(y):
        points[0][1] = y
        return _cost(softhand.simulate("target-a", overrides={**SHORT, "grasp.contact_points": points}))

    def with_target(y):
        return _cost(softhand.simulate("target-a", overrides={**SHORT, "reference.object_position": [-0.01, y, 0.127]}))

    assert found[keys[0]] == pytest.approx(_differences(with_point, 0.0, 1e-4), rel=2e-7)
    assert found[keys[1]] == pytest.approx(_differences(with_target, 0.03, 1e-2), rel=2e-7)


@pytest.mark.parametrize("name", ["target-a", pytest.param("can", marks=pytest.mark.slow)])
def test_moments_are_followed(name: str) -> None:
    """A law of the lean, relaxing and on a round object, tangent and adjoint."""
    short = {"duration": 0.05, "fingertip": {**BULK, "damping": {"name": "fung"}}}
    back = softhand.gradient(name, END, ["mass", "k_along"], overrides=short)
    forth = softhand.gradient(name, END, ["mass", "k_along"], mode="tangent", overrides=short)
    np.testing.assert_allclose(forth.slopes, back.slopes, rtol=1e-9)
    for key, at in zip(back.parameters, back.values, strict=True):
        wanted = _differences(lambda x, key=key: _cost(softhand.simulate(name, overrides={**short, key: x})), at, 2e-3)
        assert back[key] == pytest.approx(wanted, rel=1e-6)


def test_tangent_and_adjoint_agree():
    keys = ["mass", "k_r", "K_O_position", "reference.object_position", "wrench"]
    back, forth = (
        softhand.gradient("target-a", END, keys, mode=mode, overrides=SHORT) for mode in ("adjoint", "tangent")
    )
    np.testing.assert_allclose(back.slopes, forth.slopes, rtol=1e-9)


def test_a_wrench_is_a_push():
    found = softhand.gradient("target-a", END, ["wrench"], overrides=SHORT)

    def pushed(force):
        push = {"force": [0.0, force, 0.0], "duration": 1.0}
        return _cost(softhand.simulate("target-a", overrides={**SHORT, "push": [push]}))

    assert found["wrench force y"] == pytest.approx(_differences(pushed, 0.0, 0.02), rel=2e-7)


def test_slip_is_followed_and_told():
    found = softhand.gradient("target-a", END, ["mass", "friction"], overrides=SLIPPERY)
    for key, share in (("object.mass", 6e-5), ("fingertip.friction", 6e-5)):
        at = found.values[found.parameters.index(key)]
        wanted = _differences(
            lambda x, key=key: _cost(softhand.simulate("target-a", overrides={**SLIPPERY, key: x})), at, share
        )
        assert found[key] == pytest.approx(wanted, rel=1e-6)
    (switch,) = found.switches
    assert (switch.where, switch.what, switch.to) == ("finger_2_tip", "slip", "slips")
    recording = softhand.simulate("target-a", overrides=SLIPPERY)
    slips = recording.is_slipping[:, 1] > 0
    assert recording.time[np.argmax(slips)] == pytest.approx(switch.time, abs=1e-9)


def test_tips_that_lift_off_are_followed():
    over = {"fingertip.contact": "coulomb", "duration": 0.03}
    torque = -0.2 * softhand.simulate("hold", duration=0.03).joint_torque[:-1]
    cost = QuadraticCost("object_position", 0.0, 1e4, terminal=True)
    found = softhand.gradient("hold", cost, ["gravity[2]"], torque=torque, overrides=over)

    def falling(g):
        simulation = softhand.build("hold", overrides={**over, "gravity": [0.0, 0.0, g]})
        for row in torque:
            simulation.sample()
            simulation.step(row)
        return 1e4 * np.sum(simulation.sample().object_position ** 2)

    lifted = {one.where for one in found.switches if one.to == "lifts off"}
    assert lifted == {"finger_1_tip", "finger_2_tip", "finger_3_tip"}
    assert found["gravity[2]"] == pytest.approx((falling(-9.8099) - falling(-9.8101)) / 2e-4, rel=1e-6)


class Springs(softhand.Controller):
    """Springs at the joints towards angles beside those of the start, with an integral."""

    stiffness: float = 0.5
    """[N m/rad]"""
    beside: float = 0.01
    """[rad]"""

    def start(self, observation):
        """What is held."""
        return {"angles": observation.joint_position.copy(), "forces": observation.f_C.copy(), "sum": np.zeros(9)}

    def torque(self, observation, memory):
        """Gravity, the forces of the start, springs."""
        off = observation.joint_position - memory["angles"] - self.beside
        total = memory["sum"] + 0.001 * off
        torque = observation.gravity_torque + observation.hand_force_jacobian.T @ memory["forces"]
        return torque - self.stiffness * off - 0.1 * total, {**memory, "sum": total}


@pytest.mark.slow
def test_a_controller_in_plain_python_is_differenced():
    over = {"duration": 0.02}
    keys = ["mass", "controller.stiffness"]
    found = softhand.gradient("target-a", END, keys, controller=Springs(), overrides=over)
    forth = softhand.gradient("target-a", END, keys, controller=Springs(), overrides=over, mode="tangent")
    np.testing.assert_allclose(found.slopes, forth.slopes, rtol=1e-9)
    stiffer = _differences(
        lambda x: _cost(softhand.simulate("target-a", Springs(stiffness=x), overrides=over)), 0.5, 0.02
    )
    heavier = _differences(
        lambda x: _cost(softhand.simulate("target-a", Springs(), overrides={**over, "object.mass": x})), 0.2, 0.02
    )
    assert found["controller.stiffness"] == pytest.approx(stiffer, rel=1e-6)
    assert found["object.mass"] == pytest.approx(heavier, rel=1e-6)


class Held(softhand.Controller):
    """The same springs without an integral, as a formula."""

    stiffness: float = 0.5
    """[N m/rad]"""

    def start(self, observation):
        """Angles and torques of the start."""
        return np.concatenate([observation.joint_position, observation.hand_force_jacobian.T @ observation.f_C])

    @staticmethod
    def formula(observed, settings, memory, torque):
        """Springs towards angles beside those of the start."""
        n = torque.shape[0]
        for j in range(n):
            off = observed.joint_position[j] - memory[j] - 0.01
            torque[j] += observed.gravity_torque[j] + memory[n + j] - settings.stiffness * off


@pytest.mark.slow
def test_a_formula_of_ones_own_is_followed(monkeypatch):
    monkeypatch.setattr("softhand.derivatives.gradient.InPython", None)  # it is not differenced
    over = {"duration": 0.02}
    found = softhand.gradient("target-a", END, ["controller.stiffness"], controller=Held(), overrides=over)
    wanted = _differences(lambda x: _cost(softhand.simulate("target-a", Held(stiffness=x), overrides=over)), 0.5, 0.02)
    assert found["controller.stiffness"] == pytest.approx(wanted, rel=1e-6)


def test_torques_of_ones_own():
    held = softhand.simulate("hold", overrides={"duration": 0.02}).joint_torque[:-1]
    cost = QuadraticCost("object_position", [0.0, 0.01, 0.15], 1e4, terminal=True)
    found = softhand.gradient("hold", cost, ["mass"], torque=held, overrides={"duration": 0.02})
    assert found.torque.shape == held.shape

    def with_torque(x):
        simulation = softhand.build("hold", overrides={"duration": 0.02})
        for k, row in enumerate(held):
            simulation.sample()
            simulation.step(row + (k == 5) * x * np.eye(9)[2])
        off = simulation.sample().object_position - [0.0, 0.01, 0.15]
        return 1e4 * off @ off

    assert found.torque[5, 2] == pytest.approx(_differences(with_torque, 0.0, 1e-3), rel=1e-6)


def test_a_function_is_what_its_formula_is():
    def square(joint_torque):
        return joint_torque @ joint_torque

    one = softhand.gradient("target-a", square, ["mass"], overrides=SHORT)
    other = softhand.gradient("target-a", QuadraticCost("joint_torque"), ["mass"], overrides=SHORT)
    assert one.value == pytest.approx(other.value, rel=1e-12)
    assert one["mass"] == pytest.approx(other["mass"], rel=1e-9)
    assert list(one.costs) == ["square"]


def test_a_second_gradient_is_the_first():
    first, second = (softhand.gradient("target-a", END, ["mass"], overrides=SHORT) for _ in range(2))
    assert np.array_equal(first.slopes, second.slopes)


def test_it_is_a_record():
    found = softhand.gradient("target-a", END, ["mass"], overrides=SHORT)
    table = json.loads(found.to_json())
    assert table["parameters"] == ["object.mass"]
    assert table["slopes"] == found.slopes.tolist()
    assert found.rows()[0]["unit"] == "kg"
    with pytest.raises(KeyError, match=r"no parameter 'friction'; there are: object\.mass"):
        found["friction"]


MISTAKES = {
    r"parameters: mas: no key of the scenario ends so. Did you mean mass": {"parameters": ["mas"]},
    r"parameters: 'object\.mas' is no key of the scenario": {"parameters": ["object.mas"]},
    r"parameters: controller\.name is .*no number": {"parameters": ["controller.name"]},
    r"contact_points\[7\] is no part": {"parameters": ["contact_points[7]"]},
    r"contact point \(28\.01, 0, 0\) mm": {"parameters": ["contact_points[0][0]"]},
    r"cost: got 3": {"cost": 3},
    r"cost: there is none": {"cost": []},
    r"cost: 'object_positoin' is no variable of a recording; did you mean 'object_position'": {
        "cost": QuadraticCost("object_positoin")
    },
    r"cost: measured_object_rpy is there in runs with instruments": {"cost": QuadraticCost("measured_object_rpy")},
    r"cost: is_slipping is 0, 1": {"cost": QuadraticCost("is_slipping")},
    r"cost: wanted of object_position is \[1, 2\]": {"cost": QuadraticCost("object_position", [1, 2])},
    r"torque: got an array of shape \(3, 9\); give finite numbers of shape \(50, 9\)": {"torque": np.zeros((3, 9))},
    r"stepper\.name: got 'rk4'": {"overrides": {**SHORT, "stepper.name": "rk4"}},
    r"mode: got 'sideways'": {"mode": "sideways"},
    r"controller\.K_v does nothing where torques are given": {"torque": np.zeros((50, 9)), "parameters": ["K_v"]},
}


def nothing(object_position):
    """No number."""
    return np.nan * object_position[0]


MISTAKES[r"cost: nothing is nan at t = 0 s"] = {"cost": nothing}


@pytest.mark.parametrize("message", MISTAKES)
def test_mistakes_are_named(message):
    asked = {"cost": END, "parameters": [], "overrides": SHORT, **MISTAKES[message]}
    with pytest.raises(softhand.ScenarioError, match=message):
        softhand.gradient("target-a", **asked)


class Counted(Springs):
    """Has a whole number among its settings."""

    count: int = 3
    """[1]"""


def test_a_whole_number_is_refused():
    with pytest.raises(softhand.ScenarioError, match=r"parameters: controller\.count is 3, a whole number"):
        softhand.gradient("target-a", END, ["controller.count"], controller=Counted(), overrides=SHORT)


def test_a_run_that_is_lost_says_so():
    with pytest.raises(softhand.SimulationStopped, match="t = "):
        softhand.gradient("hold", QuadraticCost("object_position"), torque=np.full((300, 9), 0.4), duration=0.3)


# --------------------------------------------------------------------------------------------------- the command


def test_the_command_prints_what_the_call_returns(tmp_path: Path) -> None:
    terms = ("--cost", "object_position=object_position_desired*1e6@end", "--cost", "joint_velocity*0.01")
    result = run_command(
        "gradient", "hold", *terms, "--parameter", "mass", "--duration", "0.02", "--set", "object.mass=0.3", "--json",
        "--out", "bars.png", folder=tmp_path,
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    cost = [
        softhand.QuadraticCost("object_position", "object_position_desired", 1e6, terminal=True),
        softhand.QuadraticCost("joint_velocity", weight=0.01),
    ]
    found = softhand.gradient("hold", cost, ["mass"], duration=0.02, overrides={"object.mass": 0.3})
    told = json.loads(result.stdout)
    assert told["value"] == pytest.approx(found.value, rel=1e-12)
    assert told["slopes"] == pytest.approx(found.slopes.tolist(), rel=1e-9)
    assert (tmp_path / "bars.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--cost", "joint_velocity*a"), "got 'joint_velocity*a'; give VARIABLE"),
        (("--cost", "joint_speed"), "'joint_speed' is no variable of a recording"),
        (("--parameter", "nonsense"), "nonsense: no key of the scenario ends so"),
    ],
)
def test_what_the_command_cannot_use_is_named(options: tuple[str, str], message: str, tmp_path: Path) -> None:
    result = run_command("gradient", "hold", *options, folder=tmp_path)
    assert result.returncode in (1, 2) and message in result.stderr and "Traceback" not in result.stderr
