"""A hand's URDF alone becomes a scenario that holds: tips, opposition, box, squeeze, gains; and what is told if not."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import small_hands
from commands import run_command
from numpy.testing import assert_allclose

import softhand
from softhand.assembly.plant import read_world
from softhand.assistant.fingers import Fingers, TipOnBody
from softhand.assistant.found_scenario import NewScenario
from softhand.assistant.new_scenario import new_scenario
from softhand.assistant.opposition import Opposing, Sides, _State
from softhand.assistant.tips import find_tips
from softhand.assistant.trial import CARRYING
from softhand.checks.tip_axes import doubts_of_tip_axes
from softhand.errors import GraspError, ModelError
from softhand.model.urdf.ends import COVER, FingerEnd
from softhand.model.urdf.pinocchio_model import build_model
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.spatial import rotation_of
from softhand.scenario.scenario import load_scenario
from softhand.start.reach import initial_joints

TURN = rotation_of([0.4, -0.7, 1.1])


def found_for(text: str, folder: Path) -> NewScenario:
    (folder / "hand.urdf").write_text(text)
    return new_scenario(folder / "hand.urdf", folder / "mine.toml")


def check_holds(found: NewScenario, folder: Path) -> None:
    """What was written holds against a push that the search did not try, all links outside of the object."""
    scenario = load_scenario(folder / "mine.toml")
    assert scenario == found.scenario
    weight = 9.81 * found.object_mass
    push = {"force": [-0.15 * weight, 0.1 * weight, 0.1 * weight], "start": 0.1, "duration": 0.3}
    recording = softhand.simulate(scenario.with_values({"push": [push]}))
    summary = softhand.summarize(recording)
    assert recording.complete and not summary.slipped and not summary.lost_contact
    assert summary.position_error < 1.0 and summary.orientation_error < 1.0  # mm, deg
    pushed = np.linalg.norm(recording.object_position - recording.object_position[0], axis=1)
    assert pushed.max() > 1e-5  # m: the push was felt
    colliding = softhand.collisions(scenario).found
    assert all(one.depth <= CARRYING for one in colliding if "object" in (one.one, one.other))


@pytest.mark.parametrize(
    ("make", "count"),
    [
        (small_hands.jaws, 2),
        pytest.param(small_hands.two_and_a_thumb, 3, marks=pytest.mark.slow),
        (lambda: small_hands.around(2, 0.05, [small_hands.BEND] * 3, [0.05, 0.035, 0.03]), 2),
        pytest.param(small_hands.four_by_four, 3, marks=pytest.mark.slow),
    ],
    ids=["jaws on one motor", "two joints, coupled", "two fingers", "four by four"],
)
def test_a_hand_holds(make: Callable[[], str], count: int, tmp_path: Path) -> None:
    """Each with so many tips at least."""
    found = found_for(make(), tmp_path)
    assert len(found.tips) >= count and found.margin > 0.0 and not found.remedies
    check_holds(found, tmp_path)


def test_a_joint_may_have_the_name_of_a_link(tmp_path: Path) -> None:
    """Of its own one, and of another one: nothing changes but the names."""
    text = small_hands.jaws()
    found = found_for(text, tmp_path)
    for own, other in (("left", "right"), ("right", "left")):
        folder = tmp_path / own
        folder.mkdir()
        again = found_for(text.replace("left_slide", own).replace("right_slide", other), folder)
        for one, same in zip(again.tips, found.tips, strict=True):
            assert (one.link, one.radius, one.position, one.rpy) == (same.link, same.radius, same.position, same.rpy)
        assert again.margin == found.margin and again.object_position == found.object_position


@pytest.mark.slow
def test_a_thumb_that_reaches_into_the_box_is_told(tmp_path: Path) -> None:
    """Five coupled fingers: no grasp is found, and the link that is in the way has its name and its depth."""
    with pytest.raises(GraspError, match=r"none holds.* thumb_2 is \S+ mm inside the box.* --tip"):
        found_for(small_hands.five_coupled(), tmp_path)


@pytest.mark.slow
def test_meshes_of_a_package_and_links_without_a_mass(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both are told, the density as a line of the scenario; the radius is that of the meshes, and a cover."""
    (tmp_path / "elsewhere").mkdir()
    text = small_hands.of_package(tmp_path / "elsewhere")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "elsewhere"))
    text = "".join(part.partition("</inertial>")[2] or part for part in text.split("<inertial>"))
    found = found_for(text, tmp_path)
    assert "density" in found.remedies[0] and "density = 1200.0" in (tmp_path / "mine.toml").read_text()
    for tip in found.tips:
        assert tip.radius == pytest.approx(0.008 + COVER, abs=3e-4)
        assert_allclose(tip.position, [0.0, 0.0, 0.04 + COVER - tip.radius], atol=3e-4)
        assert_allclose(rotation_of(tip.rpy)[:, 0], [0.0, 0.0, 1.0], atol=0.02)  # along z of the link
    check_holds(found, tmp_path)


# ------------------------------------------------------------------------------------------------------------- tips


def test_a_ball_covers_the_end_of_a_finger_however_it_is_turned() -> None:
    """A bar of 20 x 12 mm, 60 mm long: as wide as its thinner side; at the end, or at a side where it shall press."""
    rng = np.random.default_rng(1)
    bar = rng.uniform(-0.5, 0.5, (4000, 3)) * [0.02, 0.012, 0.06] + [0.0, 0.0, 0.03]
    z, y = TURN @ [0.0, 0.0, 1.0], TURN @ [0.0, 1.0, 0.0]
    end = FingerEnd("bar", bar @ TURN.T, z, (), True)
    centre, radius = end.fitted()
    assert radius == pytest.approx(0.006 + COVER, abs=2e-4)
    assert_allclose(TURN.T @ centre, [0.0, 0.0, 0.06 + COVER - radius], atol=5e-4)
    centre, radius = end.fitted(y)
    assert_allclose(TURN.T @ centre, [0.0, 0.006 + COVER - radius, 0.06 + COVER - radius], atol=5e-4)


def hand_of(text: str) -> tuple[Urdf, pin.Model, Fingers]:
    urdf = Urdf.parse(text, Path("hand.urdf"))
    model = build_model(urdf)
    return urdf, model, Fingers(urdf, model)


def test_tips_of_jaws_face_each_other() -> None:
    """A jaw can go one way only: x goes there, and the ball is at the end and at the inner side."""
    left, right = find_tips(*hand_of(small_hands.jaws()))
    assert_allclose(rotation_of(left.rpy)[:, 0], [1.0, 0.0, 0.0], atol=1e-3)
    assert_allclose(rotation_of(right.rpy)[:, 0], [-1.0, 0.0, 0.0], atol=1e-3)
    for tip, side in ((left, 1.0), (right, -1.0)):
        radius = tip.on_body.radius
        assert_allclose(tip.on_body.centre, [side * (0.006 + COVER - radius), 0.0, 0.08 + COVER - radius], atol=1e-4)


def test_one_finger_and_wrong_links_are_told(tmp_path: Path) -> None:
    """With the links that there are."""
    text = small_hands.hand(
        small_hands.finger("f", (0.04, 0.0), 0.0, [small_hands.BEND] * 2, [0.05, 0.05], small_hands.rod)
    )
    with pytest.raises((ModelError, GraspError), match="f_1"):
        found_for(text, tmp_path)
    (tmp_path / "jaws.urdf").write_text(small_hands.jaws())
    with pytest.raises(ModelError, match=r"no link is called 'thumb'.* left, right"):
        new_scenario(tmp_path / "jaws.urdf", tips=["thumb"])


def test_fingers_that_cannot_oppose_are_told(tmp_path: Path) -> None:
    """Two fingers that bend away from each other: which, and what is missing."""
    joints, lengths = [("0 1 0", 0.0, 0.8, ""), ("0 1 0", 0.0, 0.8, "")], [0.05, 0.05]
    away = [
        small_hands.finger(name, (x, 0.0), heading, joints, lengths, small_hands.rod)  # type: ignore[arg-type]
        for name, x, heading in (("a", 0.05, 0.0), ("b", -0.05, np.pi))
    ]
    with pytest.raises(GraspError, match=r"a_1_tip and b_1_tip: .*(deg|mm)"):
        found_for(small_hands.hand(*away), tmp_path)


# ------------------------------------------------------------------------------------------------------- opposition


def three_fingers() -> tuple[Fingers, list[TipOnBody]]:
    urdf, model, fingers = hand_of(
        small_hands.around(3, 0.05, [small_hands.SPREAD, small_hands.BEND, small_hands.FOLLOWS], [0.0, 0.05, 0.04])
    )
    return fingers, [tip.on_body for tip in find_tips(urdf, model, fingers)]


def test_slopes_of_an_opposition() -> None:
    """Against differences, in general position, by coupled motors, the turn of the normal and both planes."""
    fingers, tips = three_fingers()
    opposing, sides = Opposing(fingers, tips, (0.02, 0.03)), Sides((0, 2, 1), 1)
    rng = np.random.default_rng(2)
    normal = rng.normal(size=3)
    used = [tips[i] for i in sides.fingers]
    state = _State(rng.uniform(fingers.low, fingers.high), normal / np.linalg.norm(normal), 0.05, -0.01)
    free, reach = np.arange(fingers.n), np.array([0.009, 0.008, 0.007])
    _, J = opposing._errors(sides, used, reach, state, free)
    h = 1e-6
    for k in range(J.shape[1]):
        step = np.zeros(J.shape[1])
        step[k] = h
        ahead, _ = opposing._errors(sides, used, reach, opposing._stepped(state, step, free), free)
        behind, _ = opposing._errors(sides, used, reach, opposing._stepped(state, -step, free), free)
        assert_allclose((ahead - behind) / (2.0 * h), J[:, k], rtol=2e-5, atol=1e-3 * np.abs(J[:, k]).max())


def test_an_opposition_is_what_it_says() -> None:
    """Each ball is on its plane, as deep as asked for, and leans against it; the sides do not change places."""
    fingers, tips = three_fingers()
    depths = np.array([0.5e-3, 1.0e-3, 1.5e-3])
    start = fingers.at(fingers.rest, tips)
    normal = start.centres[0] - start.centres[1:].mean(axis=0)
    one = Opposing(fingers, tips, (0.01, 0.08)).find(Sides((0, 1, 2), 1), fingers.rest, normal, None, depths)
    assert one.is_found((0.01, 0.08))
    there = fingers.at(one.motors, tips)
    for i, (plane, sign) in enumerate(((one.planes[0], 1.0), (one.planes[1], -1.0), (one.planes[1], -1.0))):
        surface = there.centres[i] @ one.normal - sign * (tips[i].radius - depths[i])
        assert surface == pytest.approx(plane, abs=2e-5)
        assert -sign * there.out[i] @ one.normal == pytest.approx(one.leaning[i]) and one.leaning[i] > 0.3
    assert one.width > 0.0


# ---------------------------------------------------------------------------------------------------- doubts, command


@pytest.mark.parametrize(
    ("rpy", "words"),
    [
        ((0.0, 0.0, 3.1), "into the finger"),
        ((0.0, 1.5, 0.0), "sideways"),
        ((0.2, 0.4, -0.5), ""),
        ((1.0, 0.0, 0.0), ""),
    ],
)
def test_a_tip_that_points_elsewhere_is_doubted(rpy: tuple[float, float, float], words: str) -> None:
    """And the table that the warning proposes is doubted no more."""
    tips = [{"name": "a", "frame": "finger_1_tip", "rpy": rpy}, "finger_2_tip", "finger_3_tip"]
    scenario = load_scenario("target-a", {"hand.tips": tips})
    world = read_world(scenario)
    doubts = list(doubts_of_tip_axes(world, initial_joints(world, scenario.grasp.joint_guess)))
    assert len(doubts) == bool(words)
    if words:
        assert doubts[0].startswith(f"a: x of this tip points {words}")
        table = doubts[0].partition("{")[2].partition("}")[0]
        frame = table.partition('frame = "')[2].partition('"')[0]
        position, turned = (
            json.loads(table.partition(f"{key} = ")[2].partition("]")[0] + "]") for key in ("position", "rpy")
        )
        mended = {"name": "a", "frame": frame, "position": position, "rpy": turned}
        world = read_world(load_scenario("target-a", {"hand.tips": [mended, *tips[1:]]}))
        assert not list(doubts_of_tip_axes(world, initial_joints(world, scenario.grasp.joint_guess)))


def test_jaws_may_press_with_their_sides_and_not_with_their_backs() -> None:
    """The shipped gripper is not doubted; with x across the way of its jaws it is."""
    scenario = load_scenario("gripper")
    world = read_world(scenario)
    assert not list(doubts_of_tip_axes(world, initial_joints(world, None)))
    tips = [{"frame": "left_tip", "rpy": [0.0, 0.0, 1.5708]}, "right_tip"]
    world = read_world(load_scenario("gripper", {"hand.tips": tips}))
    assert len(list(doubts_of_tip_axes(world, initial_joints(world, None)))) == 1


def test_the_command(tmp_path: Path) -> None:
    """Right once with all that is written, and wrong in each way, with nothing written."""
    (tmp_path / "jaws.urdf").write_text(small_hands.jaws())
    for words, told in (
        (["jaws.urdf", "--tip", "thumb"], "no link is called 'thumb'"),
        (["jaws.urdf", "--like", "pinch"], "--like"),
        (["jaws.urdf", "--out", "mine.txt"], ".toml"),
        (["none.urdf"], "no such URDF"),
        (["mine.txt"], ".urdf"),
        (["mine.toml", "--tip", "left"], "--tip"),
    ):
        ended = run_command("new", *words, folder=tmp_path)
        assert ended.returncode == 1 and told in ended.errors, words
        assert [file.name for file in tmp_path.iterdir()] == ["jaws.urdf"]
    ended = run_command("new", "jaws.urdf", "--json", folder=tmp_path)
    assert ended.returncode == 0, ended.errors
    found = json.loads(ended.stdout)
    assert len(found["tips"]) == 2 and found["margin"] > 0.0 and found["units"]["margin"] == "N/N"
    names = {"jaws.urdf", "jaws.toml", "jaws-box.urdf", "jaws.png"}
    assert {file.name for file in tmp_path.iterdir()} == names
    again = run_command("new", "jaws.urdf", folder=tmp_path)
    assert again.returncode == 1 and "is there already" in again.errors
    assert run_command("check", "jaws.toml", folder=tmp_path).returncode == 0
