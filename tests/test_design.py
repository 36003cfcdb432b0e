"""Gains by design: costs, optimum, poles and symmetry of the regulator; gains by bandwidth; what is refused."""

from __future__ import annotations

import importlib.util
import json
import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from commands import run_command
from hands import DATA, REPOSITORY, Array
from numpy.testing import assert_allclose
from test_attitude import TURNS

import softhand
from softhand.closed_loop.linearize import beside
from softhand.controllers.gain_file import read_gain_file
from softhand.design.lqr import LqrDesign
from softhand.errors import GraspError, ScenarioError
from softhand.numerics.spatial import rotation_of
from softhand.plant.state import State

SUMS = {"object_position_integral": 1e7, "internal_force_integral": 100.0}


@pytest.fixture(scope="module")
def design() -> LqrDesign:
    return softhand.design_lqr("hold", SUMS)


def with_gains(file: Path, name: str = "hold", **values: Any) -> softhand.Scenario:
    controller = {"name": "state-feedback", "gain_file": str(file)}
    return softhand.load_scenario(name, {"controller": controller, **values})


def run(design: LqrDesign, file: Path, x0: Array, count: int) -> tuple[float, Array]:
    """Cost of so many periods from x0, and x before each and after the last; the plant in the steps of the design."""
    stepper = {"name": "midpoint", "step": 1e-4}
    simulation = softhand.build(with_gains(file, duration=10.0, stepper=stepper))
    rest, n = design.state, len(design.inputs)
    state = beside(simulation.plant, State(rest.q, rest.v, rest.z), x0)
    simulation.reset(State(state.q, state.v, state.z, rest.time))
    sums, cost, rows = np.zeros(len(design.A) - len(x0)), 0.0, []
    for k in range(count + 1):
        seen = simulation.sample()
        moved = pin.difference(simulation.plant.world.model, rest.q, simulation.state.q)
        x = np.concatenate([moved, simulation.state.v, sums])
        rows.append(x)
        if k == count:
            break
        u = simulation.torque - design.gains.torque
        cost += design.period * (x @ design.Q @ x + u @ design.R @ u)
        error = np.concatenate([moved[n:], seen.internal_force - seen.internal_force_desired])
        sums = sums + design.period * error[list(design.gains.integrals)]
        simulation.step()
    return float(cost), np.array(rows)


def small(seed: int, n: int) -> Array:
    """A disturbance of joints [rad], object [m, rad] and rates."""
    rng = np.random.default_rng(seed)
    sizes = [1e-6] * n + [1e-7] * 3 + [1e-6] * 3
    return np.concatenate([rng.normal(0.0, sizes), 50.0 * rng.normal(0.0, sizes)])


def test_a_run_costs_what_the_design_says(design: LqrDesign, tmp_path: Path) -> None:
    """x^T P x, with the sums of errors; and the first periods are those of A - B K."""
    design.save(tmp_path / "gains.toml")
    x0 = small(0, len(design.inputs))
    cost, rows = run(design, tmp_path / "gains.toml", x0, 400)
    assert design.cost(rows[-1]) < 0.05 * design.cost(x0)
    assert_allclose(cost + design.cost(rows[-1]), design.cost(x0), rtol=2e-4)
    step = design.A - design.B @ design.K
    for before, after in pairwise(rows[:20]):
        assert np.max(np.abs(after - step @ before)) < 1e-3 * np.max(np.abs(before))


def test_no_other_gains_cost_less(design: LqrDesign, tmp_path: Path) -> None:
    """Runs with gains that are off by a few percent, in any direction, cost more."""
    x0, rng = small(1, len(design.inputs)), np.random.default_rng(2)
    design.save(tmp_path / "best.toml")
    best, _ = run(design, tmp_path / "best.toml", x0, 400)
    for k in range(3):
        off = 1.0 + 0.1 * rng.choice([-1.0, 1.0], design.gains.K.shape)
        replace(design.gains, K=design.gains.K * off).write(tmp_path / f"off-{k}.toml")
        assert run(design, tmp_path / f"off-{k}.toml", x0, 400)[0] > best


def test_p_solves_its_equation(design: LqrDesign) -> None:
    """The cost of going on for ever with K, summed by hand, is P."""
    step = design.A - design.B @ design.K
    now = design.period * (design.Q + design.K.T @ design.R @ design.K)
    assert_allclose(now + step.T @ design.P @ step, design.P, rtol=0.0, atol=1e-7 * np.max(np.abs(design.P)))
    assert abs(design.poles()[0]) < 1.0


def test_stability_finds_the_poles_of_the_design(design: LqrDesign, tmp_path: Path) -> None:
    """The controller that runs, differenced through what it is handed and remembers, has the multipliers of A - B K."""
    design.save(tmp_path / "gains.toml")
    found = softhand.stability(with_gains(tmp_path / "gains.toml"), at=design.state)
    assert_allclose(found.held_growth, design.growth, rtol=1e-3)
    values = np.linalg.eigvals(found.loop.step)
    for pole in design.poles():
        assert np.min(np.abs(values - pole)) < 1e-4


@pytest.mark.parametrize("turn", ["general", pytest.param("seam", marks=pytest.mark.slow)])
def test_turning_everything_turns_nothing_in_the_gains(turn: str) -> None:
    """They are in joints and in axes of the object; off every axis, and onto the seams of roll, pitch and yaw."""
    here, there = softhand.design_lqr("hold", SUMS), softhand.design_lqr(turned_hold(TURNS[turn]), SUMS)
    assert_allclose(there.K, here.K, rtol=0.0, atol=1e-4 * np.max(np.abs(here.K)))
    assert_allclose(there.gains.torque, here.gains.torque, rtol=0.0, atol=1e-9)
    assert_allclose(there.gains.joint_follow[:, :6], here.gains.joint_follow[:, :6], rtol=0.0, atol=1e-4)


def turned_hold(Q: Array) -> softhand.Scenario:
    """`hold` as a whole turned about the origin, gravity with it."""
    scenario = softhand.load_scenario("hold")

    def angles(R: Array) -> list[float]:
        return np.asarray(pin.rpy.matrixToRpy(R)).tolist()

    hand, thing = scenario.hand, scenario.object
    return scenario.with_values({
        "gravity": (Q @ scenario.gravity).tolist(), "hand.position": (Q @ hand.position).tolist(),
        "hand.rpy": angles(Q @ rotation_of(hand.rpy)), "object.position": (Q @ thing.position).tolist(),
        "object.rpy": angles(Q @ rotation_of(thing.rpy)),
    })  # fmt: skip


def test_fingers_that_are_mirror_images_have_gains_that_are() -> None:
    """The hold is its own mirror image in x: fingers 1 and 2 change places, and abductions their sign."""
    design = softhand.design_lqr("hold")
    n = len(design.inputs)
    swap = np.kron(np.array([[0, 1, 0], [1, 0, 0], [0, 0, 1]]), np.diag([-1.0, 1.0, 1.0]))
    body = np.diag([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])  # turns are axial
    mirror = np.kron(np.eye(2), np.block([[swap, np.zeros((n, 6))], [np.zeros((6, n)), body]]))
    assert_allclose(swap @ design.K @ mirror, design.K, rtol=0.0, atol=1e-4 * np.max(np.abs(design.K)))


def test_another_pose_nearby_is_held_with_the_gains_of_this_one(design: LqrDesign, tmp_path: Path) -> None:
    """Rests go with what is asked for to first order: the pose is off by the square of the way, and sums end that."""
    softhand.design_lqr("hold").save(tmp_path / "gains.toml")
    design.save(tmp_path / "sums.toml")
    off = []
    for file, way in (("gains.toml", 2e-3), ("gains.toml", 1e-3), ("sums.toml", 2e-3)):
        asked = {"kind": "minimum-jerk", "duration": 0.5, "object_position": [way, 0.010, 0.142],
                 "object_rpy": [0.0, 0.0, 0.0], "internal_force": [4.0, 4.0, 3.0]}  # fmt: skip
        recording = softhand.simulate(with_gains(tmp_path / file, reference=asked, duration=4.0))
        assert recording.complete and np.max(np.abs(recording.joint_velocity[-1])) < 1e-3
        off.append(float(np.linalg.norm(recording.object_position[-1] - asked["object_position"])))
    assert 3.0 < off[0] / off[1] < 5.0
    assert off[2] < 0.1 * off[0]


def refused(message: str, function: Callable[[], Any], error: type[Exception] = ScenarioError) -> Exception:
    with pytest.raises(error) as caught:
        function()
    assert message in str(caught.value), caught.value
    return caught.value


def test_wrong_wishes_are_told() -> None:
    """One line each, with the thing, its value and what is allowed."""
    refused("weights.object_position: got -1", lambda: softhand.design_lqr("hold", {"object_position": -1}))
    refused("weights.torque", lambda: softhand.design_lqr("hold", {"torque": 0.0}))
    refused("Did you mean weights.object_position", lambda: softhand.design_lqr("hold", {"object_positon": 1}))
    refused(
        "weights.torque: got 2 numbers; give one, or 9", lambda: softhand.design_lqr("hold", {"torque": [1.0, 2.0]})
    )
    refused("bandwidth: got -1", lambda: softhand.design_gains("hold", -1.0))
    refused("damping: got 0", lambda: softhand.design_gains("hold", 1.0, 0))
    refused("delay: got -0.1", lambda: softhand.design_gains("hold", 1.0, delay=-0.1))
    refused("'blind' cannot be designed", lambda: softhand.design_gains("hold", 1.0, controller="blind"))


def test_a_state_that_is_no_rest_is_refused() -> None:
    """With what moves there."""
    simulation = softhand.build("hold")
    simulation.state.v[0] = 0.1
    state = State(simulation.state.q.copy(), simulation.state.v.copy(), simulation.state.z.copy())
    refused("is no rest: finger_1_abduction moves at 0.1 rad/s", lambda: softhand.design_lqr("hold", state=state))


def test_motions_out_of_reach_and_out_of_sight_are_named() -> None:
    """More sums of errors than there are torques; a cost in which nothing of the pose appears."""
    every = {"object_position_integral": 1.0, "object_orientation_integral": 1.0, "internal_force_integral": 1.0}
    error = refused("cannot be controlled", lambda: softhand.design_lqr("pinch", every), GraspError)
    assert error.quantity == "uncontrollable"  # type: ignore[attr-defined]
    nothing = dict.fromkeys(("object_position", "object_orientation", "internal_force", "joint_velocity"), 0.0)
    error = refused("does not show in the cost", lambda: softhand.design_lqr("hold", nothing), GraspError)
    assert error.quantity == "undetectable" and "object" in str(error)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joints": ["a"] * 8}, "joint_position: has shape (9,)"),
        ({"period": -1.0}, "period: got -1"),
        ({"K": [[math.nan] * 30] * 9}, "K: has something that is no finite number"),
        ({"integrals": [40]}, "integrals: got"),
        ({"format": "x"}, "is no gain file"),
        ({"more": 1}, 'unknown key "more"'),
    ],
    ids=str,
)
def test_a_broken_gain_file_is_told(change: dict[str, Any], message: str, tmp_path: Path) -> None:
    import tomli_w

    from softhand.settings.toml import tomllib

    table = tomllib.loads((DATA / "state_feedback.toml").read_text()) | change
    (tmp_path / "g.toml").write_text(tomli_w.dumps(table))
    refused(message, lambda: read_gain_file(tmp_path / "g.toml"))


def test_gains_of_another_hand_are_refused(tmp_path: Path) -> None:
    """Of another count of joints, and with other names; a file that is missing."""
    refused("is for a hand with 9 joints, and this hand has", lambda: softhand.build(
        with_gains(DATA / "state_feedback.toml", "gripper")).sample())  # fmt: skip
    found = read_gain_file(DATA / "state_feedback.toml")
    replace(found, joints=("other", *found.joints[1:])).write(tmp_path / "g.toml")
    refused('is for another hand: it has "other" among its joints', lambda: softhand.build(
        with_gains(tmp_path / "g.toml")).sample())  # fmt: skip
    refused(
        "none.toml cannot be read: No such file", lambda: softhand.build(with_gains(tmp_path / "none.toml")).sample()
    )


def test_the_gain_file_lies_beside_the_scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its path is relative to that of the scenario, wherever one is."""
    found = read_gain_file(DATA / "state_feedback.toml")
    found.write(tmp_path / "gains.toml")
    scenario = with_gains(tmp_path / "gains.toml").to_toml().replace(str(tmp_path / "gains.toml"), "gains.toml")
    assert 'gain_file = "gains.toml"' in scenario
    (tmp_path / "mine.toml").write_text(scenario)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    softhand.build(tmp_path / "mine.toml").sample()
    assert_allclose(read_gain_file(tmp_path / "gains.toml").K, found.K, rtol=0.0, atol=0.0)


def test_gains_of_another_period_are_refused() -> None:
    file = DATA / "state_feedback.toml"
    refused(
        "is for samples each 0.001 s, and the torque is computed each 0.002 s; set control_period or controller.period",
        lambda: softhand.build(with_gains(file, control_period=0.002)),
    )
    slower = softhand.load_scenario("hold", {"controller": {
        "name": "state-feedback", "gain_file": str(file), "period": 0.001}, "control_period": 0.0005,
        "stepper.step": 0.0005})  # fmt: skip
    softhand.build(slower).sample()


def test_gains_by_bandwidth_keep_what_they_promise() -> None:
    """The loop that `stability` finds grows as told, and in a run the box follows a swing of each frequency to 71 %."""
    found = softhand.design_gains("hold", 3.0, 0.15)
    assert np.min(found.bandwidth) >= 0.95 * 3.0 and found.damping >= 0.95 * 0.15 and found.delay > 1e-4
    scenario = softhand.load_scenario("hold", {"controller": {"name": found.name, **found.settings}})
    assert_allclose(softhand.stability(scenario).held_growth, found.growth, rtol=1e-6)
    for axis in (0, 2):
        assert_allclose(followed(scenario, axis, found.bandwidth[axis]), math.sqrt(0.5), rtol=0.05)


def followed(scenario: softhand.Scenario, axis: int, frequency: float) -> float:
    """Amplitude of the box over that of what is asked for, 0.1 mm along an axis, when the begin has died out."""
    simulation = softhand.build(scenario)
    settled, swings = 3.0, max(3, math.ceil(frequency))
    count = round((settled + swings / frequency) / scenario.control_period)
    start, seen = simulation.plant.world.object_position(simulation.state.q).copy(), []
    for k in range(count):
        phase = 2.0 * math.pi * frequency * k * scenario.control_period
        simulation.reference.now[0, axis] = start[axis] + 1e-4 * math.sin(phase)
        observation = simulation.sample()
        seen.append((phase, observation.object_position[axis] - start[axis]))
        simulation.step()
    phase, moved = np.array(seen[round(settled / scenario.control_period) :]).T
    sine, cosine, _ = np.linalg.lstsq(
        np.column_stack([np.sin(phase), np.cos(phase), np.ones_like(phase)]), moved, rcond=None
    )[0]
    return math.hypot(sine, cosine) / 1e-4


@pytest.mark.slow
def test_a_bandwidth_out_of_reach_names_the_nearest() -> None:
    """The figure that is named can be had."""
    error = refused("cannot be reached", lambda: softhand.design_gains("hold", 12.0, 0.4), GraspError)
    nearest = error.value  # type: ignore[attr-defined]
    assert 0.0 < nearest < 12.0
    assert np.min(softhand.design_gains("hold", nearest, 0.4).bandwidth) >= 0.95 * nearest


def test_the_commands(tmp_path: Path) -> None:
    """A table, a figure and a gain file; JSON; what is wrong in one line."""
    done = run_command("design", "lqr", "hold", "--out", "f.png", "--gains", "g.toml", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "state-feedback" in done.stdout and {file.name for file in tmp_path.iterdir()} == {"f.png", "g.toml"}
    again = run_command("design", "lqr", "hold", "--gains", "g.toml", folder=tmp_path)
    assert again.returncode == 1 and "is there already" in again.stderr
    wrong = run_command("design", "lqr", "hold", "--weight", "torque=-1", folder=tmp_path)
    assert wrong.returncode == 1 and "weights.torque: got -1" in wrong.stderr and "Traceback" not in wrong.stderr
    shown = run_command(
        "design", "gains", "hold", "--bandwidth", "3", "--damping", "0.15", "--json", "--out", "g.png", folder=tmp_path
    )
    assert shown.returncode == 0 and json.loads(shown.stdout)["units"]["bandwidth"] == "Hz"


def script() -> Any:
    """scripts/make_design_table.py."""
    spec = importlib.util.spec_from_file_location("make_design_table", REPOSITORY / "scripts/make_design_table.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_designed_gains_hold_target_a_where_those_of_the_paper_do_not(tmp_path: Path) -> None:
    """The short version of the table: the paper's loop loses the box within 4 s, the regulator's does not move."""
    made = script()
    paper = made.row("paper", None, 4.0)
    assert paper.growth > 5.0 and paper.held < 4.0
    softhand.design_lqr("target-a", overrides=made.HELD).save(tmp_path / "gains.toml")
    found = made.row("ours", {"name": "state-feedback", "gain_file": str(tmp_path / "gains.toml")}, 4.0)
    assert found.growth < -1.0 and found.held == 4.0 and found.strayed < 1e-8 and found.speed < 1e-6


def test_damping_at_the_object_makes_the_loop_grow_as_the_page_says() -> None:
    """The second table, each figure to its digits."""
    assert script().damping_table() in (REPOSITORY / "docs/design.md").read_text()


@pytest.mark.long
def test_the_table_of_the_page() -> None:
    """Growth, delay and the loss of the box as docs/design.md has them; the designed gains hold for 600 s."""
    found = script().rows(600.0)
    page = (REPOSITORY / "docs/design.md").read_text()
    for k, one in enumerate(found):
        cells = script().table([one]).splitlines()[2].split(" | ")
        assert " | ".join(cells[: 3 if k else 4]) in page, cells
    assert math.isinf(found[0].strayed) and all(one.held == 600.0 and one.strayed < 1e-9 for one in found[1:])
