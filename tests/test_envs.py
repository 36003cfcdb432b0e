"""Environments: what Gymnasium asks of them, seeds, worlds side by side, and that actions do what they shall."""

from __future__ import annotations

import sys
import warnings
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

import softhand
from softhand import Controller, LinearSetPoint, ScenarioError, SofthandError
from softhand.controllers.linear_set_point import SHAPE, features

gymnasium = pytest.importorskip("gymnasium", reason="needs the extra gym: pip install 'softhand[gym]'")

import softhand.envs  # noqa: E402
from softhand.envs import goals  # noqa: E402
from softhand.envs.episodes import Episodes  # noqa: E402
from softhand.envs.options import read_options, scenario_of  # noqa: E402
from softhand.envs.tasks import TASKS  # noqa: E402

NAMES = [f"softhand/{task}{touch}-v0" for task in TASKS for touch in ("", "Touch")]
ALL = np.ones(1, bool)


def episodes(task: str, seed: int = 0, count: int = 1, **options: Any) -> Episodes:
    """At the start of the first."""
    found = Episodes(task, options, count)
    found.begin(range(count), [np.random.default_rng(seed + k) for k in range(count)])
    return found


@pytest.mark.parametrize("name", NAMES)
def test_gymnasium_has_nothing_to_say(name: str) -> None:
    """Its checker passes without a warning."""
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make(name)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)
    env.close()
    env.close()


@pytest.mark.parametrize("action", ["set-point", "internal-force", "joint-set-point", "torque", "plain-torque"])
def test_each_kind_of_action_is_checked_too(action: str) -> None:
    """With the sparse reward, and a world as it is."""
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make("softhand/ReorientBox-v0", action=action, reward="sparse", randomise={})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_worlds_side_by_side_are_single_ones(mode: str) -> None:
    """To the last bit, what is told beside included, through ends before the time, ends of the time and new worlds."""
    name, options = "softhand/HoldBox-v0", {"action": "torque", "max_episode_steps": 20}
    mine = gymnasium.make_vec(name, num_envs=3, threads=2, autoreset_mode=mode, episodes_per_world=2, **options)
    makers = [lambda: gymnasium.make(name, episodes_per_world=2, **options)] * 3
    single = gymnasium.vector.SyncVectorEnv(makers, autoreset_mode=mode)
    assert_same(mine.reset(seed=5), single.reset(seed=5))
    rng, ends = np.random.default_rng(0), np.zeros(2, int)
    for _ in range(60):
        actions = (rng.uniform(-1.0, 1.0, (3, 9)) * [[0.1], [0.1], [0.6]] + [[0.9], [0.0], [0.0]]).astype(np.float32)
        found = mine.step(actions)
        assert_same(found, single.step(actions))
        ends += found[2].sum(), found[3].sum()
    assert ends.all()
    mine.close()


def assert_same(one: Any, other: Any) -> None:
    """Arrays, dicts and tuples of them, to the last bit."""
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for key, value in one.items():
            assert_same(value, other[key])
    elif isinstance(one, tuple) or (isinstance(one, np.ndarray) and one.dtype == object):
        for mine, its in zip(one, other, strict=True):
            assert_same(mine, its)
    else:
        assert_array_equal(one, other)


def test_the_mask_of_a_reset_begins_some_worlds_only() -> None:
    """The others stay as they are; in the mode without resets of its own an episode that is over must be begun."""
    mode = gymnasium.vector.AutoresetMode.DISABLED
    envs = gymnasium.make_vec("softhand/HoldBox-v0", num_envs=2, threads=1, autoreset_mode=mode, max_episode_steps=3)
    before, _ = envs.reset(seed=0)
    for _ in range(3):
        last, *_, truncated, _ = envs.step(np.zeros((2, 6), np.float32))
    assert truncated.all()
    with pytest.raises(ScenarioError, match="reset"):
        envs.step(np.zeros((2, 6), np.float32))
    after, _ = envs.reset(seed=[0, None], options={"reset_mask": np.array([True, False])})
    assert_array_equal(after["observation"][0], before["observation"][0])
    assert_array_equal(after["observation"][1], last["observation"][1])


def test_worlds_are_drawn_within_their_bounds_and_are_what_they_are_said_to_be() -> None:
    """The tips carry the weight that was drawn; a law of twice the stiffness gives way by less."""
    spread = {"mass": 0.5, "stiffness": 0.3}
    env = gymnasium.make("softhand/ReorientBoxTouch-v0", randomise=spread)
    drawn, depth = [], []
    for seed in range(12):
        _, info = env.reset(seed=seed)
        seen = env.unwrapped.episodes.worlds.runs[0].observation
        forces = np.einsum("iab,ib->ia", seen.contact_rotation, seen.contact_force[:, :3])
        weight = info["world"]["object.mass"] * 9.81
        assert np.abs(forces.sum(axis=0)) == pytest.approx([0.0, 0.0, weight], abs=1e-9)
        drawn.append([info["world"]["object.mass"] / 0.2, info["world"]["fingertip.k_r"] / 0.377e6])
        assert info["world"]["fingertip.k_psi"] / 0.0488e9 == pytest.approx(drawn[-1][1])
        depth.append(seen.deformation[0, 0])
    shares = np.array(drawn)
    assert np.all(np.abs(shares - 1.0) <= [0.5, 0.3]) and np.all(np.ptp(shares, axis=0) > [0.5, 0.3])
    assert np.corrcoef(shares[:, 1], depth)[0, 1] < -0.5


@pytest.mark.parametrize("k", range(6))
def test_a_set_point_is_followed(k: int) -> None:
    """Each number moves the box along or about its own axis, at both signs, as far as asked."""
    found = episodes("ReorientBox", randomise={}, count=2)
    start, actions = found.achieved(), np.zeros((2, 6))
    actions[:, k] = 0.5, -0.5
    for step in range(220):
        found.step(actions * (step < 10), np.ones(2, bool))
    end = found.achieved()
    turn = (Rotation.from_quat(end[:, 3:]) * Rotation.from_quat(start[:, 3:]).inv()).as_rotvec()
    moved = np.hstack([end[:, :3] - start[:, :3], turn])
    asked = np.array([0.005, -0.005]) if k < 3 else np.array([0.05, -0.05])
    assert_allclose(moved[:, k], asked, rtol=0.08)
    other = np.delete(moved / ([0.005] * 3 + [0.05] * 3), k, axis=1)
    assert np.abs(other).max() < 0.12
    ahead = found.observation()[:, -6:]
    assert_allclose(ahead[:, k], asked - moved[:, k], atol=1e-9)


def test_internal_forces_come_to_what_is_asked() -> None:
    """Between the pair that is meant, while the box goes to its goal."""
    found = episodes("ReorientBox", seed=3, action="internal-force", randomise={})
    before = found.worlds.seen["internal_force"][0].copy()
    for step in range(150):
        outcome = found.step([[1.0 * (step < 10), -0.5 * (step < 10), 0.0]], ALL)
    change = found.worlds.seen["internal_force"][0] - before
    assert_allclose(change, [2.0, -1.0, 0.0], atol=0.15)
    assert outcome.is_success.all()


def test_torques_are_those_of_the_start_and_the_action() -> None:
    """No action holds at first; and a run of `simulate` under the same torques goes the same way."""
    found = episodes("ReorientBox", action="torque", randomise={})
    start = found.worlds.runs[0].observation.joint_position.copy()
    held = found.worlds.commands[0].copy()
    found.step(np.zeros((1, 9)), ALL)
    assert np.abs(found.worlds.seen["joint_velocity"]).max() < 1e-4
    found = episodes("ReorientBox", action="torque", randomise={})
    action = np.linspace(-0.4, 0.5, 9)
    for _ in range(3):
        found.step(action[None], ALL)
    told = Told(torques=tuple(held + 0.1 * action))
    alone = softhand.simulate(scenario_of(TASKS["ReorientBox"], found.options), told, duration=0.03)
    assert_allclose(found.worlds.seen["joint_position"][0], alone.joint_position[-1], atol=1e-10)
    assert np.abs(alone.joint_position[-1] - start).max() > 1e-3


class Told(Controller):
    """Torques beside the weight of the hand."""

    torques: tuple[float, ...]

    def torque(self, observation: Any, memory: Any) -> Any:
        return observation.gravity_torque + np.array(self.torques) - 0.03 * observation.joint_velocity, memory


def test_joint_set_points_are_springs() -> None:
    """Where the box is not in the way: open fingers go to where they are asked to be."""
    found = episodes("GraspAndLift", action="joint-set-point", randomise={})
    before = found.worlds.seen["joint_position"][0].copy()
    action = np.zeros((1, 9))
    action[0, [0, 4]] = 0.5, -1.0
    for step in range(60):
        found.step(action * (step < 5), ALL)
    change = found.worlds.seen["joint_position"][0] - before
    expected = np.zeros(9)
    expected[[0, 4]] = 0.05, -0.1
    assert_allclose(change, expected, atol=2e-3)


def test_grasp_and_lift_can_be_done() -> None:
    """By hand: close, squeeze, go to the goal; the box stands where it shall, off the table."""
    found = episodes("GraspAndLift", seed=1, count=2)
    start = found.achieved()
    for step in range(400):
        actions = np.zeros((2, 8))
        actions[:, 6] = -1.0 if step < 40 else 0.0
        actions[:, 7] = 1.0 if 60 <= step < 110 else 0.0
        if step >= 130:
            turn = (
                Rotation.from_quat(found.goals[:, 3:]) * Rotation.from_quat(found.achieved()[:, 3:]).inv()
            ).as_rotvec()
            ahead = np.hstack([found.goals[:, :3] - found.achieved()[:, :3], turn]) - found.observation()[:, -8:-2]
            actions[:, :6] = ahead / ([1e-3] * 3 + [1e-2] * 3) / 5.0
        outcome = found.step(actions, np.ones(2, bool))
        assert not outcome.terminated.any(), found.why(0)
    assert outcome.is_success.all()
    assert np.all(found.achieved()[:, 2] - start[:, 2] < -0.015)  # up is -z: the hand hangs


def test_a_box_that_is_let_go_ends_the_episode() -> None:
    """The reason is told, and reward and observation are those of the last good moment."""
    env = gymnasium.make("softhand/HoldBox-v0", action="plain-torque")
    env.reset(seed=0)
    observation, reward, terminated, truncated, info = env.step(np.zeros(9, np.float32))
    while not terminated:
        observation, reward, terminated, truncated, info = env.step(np.zeros(9, np.float32))
    assert info["ended"] in ("slipped off", "lost", "rim", "apex") and not info["is_success"] and not truncated
    assert np.isfinite(reward) and all(np.isfinite(part).all() for part in observation.values())
    assert env.unwrapped.compute_terminated(observation["achieved_goal"], observation["desired_goal"], info)


def test_rewards_can_be_computed_for_other_goals() -> None:
    """For many at once, with infos of a batch or in a list: what `step` gave, and the same for either sign of q."""
    env = gymnasium.make("softhand/HoldBox-v0", squeeze_cost=0.03)
    observation, _ = env.reset(seed=2)
    rows, infos, rewards = [], [], []
    rng = np.random.default_rng(0)
    for _ in range(6):
        observation, reward, _, _, info = env.step(rng.uniform(-1.0, 1.0, 6))
        rows.append(observation)
        infos.append(info)
        rewards.append(reward)
    compute = env.unwrapped.compute_reward
    achieved, desired = (np.array([row[name] for row in rows]) for name in ("achieved_goal", "desired_goal"))
    assert_array_equal(compute(achieved, desired, infos), rewards)
    assert_array_equal(compute(achieved, desired, {"cost": np.array([info["cost"] for info in infos])}), rewards)
    assert compute(achieved[2], desired[2], infos[2]) == rewards[2]
    assert_allclose(compute(achieved, desired * ([1.0] * 3 + [-1.0] * 4), infos), rewards)
    squeeze = env.unwrapped.episodes.worlds.seen["internal_force"][0].mean()
    assert infos[-1]["cost"] == pytest.approx(0.03 * squeeze)


def test_errors_of_poses_are_those_of_rotations() -> None:
    """In general position, from tiny to half a turn; a dense reward is 1/2 at one scale off, a sparse one 0 or 1."""
    rng = np.random.default_rng(1)
    one = Rotation.random(200, random_state=2)
    by = rng.normal(size=(200, 3))
    by *= (np.geomspace(1e-9, 3.1, 200) / np.linalg.norm(by, axis=1))[:, None]
    places = rng.normal(size=(2, 200, 3))
    now = np.hstack([places[0], one.as_quat()])
    goal = np.hstack([places[1], (Rotation.from_rotvec(by) * one).as_quat()])
    distance, angle = goals.errors(now, goal)
    assert_allclose(distance, np.linalg.norm(places[0] - places[1], axis=1))
    assert_allclose(angle, np.linalg.norm(by, axis=1), rtol=1e-6, atol=1e-15)
    measure = goals.Measure((0.002, 0.035), (0.005, 0.087), True)
    start = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    along = np.eye(7)[0]
    assert goals.reward(start + 0.005 * along, start, measure) == pytest.approx(0.5)
    sparse = measure._replace(is_dense=False)
    assert [float(goals.reward(start + d * along, start, sparse)) for d in (0.0019, 0.0021)] == [1.0, 0.0]


def test_a_policy_does_the_same_as_a_controller() -> None:
    """In the environment and in a run of `simulate`, step by step, until the box is near its goal."""
    rng = np.random.default_rng(4)
    weights = 0.2 * rng.normal(size=SHAPE)
    weights[:, :6] += np.eye(6)
    weights[:, 6:12] -= np.eye(6)
    found = episodes("ReorientBox", seed=7, randomise={})
    path = []
    for _ in range(60):
        observation = {
            "observation": found.observation(),
            "achieved_goal": found.achieved(),
            "desired_goal": found.goals,
        }
        path.append(found.achieved()[0])
        found.step(LinearSetPoint.actions(weights, observation), ALL)
    goal = found.goals[0]
    step = {"kind": "step", "object_position": goal[:3].tolist(), "internal_force": [4.0, 4.0, 3.0],
            "object_rpy": Rotation.from_quat(goal[3:]).as_euler("xyz").tolist()}  # fmt: skip
    task = scenario_of(TASKS["ReorientBox"], found.options).with_values({"duration": 0.6, "reference": step})
    alone = softhand.simulate(task, LinearSetPoint(weights=tuple(weights.ravel())))
    assert_allclose(np.array(path)[:, :3], alone.object_position[:-1:10], atol=1e-9)
    turned = Rotation.from_euler("xyz", alone.object_rpy[:-1:10]) * Rotation.from_quat(np.array(path)[:, 3:]).inv()
    assert turned.magnitude().max() < 1e-8
    assert np.linalg.norm(path[-1][:3] - path[0][:3]) > 1e-3
    assert features(observation).shape == (1, SHAPE[1])


@pytest.mark.parametrize(
    ("task", "options", "told"),
    [
        ("HoldBox", {"action": "torqe"}, ["action", "torqe", "torque"]),
        ("HoldBoxes", {}, ["HoldBoxes", "HoldBox"]),
        ("HoldBox", {"reward": "shaped"}, ["reward", "shaped", "dense"]),
        ("HoldBox", {"randomize": {}}, ["randomize", "randomise"]),
        ("HoldBox", {"randomise": {"masss": 0.1}}, ["randomise.masss", "mass"]),
        ("HoldBox", {"randomise": {"object.urdf": 0.1}}, ["randomise.object.urdf", "number"]),
        ("HoldBox", {"randomise": {"mass": 1.0}}, ["randomise.mass", "1.0", "below 1"]),
        ("HoldBox", {"scenario": "hodl"}, ["hodl", "hold"]),
        ("HoldBox", {"scenario": 3}, ["scenario", "3"]),
        ("HoldBox", {"scenario": "grasp-and-lift"}, ["grasp.opening"]),
        ("HoldBox", {"overrides": {"object.mas": 0.1}}, ["object.mas", "object.mass"]),
        ("HoldBox", {"action_period": 0.0105}, ["action_period", "0.0105"]),
        ("HoldBox", {"episodes_per_world": 0}, ["episodes_per_world"]),
        ("GraspAndLift", {"action": "internal-force"}, ["internal-force", "off the object"]),
    ],
    ids=str,
)
def test_what_is_wrong_with_an_option_is_told(task: str, options: dict[str, Any], told: list[str]) -> None:
    """With its name, its value and what would be right."""
    with pytest.raises(SofthandError) as error:
        Episodes(task, options)
    for text in told:
        assert text in str(error.value)


@pytest.mark.parametrize(
    ("action", "told"),
    [
        (np.full(6, np.nan), "nan.*finite"),
        ([0.0, 0.0, 0.0, 0.0, 0.0, np.inf], "inf.*finite"),
        (np.zeros(5), r"shape \(5,\).*6 numbers"),
        (np.zeros((1, 6)), r"shape \(1, 6\).*6 numbers"),
        ("left", "left.*6 numbers"),
    ],
    ids=["nan", "infinite", "short", "batched", "text"],
)
def test_wrong_actions_are_told(action: Any, told: str) -> None:
    """And change nothing."""
    env = gymnasium.make("softhand/HoldBox-v0", randomise={}).unwrapped
    with pytest.raises(ScenarioError, match="reset"):
        env.step(np.zeros(6))
    before, _ = env.reset(seed=0)
    with pytest.raises(ScenarioError, match=told):
        env.step(action)
    assert_array_equal(env.episodes.observation()[0], before["observation"])


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"num_envs": 0}, "num_envs"), ({"threads": 0}, "threads"), ({"render_mode": "human"}, "single environment"),
        ({"autoreset_mode": "sometimes"}, "sometimes.*NextStep"), ({"max_episode_steps": 0}, "max_episode_steps"),
    ],
    ids=str,
)  # fmt: skip
def test_wrong_options_of_many_worlds_are_told(options: dict[str, Any], told: str) -> None:
    """By name."""
    from softhand.envs.vector_env import HandVectorEnv

    with pytest.raises(ScenarioError, match=told):
        HandVectorEnv(**options)


def test_wrong_seeds_and_masks_are_told() -> None:
    """With how many there must be."""
    envs = gymnasium.make_vec("softhand/HoldBox-v0", num_envs=2, threads=1, randomise={})
    with pytest.raises(ScenarioError, match="3 seeds for 2"):
        envs.reset(seed=[1, 2, 3])
    with pytest.raises(ScenarioError, match="reset"):
        envs.step(np.zeros((2, 6)))
    envs.reset(seed=1)
    with pytest.raises(ScenarioError, match="reset_mask"):
        envs.reset(options={"reset_mask": [True, False]})
    with pytest.raises(ScenarioError, match=r"shape \(3, 6\)"):
        envs.step(np.zeros((3, 6)))


def test_without_gymnasium_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the place of a bare ImportError."""
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    monkeypatch.delitem(sys.modules, "softhand.envs")
    with pytest.raises(SofthandError, match=r"gymnasium.*softhand\[gym\]"):
        import softhand.envs  # noqa: F401


def test_a_world_of_ones_own() -> None:
    """Another hand and object: two fingers that hold a plate."""
    env = gymnasium.make("softhand/HoldBox-v0", scenario="pinch", randomise={"mass": 0.1})
    _, info = env.reset(seed=0)
    assert env.action_space.shape == (6,) and list(info["world"]) == ["object.mass"]
    _, reward, *_ = env.step(np.zeros(6, np.float32))
    assert 0.0 < reward <= 1.0
    assert read_options("HoldBox", {}).action == "set-point"


def test_an_environment_has_the_forces_of_all_taxels():
    """Their sums are those of the contacts; one world and several; checked by gymnasium."""
    options = {"overrides": {"tactile.count": 12}, "randomise": {}}
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make("softhand/HoldBoxTactile-v0", **options)
    check_env(env.unwrapped, skip_render_check=True)
    seen, _ = env.reset(seed=0)
    for _ in range(2):
        seen, *_ = env.step(env.action_space.sample())
    plain = gymnasium.make("softhand/HoldBox-v0", randomise={})
    assert len(seen["observation"]) == plain.observation_space["observation"].shape[0] + 3 * 12 * 3
    worlds = env.unwrapped.episodes.worlds.seen
    assert_allclose(worlds["tactile_normal_force"].sum(axis=2), worlds["contact_force"][..., 2], atol=1e-12)
    assert np.isin(worlds["tactile_shear_force"][0].ravel(), seen["observation"]).all()
    several = gymnasium.make_vec("softhand/HoldBoxTactile-v0", num_envs=2, **options)
    first, _ = several.reset(seed=0)
    alone, _ = env.reset(seed=1)
    assert np.array_equal(first["observation"][1], alone["observation"])
    for one in (env, plain, several):
        one.close()
