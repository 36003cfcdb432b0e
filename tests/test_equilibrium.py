"""Where hand and object rest: against periods and runs that settle, and where the answer is known."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import run_command
from numpy.testing import assert_allclose
from test_attitude import TURNS, turned
from test_closed_loop import Delayed, Slow

import softhand
from softhand import Controller, Equilibrium, GraspError, Recording, RecordingError, ScenarioError, State, equilibrium
from softhand.controllers.regulation import Regulation
from softhand.resting import way
from softhand.scenario.file import resolve_path
from softhand.scenario.scenario import Scenario, load_scenario

SLIPS = {"fingertip.contact": "coulomb"}
PUSHED = {"push": [{"force": (0.03, 0.02, 0.0), "start": 0.0, "duration": 1e3}]}


class Summing(Regulation):
    """(59) with the sum of the position error: its memory rests where there is none."""

    def start(self, observation: Any) -> Any:
        return super().start(observation), np.zeros(3)

    def torque(self, observation: Any, memory: Any) -> Any:
        law, total = memory
        total = total + 0.02 * (observation.object_position_desired - observation.object_position)
        moved = observation.copy()
        moved.object_position_desired = observation.object_position_desired + total
        return super().torque(moved, law)[0], (law, total)


@cache
def rest_of(name: str) -> tuple[Scenario, Equilibrium, Controller | None]:
    values: dict[str, tuple[str, dict[str, Any], dict[str, Any]]] = {
        "hold": ("hold", {}, {}),
        "target-a": ("target-a", {}, {}),
        "slips": ("target-a", SLIPS, {}),
        "relaxing": ("target-a", {"fingertip.damping": {"name": "fung"}}, {}),
        "computed-torque": ("computed-torque", {}, {}),
        "allegro-box": ("allegro-box", {}, {}),
        "can": ("can", {}, {}),
        "lifted": ("grasp-and-lift", {}, {"time": 3.0}),
        "on the table": ("grasp-and-lift", {}, {"time": 1.0}),
        "pushed": ("hold", PUSHED, {}),
        "late": ("hold", PUSHED, {"controller": Delayed(**dict(load_regulation()))}),
        "slow": ("hold", PUSHED, {"controller": Slow()}),
        "summing": ("hold", PUSHED, {"controller": Summing(**dict(load_regulation()))}),
    }
    base, changes, options = values[name]
    scenario = load_scenario(base, changes)
    return scenario, equilibrium(scenario, **options), options.get("controller")


def load_regulation() -> Regulation:
    controller = load_scenario("hold").controller
    return Regulation(**{key: value for key, value in controller.parameters.items()})


@pytest.mark.parametrize(
    "name",
    ["hold", "target-a", "slips", "relaxing", "computed-torque", "allegro-box", "can", "lifted", "on the table",
     "pushed", "slow", "summing", pytest.param("late", marks=pytest.mark.slow)],
)  # fmt: skip
def test_the_next_period_maps_it_to_itself(name: str) -> None:
    """Torque, state and memory; with sticking, slipping and relaxing tips, on a table, under pushes and memories."""
    scenario, rest, controller = rest_of(name)
    assert rest.refusal is None
    state = rest.state
    simulation = softhand.build(scenario, controller)
    simulation.reset(state)
    simulation.sample()
    assert_allclose(simulation.torque, rest.torque, rtol=0.0, atol=1e-9)
    simulation.step()
    after = simulation.save()
    assert_allclose(after.q, state.q, rtol=0.0, atol=1e-12)
    assert_allclose(after.v, 0.0, atol=2e-9)
    assert_allclose(after.z[:, :3], state.z[:, :3], rtol=0.0, atol=1e-11)
    if name != "on the table":  # whose reference goes on
        simulation.sample()
        assert_allclose(simulation.torque, rest.torque, rtol=0.0, atol=1e-8)


def off(rest: Equilibrium, run: Recording) -> dict[str, float]:
    """By how much a rest is off the end of a run: joints [rad], object [m], normal forces [N], torsion [N m]."""
    end = run.contact_force[-1]
    pairs = {
        "joints": (rest.joint_position, run.joint_position[-1]),
        "object": (rest.object_position, run.object_position[-1]),
        "force": (rest.normal_force, end[:, 2]),
        "torsion": (rest.torsion, end[:, 3]),
    }
    return {name: float(np.max(np.abs(a - b))) for name, (a, b) in pairs.items()}


@pytest.mark.parametrize(
    ("name", "changes", "duration", "least"),
    [
        ("object-impedance", {}, 6.0, 1e-6),
        ("can", {}, 6.0, 1e-6),
        ("object-impedance", {**SLIPS, "fingertip.friction": 0.36}, 6.0, 1e-6),
        ("hold", PUSHED, 4.0, 5e-7),
    ],
    ids=["sticks", "can", "slips", "pushed"],
)
def test_a_run_that_is_nearly_there_settles_there(
    name: str, changes: dict[str, Any], duration: float, least: float
) -> None:
    """From a sample in its last motion; of the pushed one from the start, 0.4 mm away."""
    run = softhand.simulate(load_scenario(name, {**changes, "duration": duration}))
    assert np.max(np.abs(run.joint_velocity[-1])) < 1e-5
    sample = 0 if name == "hold" else int(np.argmin(np.abs(run.time - 1.3)))
    found = off(equilibrium(run, sample), run)
    assert found["joints"] < least and found["object"] < 2e-7, found
    assert found["force"] < 100.0 * least and found["torsion"] < least, found


@pytest.mark.slow
@pytest.mark.parametrize("changes", [{}, SLIPS], ids=["rolls", "slips"])
def test_it_is_what_runs_come_to_as_the_reference_gets_slow(changes: dict[str, Any]) -> None:
    """Twice as slow is half as far from it: over 27 mm and 27 deg, z follows the way of the reference."""
    gaps = []
    for seconds in (2.0, 4.0):
        values = {**changes, "duration": seconds + 12.0, "reference.duration": seconds}
        scenario = load_scenario("target-a", values)
        gaps.append(off(equilibrium(scenario), softhand.simulate(scenario)))
    assert gaps[1]["joints"] < 2e-4 and gaps[1]["object"] < 1e-9, gaps
    for name in ("joints", "force", "torsion"):
        assert gaps[0][name] / gaps[1][name] == pytest.approx(2.0, rel=0.15), gaps


# ------------------------------------------------------------------------------------------------- known answers


def squeezed(share: float, **options: Any) -> Equilibrium:
    """The gripper's box, the forces of the jaws let go to a share of those at the start."""
    scenario = load_scenario("gripper")
    return equilibrium(scenario, torque=share * equilibrium(scenario, time=0.0).torque, **options)


def test_two_jaws_press_with_the_force_that_is_left() -> None:
    found = squeezed(0.5)
    assert found.refusal is None and not found.limits
    assert_allclose(found.normal_force, 4.0, rtol=1e-8)
    assert_allclose(found.force[:, 2], 0.1 * 9.81, rtol=1e-8)
    assert_allclose(found.limit_surface_use, 0.1 * 9.81 / (0.6 * 4.0), rtol=1e-7)


def test_a_box_that_slips_falls_when_friction_no_longer_carries_it() -> None:
    """2 mu f = m g, and f falls evenly from 8 N to 0.8 N."""
    found = squeezed(0.1)
    least = 0.2 * 9.81 / (2.0 * 0.6)
    assert found.share == pytest.approx((8.0 - least) / (0.9 * 8.0), abs=2e-4)
    assert found.refusal is not None
    assert {(one.what, one.where) for one in found.limits} == {("slip", "left_tip"), ("slip", "right_tip")}
    assert "left_tip is at its limit (slip)" in str(found.refusal)
    assert "the object goes along (0.00, 0.00, -1.00)" in str(found.refusal)
    with pytest.raises(GraspError, match="there is no rest: 88"):
        _ = found.state
    assert np.isnan(found.growth)


def test_limits_of_joints_are_named(tmp_path: Path) -> None:
    """Jaws of 10 N that are asked for 12 N press with 10 N; one that is moved beyond its stop is said to be there."""
    scenario = load_scenario("gripper")
    text = resolve_path(scenario.hand.urdf).read_text()
    (tmp_path / "weak.urdf").write_text(text.replace('effort="40"', 'effort="10"'))
    changes = {"hand.urdf": str(tmp_path / "weak.urdf"), "reference.object_position": scenario.object.position}
    found = equilibrium("gripper", overrides=changes)
    assert [one.what for one in found.limits] == ["effort limit"] * 2
    assert_allclose(found.normal_force, 10.0, rtol=1e-8)
    begin, end = (equilibrium(scenario, time=time).joint_position for time in (0.0, 1.0))
    j = int(np.argmax(end - begin))
    stop = 0.5 * (begin[j] + end[j])
    (tmp_path / "short.urdf").write_text(text.replace('upper="0.050"', f'upper="{stop:.6f}"'))
    found = equilibrium("gripper", overrides={"hand.urdf": str(tmp_path / "short.urdf")})
    assert [(one.what, one.where) for one in found.limits] == [("joint limit", found.joints[j])]


def test_a_box_that_is_lifted_leaves_the_table() -> None:
    _, on, _ = rest_of("on the table")
    _, lifted, _ = rest_of("lifted")
    assert_allclose(np.abs(on.support_force[:, 2]).sum(), 0.2 * 9.81, rtol=2e-3)
    assert {one.what for one in lifted.limits} == {"lift-off"}
    assert_allclose(lifted.force.sum(axis=0), [0.0, 0.0, -0.2 * 9.81], atol=1e-8)


def test_what_gives_way_again_and_again_has_no_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search ends, and says that this is why."""
    monkeypatch.setattr(way, "_MOST_TIMES", 0)
    found = equilibrium("grasp-and-lift", torque=np.zeros(9))
    assert found.refusal is not None and "there is no rest" in str(found.refusal) and not found.gave_way


def test_without_torques_an_open_hand_lies_down_on_the_table() -> None:
    """It gives way, falls, and is carried by its tips; all weight is on the table."""
    found = equilibrium("grasp-and-lift", torque=np.zeros(9))
    assert found.refusal is None and found.gave_way
    carried = {name: force for name, force in zip(found.supports, found.support_force, strict=True) if np.any(force)}
    assert sum(name.endswith("_tip") for name in carried) == 3
    assert any("Balance was lost" in note for note in found.notes())


def test_torques_that_balance_only_just_do_not_hold() -> None:
    """Held torques keep the start at rest, where small motions grow; the controller's do not."""
    scenario, rest, _ = rest_of("hold")
    held = equilibrium(scenario, torque=rest.torque)
    assert np.max(np.abs(held.moved)) < 1e-9
    assert held.growth > 10.0 > 0.0 > rest.growth
    assert any("No run comes to rest there" in note for note in held.notes())


def test_turning_the_scene_turns_it() -> None:
    scenario, Q = load_scenario("can", PUSHED), TURNS["general"]
    push = [{"force": tuple(Q @ np.array([0.03, 0.02, 0.0])), "start": 0.0, "duration": 1e3}]
    here, there = equilibrium(scenario), equilibrium(turned(scenario, Q).with_values({"push": push}))
    assert np.linalg.norm(here.moved[:3]) > 1e-2
    assert_allclose(there.moved, np.kron(np.eye(2), Q) @ here.moved, rtol=0.0, atol=1e-10)
    assert_allclose(there.joint_position, here.joint_position, rtol=0.0, atol=1e-9)
    assert_allclose(there.torque, here.torque, rtol=0.0, atol=1e-9)


def test_a_spring_gives_way_by_the_stiffness_of_the_grasp() -> None:
    """The wrench of a small push over the compliance under the controller."""
    push = {"push": [{"force": (1e-4, 0.0, 0.0), "start": 0.0, "duration": 1e3}]}
    found = equilibrium("hold", overrides=push)
    compliance = softhand.grasp_stiffness(load_scenario("hold"), joints="controller").compliance
    assert_allclose(found.moved[:3], 1e-4 * compliance[:3, 0], rtol=1e-3, atol=1e-10)


# ------------------------------------------------------------------------------------------------- what begins from it


def test_models_begin_there() -> None:
    scenario, rest, _ = rest_of("target-a")
    loop = softhand.linearize(scenario, state=rest.state, closed=True)
    assert loop.closed is not None
    sizes = np.abs(loop.closed.eigenvalues())
    growth = np.log(sizes[np.abs(sizes - 1.0) > 1e-7][0]) / loop.period  # all that z may be is neutral
    assert growth == pytest.approx(rest.growth, abs=0.05)
    assert softhand.stability(scenario, at=rest.state).held_growth == pytest.approx(rest.growth, abs=1e-4)
    stiffness = softhand.grasp_stiffness(scenario, joints="controller", state=rest.state)
    assert_allclose(stiffness.translation[:2], 100.0, rtol=1e-4)
    assert_allclose(stiffness.unbalanced, 0.0, atol=1e-7)
    with pytest.raises(ScenarioError, match="state: q, v and z have the shapes"):
        softhand.stability(load_scenario("gripper"), at=rest.state)


# ------------------------------------------------------------------------------------------------- wrong use


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"time": -1.0}, "time: got -1.0; give a time .s. not before that of the state, 0 s"),
        ({"time": float("nan")}, "time: got nan"),
        ({"torque": [1.0, 2.0]}, "torque: got .1.0, 2.0.; the hand has 9 joints"),
        ({"torque": [float("nan")] * 9}, "the hand has 9 joints, give a finite number for each"),
        ({"sample": 10**6}, "sample: got 1000000"),
        ({"overrides": {"object.mas": 1.0}}, "object.mas"),
        ({"state": State(np.zeros(3), np.zeros(3), np.zeros((3, 3)))}, "state.q: it has shape"),
    ],
)
def test_mistakes_are_told_in_one_line(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        equilibrium("hold", **options)


def test_a_recording_that_lacks_its_states_is_refused() -> None:
    run = softhand.simulate("hold", overrides={"duration": 0.01, "record.variables": ["object_position"]})
    with pytest.raises(RecordingError, match="lacks"):
        equilibrium(run)


def test_the_command(tmp_path: Path) -> None:
    """A table, JSON with units, exit code 1 without a rest, and one line for what is wrong."""
    result = run_command("equilibrium", "target-a", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "at rest" in result.stdout and "finger_2_tip" in result.stdout and "all die out" in result.stdout
    result = run_command("equilibrium", "gripper", "--torque", "0,0", "--json", folder=tmp_path)
    table = json.loads(result.stdout)
    assert result.returncode == 1 and result.errors.startswith("error: there is no rest:")
    assert table["refusal"].startswith("there is no rest") and table["units"]["torque"] == "N m, N"
    for words, message in (
        (["--torque", "a"], "--torque: got 'a'; give numbers"),
        (["--time", "-1"], "time: got -1.0"),
    ):
        result = run_command("equilibrium", "hold", *words, folder=tmp_path)
        assert result.returncode == 1 and message in result.errors and "Traceback" not in result.stderr
